"""Messages that are lost are asked for or sent again, whatever else is on the air; lives are kept apart."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.api import Delivery
from netsim.protocols.courier import Courier
from netsim.protocols.courier_peer import HEAD, NUMBERS, STATUS, WINDOW, Peer
from netsim.protocols.round_trip import RoundTrip
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


class Unacknowledged:
    """A node whose link layer takes everything for delivered."""

    def __init__(self, node):
        self._node = node

    def __getattr__(self, name):
        return getattr(self._node, name)

    def send(self, *args, **named):
        return Hopeful(self._node.send(*args, **named))


class Hopeful:
    """A ticket of such a node."""

    def __init__(self, ticket):
        self._ticket = ticket

    def wait(self):
        yield from self._ticket.wait()
        return Delivery(acknowledged=True, reason="", attempts=1)


class PingPong:
    """Two nodes answer each other in turn, so that every loss stops both; where they are silent for 5 s they ask."""

    def __init__(self, turns):
        self._turns = turns

    def run(self, node):
        node, other = Unacknowledged(node), 3 - node.id
        courier = Courier(node, "ball", {other}, 5 * S, 10, S // 2)
        if node.id == 1:
            courier.send(other, b"")
        for turn in range(self._turns):
            if (yield from courier.receive(1000 * S)) is None:
                return
            node.record(AlgorithmRecord(node.id, "turn", str(node.now_ns)))
            if turn < self._turns - 1 or node.id == 2:
                courier.send(other, b"")
        yield from courier.receive(20 * S, asks=False)


def test_only_the_first_loss_costs_the_long_silence():
    """Every eighth ball and every ninth answer is lost, and nobody acknowledges."""
    lost = [
        rule(DROP, kind="ball", counts=set(range(3, 400, 8))),
        rule(DROP, kind="ball-repeat", counts=set(range(9, 400, 9))),
    ]
    run = run_algorithm(PingPong, nodes=[1, 2], parameters=60, medium=ScriptedMedium(lost)).require_success()
    turns_ns = [int(event.fields_json) for _, event in run.of(AlgorithmRecord)]
    assert len(turns_ns) == 120
    gaps_s = sorted((after - before) / S for before, after in pairwise(turns_ns))
    assert 5 <= gaps_s[-1] < 6
    assert sum(gap_s > 4 for gap_s in gaps_s) == 1
    assert sum(gaps_s) < 20


class Stranger:
    """Node 2 speaks to node 1 as one who knew an earlier life of it, or as one who is another than before."""

    def __init__(self, lives):
        self._lives = lives

    def run(self, node):
        if node.id == 1:
            courier = Courier(node, "word", {2}, 50 * S, 0, S)
            while (arrived := (yield from courier.receive(10 * S - node.now_ns))) is not None:
                node.record(
                    AlgorithmRecord(node.id, "heard", "lost" if arrived.payload is None else arrived.payload.decode())
                )
            courier.send(2, b"in vain")
            return
        for number, (life, other) in enumerate(self._lives):
            yield from node.send(1, "word", HEAD.pack(life, other, number, False) + b"%d" % number).wait()
            yield from node.pause(S)
        while (message := (yield from node.receive(timeout_ns=10 * S))) is not None:
            assert message.kind == "word-repeat"
            node.record(AlgorithmRecord(node.id, "told", str(STATUS.unpack(message.payload, 0)[1])))


@pytest.mark.parametrize(
    ("lives", "heard", "told"),
    [
        ([(7, 0), (7, 0)], ["0", "1"], []),
        ([(7, 0), (8, 0), (8, 0), (7, 0)], ["0", "lost"], ["7"] * 3),
        ([(7, 0), (7, 70_000 - NUMBERS)], ["0", "lost"], ["7"]),
    ],
)
def test_another_life_ends_the_conversation_on_both_sides(lives, heard, told):
    """What is answered names the life that was known, so that its successor learns of it too."""
    run = run_algorithm(Stranger, nodes=[1, 2], parameters=lives).require_success()
    records = [(event.kind, event.fields_json) for _, event in run.of(AlgorithmRecord)]
    assert [what for kind, what in records if kind == "heard"] == heard
    assert [what for kind, what in records if kind == "told"] == told


@settings(max_examples=30)
@given(st.data())
def test_what_has_come_and_what_is_missing_agree(data):
    """Beyond where the numbers on the air go round, with messages in any order and some missing."""
    begin = data.draw(st.sampled_from([0, 3, NUMBERS - 20]))
    sender, receiver = Peer(), Peer()
    sender.kept += [b""] * begin
    for number in range(begin):
        assert receiver.takes(number % NUMBERS)
    sender.confirm(begin % NUMBERS, 0)
    sender.kept += [b""] * 50
    come = data.draw(st.lists(st.integers(begin, begin + 49), unique=True))
    for number in come:
        assert receiver.takes(number % NUMBERS)
        assert not receiver.takes(number % NUMBERS)
    new, missing = sender.confirm(*receiver.received())
    assert new == sorted(come)
    first = next(number for number in range(begin, begin + 51) if number not in come)
    assert missing == [number for number in range(first, begin + 50) if number not in come]
    assert sender.confirm(*receiver.received()) == ([], missing)


def test_no_more_is_sent_again_than_the_window_tells_of():
    sender = Peer()
    sender.kept += [b""] * 200
    assert sender.confirm(0, 0) == ([], list(range(WINDOW + 1)))


def test_the_waiting_time_follows_rfc_6298():
    trip = RoundTrip(3 * S, S // 20, 60 * S)
    assert [trip.timeout_ns(n) for n in (0, 1, 5)] == [3 * S, 6 * S, 60 * S]
    trip.measured(S)
    assert trip.timeout_ns(0) == S + 4 * (S // 2)
    trip.measured(2 * S)
    assert trip.timeout_ns(0) == S + S // 8 + 4 * (S // 2 + (S - S // 2) // 4)
    for _ in range(200):
        trip.measured(S // 1000)
    assert trip.timeout_ns(0) == S // 20
