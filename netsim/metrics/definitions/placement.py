"""Where the variables of the graphical model live."""

from netsim.metrics.metric import grouped

METRICS = grouped(
    "placement",
    (
        "hosted_variables_max",
        "1",
        "lower",
        "Largest number of variables of the graphical model that one node hosts at the start, a sensor's own included. The "
        "figures of this group are missing without such a model.",
        "VariablePlacement",
    ),
    (
        "placement_edges_over_air",
        "1",
        "lower",
        "Edges of the model whose two variables live on different nodes at the start.",
        "VariablePlacement",
    ),
    (
        "placement_hops_mean",
        "1",
        "lower",
        "Fewest hops between the hosts of an edge's two variables, 0 on one node, mean over the edges; over the links of "
        "the start with a packet reception ratio of 0.5 or more both ways, whatever routes the network takes. Edges "
        "without a way are left out; null without any that has one.",
        "VariablePlacement, LinkTable",
    ),
    (
        "placement_edges_stranded",
        "1",
        "lower",
        "Edges of the model between whose hosts there is no such way.",
        "VariablePlacement, LinkTable",
    ),
)
