"""Tracking at one centre, and what it costs by the formulas of Table 2."""

from netsim.metrics.metric import grouped

LIU_2002 = "Liu, Reich, Zhao 2002"
_TABLE_2 = f"Handoff, Belief, NodeTable, FieldInfo, Problem; {LIU_2002}, Table 2"
_READINGS = f"MessageSent, NodeTable; {LIU_2002}, Table 2"

METRICS = (
    *grouped(
        "tracking: fusion at a centre",
        (
            "fused_steps",
            "1",
            "",
            "Reading instants whose readings a centre fused; the figures on fusion are missing without any.",
            "AlgorithmRecord `fused`",
        ),
        (
            "fused_readings_mean",
            "1",
            "higher",
            "Readings that it had of each of them by its deadline, mean.",
            f"AlgorithmRecord `fused`; {LIU_2002}, eq 4",
        ),
        ("fused_readings_least", "1", "higher", "The least of the same.", "AlgorithmRecord `fused`"),
        (
            "readings_late",
            "1",
            "lower",
            "Readings that reached the centre after their deadline and were left out; those after the last fusion are not "
            "counted.",
            "AlgorithmRecord `fused`",
        ),
    ),
    *grouped(
        "tracking: cost models of Table 2",
        (
            "table2_distributed_operations",
            "1",
            "lower",
            "Computation O(N belief) with a factor of one: candidates times cells of the leader's belief, summed over all "
            "hand-offs. The table is of a single step: divide by the hand-offs. The distributed figures are missing "
            "without a hand-off.",
            _TABLE_2,
        ),
        (
            "table2_distributed_bit",
            "bit",
            "lower",
            "Communication O(belief): bits of the payload, summed over all hand-offs, each try to another node.",
            _TABLE_2,
        ),
        (
            "table2_distributed_j",
            "J",
            "lower",
            "Communication energy O(belief d^alpha): these bits times the square of the distance between leader and next "
            "leader (alpha = 2) times 10 pJ, the amplifier of the first-order radio model (Heinzelman, Chandrakasan, "
            "Balakrishnan 2002). As in the table, whatever else a radio draws is neglected; `energy_by_kind_j.handoff` is "
            "what the simulated radios drew.",
            _TABLE_2,
        ),
        (
            "table2_centralised_operations",
            "1",
            "lower",
            "Computation O(K belief) of a centre that gets K readings: sensors times cells of the belief, summed over all "
            "beliefs but those of step 0.",
            _TABLE_2,
        ),
        (
            "table2_centralised_bit",
            "bit",
            "lower",
            "Communication O(K belief): as if at every hand-off every sensor told a centre as many bits as were handed "
            "over, as the table has it.",
            _TABLE_2,
        ),
        (
            "table2_centralised_j",
            "J",
            "lower",
            "Energy of the same: each sensor's bits times the square of its distance from the centre times 10 pJ. The "
            "centre is the first sink, or else the middle of the field.",
            _TABLE_2,
        ),
        (
            "table2_readings_bit",
            "bit",
            "lower",
            "What sensors told a sink that fuses readings: bits of the payload of all messages of the kind `reading` to a "
            "sink, each counted once, whatever its hops. Missing where there are none.",
            _READINGS,
        ),
        (
            "table2_readings_j",
            "J",
            "lower",
            "Energy of the same in one hop each: bits times the square of the distance from the sink times 10 pJ.",
            _READINGS,
        ),
    ),
)
