"""Joules, and what became of energy allowances."""

from netsim.metrics.metric import grouped

METRICS = (
    *grouped(
        "energy",
        ("energy_j", "J", "lower", "Energy drawn by all devices of all nodes over the whole run.", "EnergyLedger"),
        (
            "energy_from_batteries_j",
            "J",
            "lower",
            "The same of the nodes that live on a battery: without those on mains power, such as a sink.",
            "EnergyLedger, NodeTable",
        ),
        (
            "energy_beyond_listening_j",
            "J",
            "lower",
            "Energy drawn, less that of a radio that listens and receives nothing, and of devices that are "
            "asleep, idle, off or dead: what is left is transmitting, receiving and overhearing, switching and "
            "waking, computing and sensing. With a MAC that always listens `energy_j` is all but constant, and "
            "algorithms differ in this alone.",
            "EnergyLedger",
        ),
        (
            "energy_beyond_listening_most_j",
            "J",
            "lower",
            "The same of the node that drew most of it; null where no node drew any.",
            "EnergyLedger",
        ),
        (
            "energy_by_device_j",
            "J",
            "lower",
            "By device (`radio`, `cpu`, `sensor`): energy drawn, over all nodes.",
            "EnergyLedger",
        ),
        (
            "energy_by_state_j",
            "J",
            "lower",
            "By device and state (`radio.listen`, `radio.transmit`, `cpu.active`, ...): energy drawn, over all nodes.",
            "EnergyLedger",
        ),
        (
            "energy_by_kind_j",
            "J",
            "lower",
            "By kind of the message served, `(none)` where none was: energy drawn, over all nodes.",
            "EnergyLedger",
        ),
        ("energy_by_node_j", "J", "lower", "By the node's name: energy drawn.", "EnergyLedger, NodeTable"),
        (
            "energy_most_node",
            "",
            "",
            "Name of the node that drew most, of equals the one with the lowest id; null where no node drew anything.",
            "EnergyLedger, NodeTable",
        ),
        ("energy_most_j", "J", "lower", "What that node drew.", "EnergyLedger"),
        (
            "energy_harvested_j",
            "J",
            "",
            "Energy that harvesters offered, over all nodes; 0 without any.",
            "EnergyHarvest",
        ),
        ("energy_spilled_j", "J", "lower", "Of that, what found the battery full.", "EnergyHarvest"),
        ("deaths", "1", "lower", "Nodes whose battery ran empty within the run.", "NodeLife"),
        ("death_by_node_s", "s", "higher", "By the node's name: when its battery ran empty.", "NodeLife, NodeTable"),
        ("first_death_s", "s", "higher", "When the first battery ran empty; null if none did.", "NodeLife"),
    ),
    *grouped(
        "allowances",
        (
            "energy_allowance_short",
            "1",
            "lower",
            "How often a node's or a task's energy allowance was used up. The figures of this group are missing "
            "where no allowance ran short and no task ended.",
            "EnergyBudget",
        ),
        ("energy_allowance_short_nodes", "1", "lower", "On how many nodes that happened.", "EnergyBudget"),
        (
            "energy_refused",
            "1",
            "lower",
            "By action (`send`, `sense`, `compute`): how often it was refused for want of allowance.",
            "EnergyBudget",
        ),
        ("energy_by_task_j", "J", "lower", "By task: what tasks that have ended drew, over all nodes.", "EnergyBudget"),
    ),
)
