"""The run itself, what became of its nodes, faults and clocks."""

from netsim.metrics.metric import grouped

METRICS = (
    *grouped(
        "run",
        ("scenario", "", "", "Name of the scenario.", "scenario"),
        ("seed", "", "", "Seed of the scenario's random streams.", "scenario"),
        ("interrupted", "", "", "Whether the run was ended from outside before its time.", "scenario"),
        ("simulated_s", "s", "", "Simulated time from the start to the end of the run.", "EnergyLedger"),
        ("nodes", "1", "", "Number of nodes, sinks included.", "NodeTable"),
        ("nodes_finished", "1", "higher", "Nodes whose algorithm ended by itself in their last life.", "NodeLife"),
        ("nodes_failed", "1", "lower", "Nodes whose algorithm raised an error in their last life.", "NodeLife"),
        (
            "nodes_died",
            "1",
            "lower",
            "Nodes whose battery ran empty while their algorithm was running; one that ran empty after its "
            "algorithm had ended is counted by how that ended (see `deaths` for all).",
            "NodeLife",
        ),
        (
            "nodes_crashed",
            "1",
            "lower",
            "Nodes that a fault brought down before their algorithm ended, and that stayed down.",
            "NodeLife",
        ),
    ),
    *grouped(
        "faults",
        ("crashes", "1", "", "Crashes over all nodes. These four are missing where nothing struck.", "NodeLife"),
        ("reboots", "1", "", "How often a crashed node came up again.", "NodeLife"),
        (
            "crashed_time_s",
            "s",
            "",
            "Time from crash to reboot or the end of the run, summed over all nodes.",
            "NodeLife",
        ),
        (
            "fault_strikes_by_rule",
            "1",
            "",
            "By fault rule (its position in the scenario and its type): nodes that it brought down, and frames, "
            "packets and readings that it spoilt, each counted once a node. Jamming is told by the outcomes of "
            "frames instead.",
            "Fault",
        ),
    ),
    *grouped(
        "clocks",
        (
            "clock_error_max_s",
            "s",
            "lower",
            "Largest absolute difference of a node's clock, synchronisation included, and true time, over all "
            "nodes and samples. The clock figures are missing where all clocks are perfect.",
            "NodeClocks",
        ),
        (
            "clock_error_rms_s",
            "s",
            "lower",
            "Root mean square of that difference over all nodes and samples.",
            "NodeClocks",
        ),
        (
            "clock_spread_max_s",
            "s",
            "lower",
            "Largest difference, over the samples, between the clock that is furthest ahead and that furthest behind.",
            "NodeClocks",
        ),
        ("clock_spread_last_s", "s", "lower", "The same at the last sample.", "NodeClocks"),
    ),
)
