"""Hand-offs of beliefs, and who leads."""

from netsim.metrics.metric import grouped

PAPER = "Liu, Reich, Zhao 2002"
LEADERS = "Role, NodeLife, Handoff, Belief, Estimate"

METRICS = (
    *grouped(
        "tracking: hand-offs",
        (
            "handoffs",
            "1",
            "",
            "How often a leader chose who leads next; a second choice, because the first one did not answer, counts "
            "again. The figures of this group are missing without any.",
            "Handoff",
        ),
        (
            "handoff_neighbours_mean",
            "1",
            "",
            "Among how many nodes it chose, mean.",
            f"Handoff; {PAPER}, Table 4",
        ),
        ("handoff_mean_byte", "byte", "lower", "Application payload of a hand-off with its belief, mean.", "Handoff"),
        ("handoff_max_byte", "byte", "lower", "The largest of the same.", "Handoff"),
        (
            "handoff_divergence_mean_bit",
            "bit",
            "lower",
            "What the layout of the payload loses: Kullback-Leibler divergence of the leader's belief from what the "
            "receiver decodes, mean; null where one is infinite, because the receiver rules out a cell that the "
            "leader does not.",
            "Handoff",
        ),
        (
            "handoffs_by_form",
            "1",
            "",
            "The number of hand-offs by how the belief was laid out (`grid`, `gaussian`, `mixture`).",
            "Handoff",
        ),
    ),
    *grouped(
        "tracking: leaders",
        (
            "leader_first_s",
            "s",
            "lower",
            "When a node first leads: holds the role `leader`. The figures of this group are missing where none does. "
            "A node that dies, crashes or ends its algorithm leads no more.",
            LEADERS,
        ),
        ("leader_nodes", "1", "", "Number of nodes that ever lead.", LEADERS),
        (
            "leader_changes",
            "1",
            "",
            "How often a node takes over a track from another one. The track of a leader, and which of its redundant "
            "threads, is the one that it last spoke of, or that was last handed to it.",
            LEADERS,
        ),
        (
            "outages",
            "1",
            "lower",
            "How often the last leader of all ceases to lead while a target is there, and next leads another node than "
            "the one it had chosen for its track, or that one another track: the way of a belief from leader to next "
            "leader is no outage. One lasts until a node leads, the last target leaves or the run ends.",
            f"{LEADERS}, TruthTargets",
        ),
        ("outage_total_s", "s", "lower", "Length of the outages, sum.", f"{LEADERS}, TruthTargets"),
        ("outage_longest_s", "s", "lower", "The longest of them; 0 without any.", f"{LEADERS}, TruthTargets"),
        ("outage_first_s", "s", "lower", "Length of the first one; null without any.", f"{LEADERS}, TruthTargets"),
        (
            "two_leaders_s",
            "s",
            "lower",
            "How long a track has two leaders or more, sum over the tracks, where each of a track's redundant threads "
            "counts as a track. From when a node gets the belief until its predecessor knows that it did, both lead.",
            LEADERS,
        ),
        ("two_leaders_longest_s", "s", "lower", "The longest such time; 0 without any.", LEADERS),
        (
            "belief_messages",
            "1",
            "",
            "Messages of kind `handoff` handed to the network layer, repetitions included: those that carry a belief.",
            "MessageSent",
        ),
        (
            "belief_messages_astray",
            "1",
            "lower",
            "Those of them that do not go from a leader to a node that it has just chosen; 0 for an algorithm that "
            f"keeps beliefs between leader and next leader ({PAPER}, Table 1).",
            "MessageSent, Handoff, Role, NodeLife",
        ),
    ),
)
