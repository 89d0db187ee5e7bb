"""How long the nodes last, extrapolated to days."""

from dataclasses import replace

from netsim.metrics.metric import grouped

EXTRAPOLATED = (
    "Extrapolated from the run by the scenario's `duty_plan`, not simulated; missing without such a plan, null for "
    "never."
)
PLANNED = "EnergyLedger, NodeLife, scenario"

_FIGURES = grouped(
    "lifetime",
    (
        "lifetime_first_dead_days",
        "day",
        "higher",
        "Until the first node's battery is empty.",
        f"{PLANNED}; Dietrich, Dressler 2009",
    ),
    (
        "lifetime_median_days",
        "day",
        "higher",
        "Until half of the nodes on batteries are dead: of n, the ceil(n / 2)-th death.",
        PLANNED,
    ),
    (
        "lifetime_partition_days",
        "day",
        "higher",
        "Until the network falls apart: from that day on its living nodes are not all connected with each other "
        "by links between living nodes, or fewer than two live. The network is what is connected with a sink at "
        "the start (several sinks that are not: each network for itself, the first counts), without sinks the "
        "largest component. A link has a packet reception ratio of 0.5 or more both ways; links stay as at the "
        "start.",
        f"{PLANNED}, LinkTable; Dietrich, Dressler 2009",
    ),
    (
        "lifetime_accuracy_days",
        "day",
        "higher",
        "Until an answer can no longer be what it was: a node of that network which hosts a variable of the "
        "problem (where none does and there is a sink: any sensor) is dead or has no way over living nodes to a "
        "living sink (without sinks: to the other such nodes). How much worse the answer gets is not computed.",
        f"{PLANNED}, LinkTable, VariablePlacement",
    ),
)

METRICS = tuple(replace(metric, definition=f"{metric.definition} {EXTRAPOLATED}") for metric in _FIGURES)
