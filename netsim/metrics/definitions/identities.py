"""Evidence of identities and the words of leaders about it."""

from netsim.metrics.metric import grouped

LIU_2004 = "Liu, Chu, Liu, Reich, Zhao 2004, sections 3.2 and 5"
_RECORDS = "AlgorithmRecord `identity`"
_SENT = "MessageSent"

METRICS = grouped(
    "tracking: acquaintance groups",
    (
        "identity_meetings",
        "1",
        "",
        "How often tracks that were near each other parted, which mixes their identities. The figures of this group are "
        "missing where leaders recorded nothing of identities.",
        f"{_RECORDS}; {LIU_2004}",
    ),
    ("identity_group_largest", "1", "", "Tracks of the largest acquaintance group.", f"{_RECORDS}; {LIU_2004}"),
    (
        "identity_evidence",
        "1",
        "",
        "Pieces of evidence of who a track is that leaders applied and told. One may be of several readings: it is told "
        "when it changes the identity by as much as the algorithm's `tell_change`.",
        f"{_RECORDS}; {LIU_2004}",
    ),
    (
        "identity_evidence_refused",
        "1",
        "lower",
        "Pieces of evidence that leaders refused, because they contradict all that the track may be.",
        _RECORDS,
    ),
    (
        "identity_contradictions",
        "1",
        "lower",
        "How often what a leader knew and what it was told did not make up a matrix together, as after two nodes led one "
        "track.",
        _RECORDS,
    ),
    (
        "identity_words",
        "1",
        "lower",
        "Messages that carry an acquaintance group's identities, also repeated or passed on by former leaders.",
        _SENT,
    ),
    (
        "identity_words_unanswered",
        "1",
        "lower",
        "How often a leader was given up that did not confirm such a message in all attempts.",
        _RECORDS,
    ),
    (
        "identity_messages",
        "1",
        "lower",
        "These messages, their confirmations, and what is asked and told of where leaders are; their joules are in "
        "`energy_by_kind_j`, under `word`, `heard`, `register`, `registered`, `locate` and `located`.",
        _SENT,
    ),
    ("identity_messages_byte", "byte", "lower", "Application payload of the same.", _SENT),
)
