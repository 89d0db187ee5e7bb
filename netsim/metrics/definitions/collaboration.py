"""Groups of sensors that track together."""

from netsim.metrics.metric import grouped

PAPER = "Liu, Chu, Liu, Reich, Zhao 2004"

METRICS = grouped(
    "tracking: collaboration groups",
    (
        "reading_error_mean_m",
        "m",
        "lower",
        "Distance of estimates from the targets as they were at the reading that the estimates are of, mean over "
        "readings and targets; tracks and targets of a reading are assigned so that the sum is least, and there is no "
        "cut-off. `position_error_mean_m` compares with where the targets are when an estimate is told: it contains the "
        "way that they go while readings are collected. The figures of this group are missing for other problems than "
        "`energy-tracking`; null if there are no targets.",
        f"Estimate, TruthTargets, Problem; {PAPER}, Fig. 8a",
    ),
    (
        "reading_nees_mean",
        "1",
        "",
        "Error of these estimates, squared, in terms of the covariance that each is told with, mean: 2 if leaders know "
        "how far they are off, more if they are too sure; null without a covariance.",
        "Estimate, TruthTargets, Problem",
    ),
    (
        "group_reports",
        "1",
        "",
        "Readings that members sent to their leaders; a leader's own do not count.",
        "MessageSent",
    ),
    (
        "report_distance_mean_m",
        "m",
        "lower",
        "Distance in a straight line from a member that tells its reading to its leader, mean over the reports; null "
        "without any.",
        f"MessageSent, NodeTable, NodePositions; {PAPER}, Fig. 8b",
    ),
    ("report_distance_sum_m", "m", "lower", "The same, sum.", "MessageSent, NodeTable, NodePositions"),
    (
        "group_merges",
        "1",
        "",
        "How often two groups became one, to track their targets jointly.",
        "AlgorithmRecord of kind `merge`",
    ),
    (
        "group_splits",
        "1",
        "",
        "How often a group became several. One crossing is one merge and one split.",
        "AlgorithmRecord of kind `split`",
    ),
    (
        "joint_readings_share",
        "1",
        "",
        "Of the readings with estimates the share in which a group tracked several targets jointly.",
        "AlgorithmRecord of kind `joint`, Estimate",
    ),
    (
        "track_leader_changes",
        "1",
        "",
        "How often a node takes over a track from another one: takes the role `leader N` of track N that another node "
        "took before, sum over the tracks.",
        "Role",
    ),
    (
        "track_two_leaders_s",
        "s",
        "lower",
        "How long a track has two leaders or more, sum over the tracks. From when a node gets a belief until its "
        "predecessor knows that it did, both lead.",
        "Role, NodeLife",
    ),
    ("track_two_leaders_longest_s", "s", "lower", "The longest such time; 0 without any.", "Role, NodeLife"),
    (
        "track_without_leader_s",
        "s",
        "lower",
        "How long tracks have no leader, from when the last one dies or gives them up until a node takes them over, sum "
        "over the tracks. A track that nobody takes over has ended, and counts as missed where its target is still there.",
        "Role, NodeLife",
    ),
    ("track_without_leader_longest_s", "s", "lower", "The longest such time; 0 without any.", "Role, NodeLife"),
)
