"""Messages that are lost are asked for, whatever else is on the air."""

import pytest

from netsim.protocols.courier import Courier
from netsim.testing import DROP, ScriptedMedium, rule, run_algorithm
from netsim.trace.events import AlgorithmRecord

S = 1_000_000_000


class Chat:
    """Node 1 sends three words to node 2 and waits in vain for one; each asks after a silence of its own."""

    def __init__(self, stall_s):
        self._stall_s = stall_s

    def run(self, node):
        other = 3 - node.id
        courier = Courier(node, "word", {other}, self._stall_s[node.id] * S, 0, S)
        if node.id == 1:
            for word in (b"a", b"b", b"c"):
                courier.send(other, word)
        while (arrived := (yield from courier.receive(200 * S - node.now_ns))) is not None:
            node.record(AlgorithmRecord(node.id, arrived.payload.decode(), str(node.now_ns // S)))


def words(stall_s, lost):
    medium = ScriptedMedium([rule(DROP, source=1, kind="word", counts=lost)])
    run = run_algorithm(Chat, nodes=[1, 2], parameters=stall_s, medium=medium).require_success()
    return [(event.kind, int(event.fields_json)) for _, event in run.of(AlgorithmRecord)]


def test_what_arrives_is_handed_over_once():
    assert words({1: 300, 2: 300}, set()) == [("a", 0), ("b", 0), ("c", 0)]


@pytest.mark.parametrize("lost", [0, 1])
def test_a_gap_is_filled(lost):
    expected = ["a", "b", "c"]
    word = expected.pop(lost)
    assert words({1: 300, 2: 5}, {lost}) == [*((each, 0) for each in expected), (word, 5)]


def test_who_is_asked_all_the_time_still_asks():
    """Node 1 asks more often than node 2's patience lasts: its requests are no news to node 2."""
    assert words({1: 1, 2: 40}, {2}) == [("a", 0), ("b", 0), ("c", 40)]
