"""Time lines: every sort of event as a line, from hand-made events."""

import pytest

from netsim.metrics.collect import replay
from netsim.metrics.timeline import Entry, TimeLine, Window
from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    RADIO_STATE_CODE,
    AlgorithmRecord,
    Association,
    Belief,
    EnergyBudget,
    Estimate,
    Event,
    Fault,
    Frame,
    GraphMessages,
    Handoff,
    Identity,
    Log,
    Marginals,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    Particles,
    RadioState,
    Role,
    RouteChange,
    VariablePlacement,
)

MS = 1_000_000


def frame(source: int, destination: int, outcome: str, attempt: int = 0) -> Frame:
    codes = [OUTCOME_CODE[outcome]]
    return Frame(1, 0, MS, source, destination, "a", 0, 20, attempt, 4, 0.0, [destination], codes, [0.0], [0.0])


EVENTS: list[tuple[Event, str, str]] = [
    (NodeLife(1, "started", "Gossip"), "life", "started: Gossip"),
    (MessageSent(4, 1, 2, "a", 30, 2, [1, 2]), "sends", "a #4 to n2: 30 byte in 2 fragments, after #1, #2"),
    (MessageSent(5, 1, BROADCAST, "a", 3, 1, []), "sends", "a #5 to all: 3 byte"),
    (MessageDelivered(6, 3, 1, "a", 30, 2, 4 * MS), "receives", "a #6 from n3: 30 byte, 4 ms, 2 hops"),
    (MessageDelivered(4, 1, 2, "a", 30, 1, 4 * MS), "delivered", "a #4 reached n2: 4 ms, 1 hop"),
    (MessageDropped(4, 1, 2, 3, "a", "no_route"), "dropped", "a #4 from n1 to n2 at n3: no route"),
    (MessageDropped(7, 3, 2, 1, "a", "queue_full"), "dropped", "a #7 from n3 to n2: queue full"),
    (MessageDropped(0, 3, 1, 1, "", "malformed"), "dropped", "something of no message from n3 to n1: malformed"),
    (frame(1, 2, "collided", 1), "transmits", "retry frame of a #4, n1 to n2, 20 byte, attempt 2: collided"),
    (frame(3, 1, "weak"), "hears", "data frame of a #4, n3 to n1: weak"),
    (RadioState(1, RADIO_STATE_CODE["sleep"]), "radio", "sleep"),
    (EnergyBudget(1, "refused", "", 0.5, 0.4, "send"), "budget", "allowance refused (send): 0.5 of 0.4 J spent"),
    (Fault(0, "outage", "begins", [1, 2], "snow"), "fault", "rule 0 (outage) begins: snow"),
    (RouteChange(1, 9, 2, 3.5), "route", "to n9 by n2, cost 3.5"),
    (RouteChange(1, BROADCAST, BROADCAST, 0.0), "route", "none to a sink any more"),
    (Role(1, "leader", 0), "role", "is no longer leader"),
    (
        GraphMessages(1, 3, [0, 0], [1, 2], [1, 0], 4, 0.25, 1, 2 * MS),
        "round",
        "3 sends 2 of 4 graph messages, 1 over the air, largest change 0.25, begun 2 ms late",
    ),
    (
        GraphMessages(1, 4, [], [], [], 4, 0.0, 1, 0),
        "round",
        "4 sends no graph message of 4 computed, largest change 0",
    ),
    (Association(1, [2, -1], 3), "decides", "targets 2, none (after round 3)"),
    (Association(1, [2, -1], 4), "decides", "targets 2, none, as before (after round 4)"),
    (Marginals(1, 7, [0.25, 0.75], 3, 0), "believes", "marginal of x7: 0.25, 0.75 (after round 3)"),
    (Estimate(1, 2, 3.0, 4.0, []), "estimates", "track 2 at (3, 4) m"),
    (Identity(1, 2, [0.25, 0.75]), "believes", "track 2 follows target 0 (0.25), target 1 (0.75)"),
    (Particles(1, 9, [2, 4], 2, [0.5, 0.5], [1.0] * 4, [1.0] * 4), "believes", "2 particles of track 2, 4"),
    (Role(1, "leader 4", 1), "role", "becomes leader of track 4"),
    (Role(1, "leader", 0), "role", "is no longer leader"),
    (
        Belief(1, 2, 9, 0.0, 0.0, 5.0, 10, [3, 4], [0.5, 0.5]),
        "believes",
        "step 9 of track 2: 2 cells, spread 2.5 m",
    ),
    (
        Handoff(1, 2, 9, 5, [4, 5], [0.25, 0.5], "grid", 30, 0.125),
        "chooses",
        "n5 to lead track 2 next, by utility of n5 0.5, n4 0.25; belief as grid, 30 byte, loses 0.125 bit",
    ),
    (
        Belief(1, 2, 9, 0.0, 0.0, 5.0, 10, [3, 4], [0.5, 0.5], 1),
        "believes",
        "step 9 of track 2, thread 2: 2 cells, spread 2.5 m",
    ),
    (
        Handoff(1, 2, 9, 5, [5], [0.5], "grid", 30, 0.0, 2),
        "chooses",
        "n5 to lead track 2, thread 3, next, by utility of n5 0.5; belief as grid, 30 byte",
    ),
    (AlgorithmRecord(1, "phase", '{"n": 2}'), "notes", "phase: n 2"),
    (Log(0, 0, 2, "hello", "node 1", "", 0), "logs", "hello"),
]
OTHERS: list[Event] = [
    NodeLife(2, "started", ""), MessageSent(8, 2, 1, "a", 3, 1, []), RadioState(2, 1), Role(2, "leader", 1),
    frame(2, 3, "received"), MessageDelivered(8, 2, 3, "a", 3, 1, 0), Fault(0, "outage", "ends", [2], ""),
    Belief(2, 0, 1, 0.0, 0.0, 5.0, 10, [3], [1.0]), Handoff(2, 0, 1, 1, [1], [0.0], "grid", 9, 0.0),
    Association(2, [0], 1), Marginals(2, 7, [1.0], 1, 0), Log(0, 0, 2, "hello", "node 2", "", 0),
]  # fmt: skip


def line(window: Window) -> TimeLine:
    rows: list[tuple[int, Event]] = [(0, VariablePlacement([7], ["x7"], [1], [], []))]
    rows += [(number * MS, event) for number, (event, *_) in enumerate(EVENTS)]
    rows += [(100 * MS, event) for event in OTHERS]
    made = TimeLine(1, lambda node: f"n{node}", window)
    replay(rows, [made])
    return made


def test_every_event_of_the_node_is_told_in_order_and_no_other() -> None:
    expected = [Entry(number * MS, what, text) for number, (_, what, text) in enumerate(EVENTS)]
    assert line(Window(frames=True)).entries == expected


def test_a_window_bounds_the_line() -> None:
    some = line(Window(start_ns=2 * MS, end_ns=12 * MS, most=3))
    assert [entry.time_ns for entry in some.entries] == [2 * MS, 3 * MS, 4 * MS]
    assert some.left_out == 5  # ten in the window, of which two are frames that were not asked for


@pytest.mark.parametrize(("kinds", "messages"), [({"a"}, 4), ({"b"}, 0)])
def test_kinds_choose_messages_and_leave_the_rest(kinds: set[str], messages: int) -> None:
    words = [entry.what for entry in line(Window(kinds=kinds, frames=True)).entries]
    assert sum(word in ("sends", "receives", "delivered") for word in words) == messages
    assert ("hears" in words) == ("dropped" in words) == (messages > 0)
    assert words.count("decides") == 2
