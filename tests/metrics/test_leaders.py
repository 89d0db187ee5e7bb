"""Who leads when, from streams of events by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.metrics.leaders import Leaders
from netsim.trace.events import (
    Belief,
    EnergyLedger,
    Event,
    Handoff,
    MessageSent,
    NodeLife,
    Role,
    TruthTargets,
)
from netsim.units import s_to_ns

TARGET, NOBODY = TruthTargets([0], [0.0], [0.0]), TruthTargets([], [], [])
END = EnergyLedger([], [], [], [], [], [])


def leads(node: int) -> Role:
    return Role(node, "leader", 1)


def leaves(node: int) -> Role:
    return Role(node, "leader", 0)


def chooses(node: int, to: int, step: int, track: int = 0, thread: int = 0) -> Handoff:
    return Handoff(node, track, step, to, [to], [0.0], "grid", 8, 0.0, thread)


def believes(node: int, track: int, thread: int = 0) -> Belief:
    return Belief(node, track, 0, 0.0, 0.0, 5.0, 10, [0], [1.0], thread)


def sends(node: int, to: int, kind: str = "handoff") -> MessageSent:
    return MessageSent(1, node, to, kind, 8, 1, [])


def figures_of(*rows: tuple[float, Event]) -> dict[str, float]:
    """The figures of some events in order, times in seconds; a target is there from the start."""
    reducer = Leaders()
    handlers = reducer.handlers()
    for time_s, event in ((0.0, TARGET), *rows):
        handlers[type(event)](event, s_to_ns(time_s))
    return reducer.figures()


def test_without_leaders_there_are_no_figures() -> None:
    assert figures_of((1.0, Role(3, "centre", 1)), (2.0, END)) == {}


def test_a_track_that_wanders_without_a_break() -> None:
    """The second hand-off overlaps by 0.1 s, the third has a gap of 0.2 s: the belief's way, no outage."""
    figures = figures_of(
        (1.0, leads(4)),
        (2.0, chooses(4, 5, 1)),
        (2.0, sends(4, 5)),
        (2.0, leads(5)),
        (2.0, leaves(4)),
        (3.0, chooses(5, 4, 2)),
        (3.0, sends(5, 4)),
        (3.2, leads(4)),
        (3.3, leaves(5)),
        (4.0, chooses(4, 6, 3)),
        (4.0, sends(4, 6)),
        (4.1, leaves(4)),
        (4.3, leads(6)),
        (9.0, END),
    )
    assert (figures["leader_first_s"], figures["leader_nodes"], figures["leader_changes"]) == (1.0, 3, 3)
    assert (figures["outages"], figures["outage_longest_s"], figures["outage_first_s"]) == (0, 0.0, None)
    assert figures["two_leaders_s"] == figures["two_leaders_longest_s"] == pytest.approx(0.1)
    assert (figures["belief_messages"], figures["belief_messages_astray"]) == (3, 0)


def test_a_leader_that_dies_leaves_an_outage() -> None:
    """Node 5 dies with the belief; 4 takes it back after 1.5 s, and loses it for good at 8 s."""
    figures = figures_of(
        (1.0, leads(4)),
        (2.0, chooses(4, 5, 1)),
        (2.0, leads(5)),
        (2.0, leaves(4)),
        (3.0, NodeLife(5, "crashed", "fault")),
        (4.5, leads(4)),
        (8.0, NodeLife(4, "died", "battery")),
        (9.0, END),
    )
    assert (figures["outages"], figures["outage_total_s"]) == (2, pytest.approx(2.5))
    assert (figures["outage_first_s"], figures["outage_longest_s"]) == (1.5, 1.5)
    assert figures["leader_changes"] == 2


def test_outages_are_told_with_their_instants() -> None:
    reducer = Leaders()
    handlers = reducer.handlers()
    for time_s, event in (
        (0.0, TARGET),
        (1.0, leads(4)),
        (2.0, leaves(4)),
        (3.5, leads(5)),
        (8.0, leaves(5)),
        (9.0, END),
    ):
        handlers[type(event)](event, s_to_ns(time_s))
    assert reducer.outages_ns() == [(s_to_ns(2.0), s_to_ns(3.5)), (s_to_ns(8.0), s_to_ns(9.0))]


def test_a_choice_of_an_earlier_lead_excuses_nothing() -> None:
    """Node 4 chose 5 once; when it leads again and crashes before it chooses, 5 takes over after an outage."""
    figures = figures_of(
        (1.0, leads(4)), (2.0, chooses(4, 5, 1)), (2.0, leads(5)), (2.0, leaves(4)), (3.0, chooses(5, 4, 2)),
        (3.0, leads(4)), (3.0, leaves(5)), (3.5, NodeLife(4, "crashed", "fault")), (5.0, leads(5)), (6.0, END),
    )  # fmt: skip
    assert (figures["outages"], figures["outage_longest_s"]) == (1, 1.5)


def test_a_track_of_its_own_is_not_the_one_that_a_node_was_chosen_for() -> None:
    """Node 4 tries to hand on to 5 and dies; 5 never gets the belief, and finds the target by itself after 3 s."""
    rows = ((1.0, leads(4)), (2.0, chooses(4, 5, 1)), (2.0, NodeLife(4, "crashed", "fault")))
    figures = figures_of(*rows, (5.0, believes(5, 9)), (5.0, leads(5)), (6.0, END))
    assert (figures["outages"], figures["outage_longest_s"]) == (1, 3.0)
    assert figures_of(*rows, (5.0, leads(5)), (6.0, END))["outages"] == 0  # the belief was on its way


def test_nobody_need_lead_while_no_target_is_there() -> None:
    gone = ((1.0, leads(4)), (2.0, NOBODY), (2.5, leaves(4)), (7.0, TARGET), (8.0, leads(9)), (9.0, END))
    assert figures_of(*gone)["outages"] == 0
    lost_before = ((1.0, leads(4)), (1.5, leaves(4)), (2.0, NOBODY), (7.0, TARGET), (8.0, leads(9)), (9.0, END))
    figures = figures_of(*lost_before)
    assert (figures["outages"], figures["outage_total_s"]) == (1, 0.5)


def test_tracks_are_told_apart() -> None:
    """Two tracks with a leader each are in order; that both follow track 0 for 2 s is not."""
    figures = figures_of(
        (1.0, leads(4)),
        (1.0, believes(4, 0)),
        (1.0, believes(7, 1)),
        (1.0, leads(7)),
        (3.0, believes(7, 0)),
        (5.0, leaves(7)),
        (9.0, END),
    )
    assert (figures["two_leaders_s"], figures["outages"]) == (2.0, 0)


def test_beliefs_astray() -> None:
    figures = figures_of(
        (1.0, leads(4)),
        (1.0, sends(4, 5)),  # nobody chosen yet
        (2.0, chooses(4, 5, 1)),
        (2.0, sends(4, 5)),
        (2.0, sends(4, 5)),
        (2.0, sends(4, 6)),  # another one than chosen
        (2.1, chooses(4, 6, 1)),
        (2.1, sends(4, 6)),
        (2.2, sends(4, 8, "claim")),
        (2.3, leaves(4)),
        (2.3, sends(4, 6)),  # no leader any more
        (9.0, END),
    )
    assert (figures["belief_messages"], figures["belief_messages_astray"]) == (6, 3)


CHANGES = st.lists(st.tuples(st.integers(1, 50), st.integers(0, 3), st.booleans()), max_size=30)


@given(CHANGES)
def test_times_with_none_and_with_two_leaders_are_those_of_a_count(changes: list[tuple[int, int, bool]]) -> None:
    """No choice is ever told, so every gap is an outage; of one track every second with two holders counts."""
    rows = sorted(changes, key=lambda change: change[0])
    holders: set[int] = set()
    counts, begun = [], False
    for time_s in range(51):
        for _, node, holds in (row for row in rows if row[0] == time_s):
            (holders.add if holds else holders.discard)(node)
            begun = begun or holds
        counts.append(len(holders) if begun else None)
    figures = figures_of(*((float(at), Role(node, "leader", int(holds))) for at, node, holds in rows), (51.0, END))
    if not begun:
        assert figures == {}
        return
    assert figures["outage_total_s"] == counts.count(0)
    assert figures["two_leaders_s"] == sum(count >= 2 for count in counts if count is not None)


def test_redundant_threads_have_a_leader_each() -> None:
    """Node 4 gives the second thread to 6 and the first to 5: nobody shares a thread but for 0.1 s."""
    figures = figures_of(
        (1.0, believes(4, 0)),
        (1.0, leads(4)),
        (1.1, chooses(4, 6, 0, thread=1)),
        (1.2, leads(6)),
        (2.0, believes(6, 0, 1)),
        (2.0, believes(4, 0)),
        (2.1, chooses(4, 5, 1)),
        (2.2, leads(5)),
        (2.3, leaves(4)),
        (9.0, END),
    )
    assert figures["two_leaders_s"] == figures["two_leaders_longest_s"] == pytest.approx(0.1)
    assert figures["leader_changes"] == 2  # 6 and 5 take over from 4


def test_a_node_that_leads_two_threads_gives_them_away_one_by_one() -> None:
    """Node 5 gets both; its role ends at 2.5 s, but the first thread was given away at 2.1 s, to 6 from 2.2 s on."""
    rows = [
        (1.0, believes(4, 0)), (1.0, believes(3, 0, 1)), (1.0, leads(4)), (1.0, leads(3)),
        (1.5, chooses(4, 5, 1)), (1.5, leads(5)), (1.5, leaves(4)),
        (1.6, chooses(3, 5, 1, thread=1)), (1.6, leaves(3)),
        (2.0, believes(5, 0)), (2.0, believes(5, 0, 1)),
        (2.1, chooses(5, 6, 2)), (2.2, leads(6)),
        (2.4, chooses(5, 7, 2, thread=1)), (2.45, leads(7)), (2.5, leaves(5)),
        (9.0, END),
    ]  # fmt: skip
    assert figures_of(*rows)["two_leaders_s"] == pytest.approx(0.05)  # of the second thread, by nodes 5 and 7


def test_a_thread_that_a_leader_is_to_get_besides_its_own() -> None:
    """Node 5 gives the first thread to 6 while the second is on its way to it: from then on it leads the second alone."""
    rows = [
        (1.0, believes(5, 0)), (1.0, believes(3, 0, 1)), (1.0, leads(5)), (1.0, leads(3)),
        (1.1, chooses(3, 4, 1, thread=1)),  # who does not answer
        (1.2, chooses(3, 5, 1, thread=1)), (1.3, chooses(5, 6, 1)), (1.4, leads(6)), (1.5, leaves(3)),
        (2.0, believes(5, 0, 1)), (2.0, believes(6, 0)),
        (9.0, END),
    ]  # fmt: skip
    figures = figures_of(*rows)
    assert figures["two_leaders_s"] == pytest.approx(0.3)  # of the second, from choice to acknowledgement
    assert figures["belief_messages_astray"] == 0
