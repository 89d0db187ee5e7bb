"""What was proved, and what the phases of the proof cost."""

from netsim.metrics.definitions.inference import CHEN_2006
from netsim.metrics.metric import grouped

_RECORDS = "AlgorithmRecord"

METRICS = grouped(
    "optimality",
    (
        "map_proved",
        "1",
        "higher",
        "1 if tree-reweighted max-product proved the state of every variable to be the most probable one, given what the "
        "sensors gave (a faulty one too), else 0. The figures of this group are missing for other algorithms.",
        f"{_RECORDS}; {CHEN_2006}, section 2.3",
    ),
    (
        "map_proved_share",
        "1",
        "higher",
        "Share of the model's vertices whose state was proved. A vertex of a node that died before the verdict, or began "
        "anew after it, counts as not proved.",
        f"{_RECORDS}, VariablePlacement",
    ),
    ("trmp_iterations", "1", "lower", "Iterations of the component that took most.", _RECORDS),
    ("trmp_trees", "1", "", "Spanning trees of the component that has most.", _RECORDS),
    (
        "trmp_vertices_unfinished",
        "1",
        "lower",
        "Vertices that heard no last verdict: the time was over, they gave up because a node of their component came up "
        "again or lacked a measurement, or their node died or had no energy left to compute with.",
        f"{_RECORDS}, VariablePlacement",
    ),
    (
        "trmp_messages_by_phase_per_sensor",
        "1",
        "lower",
        "Graph messages over the number of nodes that host variables, by phase: `trees` grows them, `inference` is "
        "max-product on the trees, `agreement` votes and verdicts. Those of a node that died or crashed are missing.",
        f"{_RECORDS}, VariablePlacement",
    ),
)
