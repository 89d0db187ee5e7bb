"""What leaders record and say of identities, from events by hand."""

import json

from netsim.metrics.identities import IdentityWords
from netsim.metrics.tracking import Tracking
from netsim.trace.events import AlgorithmRecord, Estimate, Identity, MessageSent, TruthTargets
from netsim.units import s_to_ns


def says(event, *group):
    return AlgorithmRecord(3, "identity", json.dumps({"event": event, "group": list(group)}))


def sends(kind, size_byte):
    return MessageSent(1, 3, 4, kind, size_byte, 1, [])


def figures_of(*events):
    reducer = IdentityWords()
    handlers = reducer.handlers()
    for event in events:
        handlers[type(event)](event, 0)
    return reducer.figures()


def test_without_a_record_there_are_no_figures():
    assert figures_of(sends("word", 90), AlgorithmRecord(3, "merge", "{}")) == {}


def test_events_and_messages_are_counted():
    figures = figures_of(
        says("met", 0, 1),
        says("evidence", 0, 1),
        says("evidence", 0, 1, 2),
        says("refused", 0, 1),
        says("unanswered", 0, 1),
        says("contradicted", 0),
        *(sends(kind, 10) for kind in ("word", "word", "heard", "register", "registered", "locate", "located")),
        sends("call", 1000),
    )
    assert figures == {
        "identity_meetings": 1,
        "identity_group_largest": 3,
        "identity_evidence": 2,
        "identity_evidence_refused": 1,
        "identity_contradictions": 1,
        "identity_words": 2,
        "identity_words_unanswered": 1,
        "identity_messages": 7,
        "identity_messages_byte": 70,
    }


def test_the_last_belief_of_each_track_counts():
    reducer = Tracking()
    handlers = reducer.handlers()
    events = [
        (0, TruthTargets([0, 1], [0.0, 100.0], [0.0, 0.0])),
        (1, Estimate(3, 0, 0.0, 0.0, [])),
        (1, Estimate(4, 1, 100.0, 0.0, [])),
        (1, Identity(3, 0, [0.5, 0.5])),
        (2, Identity(4, 1, [0.25, 0.75])),
        (3, Identity(3, 0, [0.94, 0.06])),
    ]
    for time_s, event in events:
        handlers[type(event)](event, s_to_ns(time_s))
    assert reducer.figures()["identity_probability_last"] == (0.94 + 0.75) / 2
