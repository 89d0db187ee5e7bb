"""Causal chains and turns: from hand-made events, and of a real run held against its deliveries."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import netsim
from netsim.metrics.causes import Cause, Causes, causal_chain, reason_of
from netsim.metrics.collect import replay
from netsim.sim.handle import Handle
from netsim.trace.events import (
    BROADCAST,
    Event,
    GraphMessages,
    MessageDelivered,
    MessageSent,
    VariablePlacement,
)
from netsim.trace.reader import read_trace

Rows = Sequence[tuple[int, Event]]


def told(rows: Rows) -> Causes:
    causes = Causes()
    replay(rows, [causes])
    return causes


def sent(number: int, source: int, destination: int, *causes: int, kind: str = "a") -> MessageSent:
    return MessageSent(number, source, destination, kind, 8, 1, causes)


def delivered(number: int, source: int, node: int) -> MessageDelivered:
    return MessageDelivered(number, source, node, "a", 8, 1, 1)


def graph(node: int, number: int, destinations: Sequence[int], remote: int = 1) -> GraphMessages:
    count = len(destinations)
    return GraphMessages(node, number, [node] * count, destinations, [remote] * count, 2, 0.5, 1, 0)


DIAMOND: Rows = (
    (0, sent(1, 0, BROADCAST)),
    (1, delivered(1, 0, 1)),
    (1, delivered(1, 0, 2)),
    (2, sent(2, 1, 3, 1)),
    (3, sent(3, 2, 3, 1)),
    (4, delivered(2, 1, 3)),
    (5, delivered(3, 2, 3)),
    (6, sent(4, 3, 0, 2, 3)),
    (6, sent(5, 3, 1, 2, 3)),
    (7, delivered(4, 3, 0)),
    (7, delivered(5, 3, 1)),
    (8, sent(6, 1, 0, 5)),
    (9, delivered(6, 1, 0)),
    (10, sent(7, 0, 2, 4, 6)),
)


def numbers(chain: Sequence[Cause]) -> list[object]:
    return [[cause.message_id, numbers(cause.causes)] if cause.causes else cause.message_id for cause in chain]


def test_a_chain_is_followed_to_its_depth_and_shared_causes_are_told_once() -> None:
    causes = told(DIAMOND)
    chain = causal_chain(causes, [4, 6], 0, depth=4, most=100)
    assert numbers(chain) == [[4, [[2, [1]], [3, [1]]]], [6, [5]]]
    five = chain[1].causes[0]
    assert five.message_id == 5
    assert five.told_at == (4, 0)  # sent in a row with 4, which stands at the top
    assert [cause.received_ns for cause in chain] == [7, 9]
    assert [cause.received_ns for cause in chain[0].causes] == [4, 5]
    assert [cause.causes[0].received_ns for cause in chain[0].causes] == [1, 1]


def test_what_is_too_deep_or_too_much_is_counted() -> None:
    causes = told(DIAMOND)
    flat = causal_chain(causes, [4, 6], 0, depth=1, most=100)
    assert [(cause.causes, cause.unfollowed) for cause in flat] == [((), 2), ((), 1)]
    short = causal_chain(causes, [4, 6], 0, depth=9, most=2)
    assert numbers(short) == [[4, [2, 3]], 6]
    assert short[1].unfollowed == 1
    assert [cause.unfollowed for cause in short[0].causes] == [1, 1]


def test_the_same_message_at_two_places_refers_to_the_one_nearer_to_the_top() -> None:
    rows: Rows = [(0, sent(1, 0, BROADCAST)), (1, sent(2, 1, BROADCAST, 1)), (2, sent(3, 2, 3, 2))]
    chain = causal_chain(told(rows), [3, 2], 3, depth=5, most=100)
    assert numbers(chain) == [[3, [2]], [2, [1]]]
    assert chain[0].causes[0].told_at == (2, 0)


def test_a_cause_that_the_trace_lost_is_said_to_be() -> None:
    chain = causal_chain(told([(5, sent(9, 1, 0, 7))]), [9], 0, depth=3, most=10)
    assert numbers(chain) == [[9, [7]]]
    assert chain[0].received_ns is None
    assert chain[0].causes[0].sending is None


def test_effects_are_the_messages_that_name_it() -> None:
    assert [sending.message_id for sending in told(DIAMOND).effects(2)] == [4, 5]
    assert told(DIAMOND).effects(7) == []


@given(st.lists(st.sets(st.integers(1, 12), max_size=4), min_size=1, max_size=12), st.integers(1, 6))
def test_a_chain_tells_every_cause_within_its_depth_and_nothing_twice(rows: list[set[int]], depth: int) -> None:
    """Against plain reachability, over random chains in which a message names only earlier ones."""
    named = {number: tuple(sorted(cause for cause in row if cause < number)) for number, row in enumerate(rows, 1)}
    causes = told([(number, sent(number, number, 0, *named[number])) for number in named])
    last = len(rows)
    reached, level = set(named[last]), set(named[last])
    for _ in range(depth - 1):
        level = {cause for message in level for cause in named[message]}
        reached |= level
    chain = causal_chain(causes, named[last], last, depth, most=10_000)
    shown: list[int] = []
    opened: list[int] = []

    def walk(branches: Sequence[Cause]) -> None:
        for branch in branches:
            shown.append(branch.message_id)
            if branch.causes:
                opened.append(branch.message_id)
                assert tuple(cause.message_id for cause in branch.causes) == named[branch.message_id]
            walk(branch.causes)

    walk(chain)
    assert set(shown) == reached
    assert len(opened) == len(set(opened))


PLACED = VariablePlacement([0, 1, 2], ["a", "b", "c"], [0, 1, 2], [0, 1], [1, 2])


def test_messages_belong_to_the_round_that_is_for_their_destination() -> None:
    rows: Rows = [
        (0, PLACED),
        (1, sent(1, 0, 1)),
        (10, graph(0, 0, [1])),
        (12, sent(2, 0, 1)),
        (13, sent(3, 0, 2)),  # no graph message of the round is for node 2
        (14, sent(4, 0, 1)),  # sent again
        (15, sent(5, 0, BROADCAST, kind="service/time")),
        (20, graph(0, 1, [])),
        (30, graph(0, 2, [1], remote=0)),
        (40, graph(0, 3, [1])),
        (41, sent(6, 0, 1, 2, 3)),
    ]
    causes = told(rows)
    assert {number: sending.round for number, sending in causes.sendings.items()} == {
        1: None, 2: 0, 3: None, 4: 0, 5: None, 6: 3,
    }  # fmt: skip
    turns = causes.turns(0)
    assert [(turn.begun_ns, turn.round, [each.message_id for each in turn.messages]) for turn in turns] == [
        (1, None, [1]), (10, 0, [2, 4]), (13, None, [3]), (20, 1, []), (30, 2, []), (40, 3, [6]),
    ]  # fmt: skip
    reason = reason_of(turns, 5)
    assert (reason.silent, reason.last_spoken, reason.causes) == (2, turns[2], (2, 3))
    assert reason_of(turns, 0).last_spoken is None


@pytest.mark.parametrize(
    ("scenario", "seed", "silences"),
    [("quickstart.yaml", 1, 0), ("quickstart.yaml", 11, 1), ("chen2006/association-csmp.yaml", 2, 2)],
)
def test_a_belief_names_what_its_sender_received_since_it_spoke(
    scenarios: Path, tmp_path: Path, scenario: str, seed: int, silences: int
) -> None:
    """The causes of communication-sensitive message passing, against the deliveries: none too many, none missing."""
    result = netsim.run(netsim.load(scenarios / scenario, [f"seed={seed}"]), folder=tmp_path)
    assert result.trace is not None
    rows = list(read_trace(result.trace))
    causes = told(rows)
    checked = silent = 0
    for node in {sending.source for sending in causes.sendings.values()}:
        heard = [event.message_id for _, event in rows if isinstance(event, MessageDelivered) and event.node == node]
        turns = causes.turns(node)
        for index, turn in enumerate(turns):
            reason = reason_of(turns, index)
            if not turn.messages or reason.last_spoken is None or reason.last_spoken.round is None:
                continue
            since, until = reason.last_spoken.begun_ns, turn.begun_ns
            expected = {number for number in heard if since <= (causes.arrived_ns(number, node) or 0) < until}
            assert set(reason.causes) == expected, f"node {node}, round {turn.round}"
            checked += 1
            silent += reason.silent > 0
    assert checked > 5
    assert silent >= silences


def test_what_came_early_is_a_cause_in_the_round_that_uses_it(scenarios: Path, tmp_path: Path) -> None:
    """With clocks apart by up to half a round and more, some messages arrive before their receiver's round begins."""
    clocks = "nodes[0].clock={offset_sd_s: 0.4, drift_sd_ppm: 30}"
    result = netsim.run(netsim.load(scenarios / "quickstart.yaml", [clocks, "algorithm.tolerance=0"]), folder=tmp_path)
    assert result.trace is not None
    causes = told(list(read_trace(result.trace)))
    pairs = [
        (causes.sendings[cause], sending)
        for sending in causes.sendings.values()
        for cause in sending.causes
        if sending.round is not None and causes.sendings[cause].round is not None
    ]
    assert len(pairs) > 20
    assert [(cause, sending) for cause, sending in pairs if (cause.round or 0) >= (sending.round or 0)] == []


def test_a_message_sent_again_names_the_causes_of_the_first_time(
    scenarios: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asynchronous and over lossy air, so that others are received between a message and its repetition."""
    posted: dict[tuple[int, int, bytes], list[int]] = {}
    hand_over = Handle.send

    def send(self: Handle, destination: int, kind: str, payload: bytes, **rest: Any) -> Any:
        ticket = hand_over(self, destination, kind, payload, **rest)
        posted.setdefault((self.id, destination, payload), []).append(ticket.message_id)
        return ticket

    monkeypatch.setattr(Handle, "send", send)
    changes = [
        "seed=3", "algorithm.schedule=asynchronous", "algorithm.tolerance=0.01", "algorithm.resend=8",
        "medium={type: ideal, loss_probability: 0.4}", "mac={type: csma, max_retries: 0}",
    ]  # fmt: skip
    result = netsim.run(netsim.load(scenarios / "quickstart.yaml", changes), folder=tmp_path)
    assert result.trace is not None
    sendings = told(list(read_trace(result.trace))).sendings
    repeated = 0
    for numbers_of_one in posted.values():
        first, *again = (sendings[number] for number in numbers_of_one)
        starts = all(sendings[cause].kind == "observations" for cause in first.causes)
        for sending in again:
            assert set(sending.causes) == set(first.causes) or (starts and not sending.causes)
            repeated += not starts
    assert repeated > 5
