"""Milestones by hand, against networkx day by day, and as laws."""

import math

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from netsim.metrics.milestones import Milestones, milestones
from netsim.metrics.reach import Reach
from netsim.trace.events import LinkTable, NodeTable, VariablePlacement

LINE = [(0, 1), (1, 2), (2, 3)]


def test_a_line_breaks_in_the_middle() -> None:
    """The end dies first and hurts nobody; then the middle cuts node 0 off."""
    days = {0: 9.0, 1: 5.0, 2: 7.0, 3: 2.0}
    assert milestones(days, LINE, [0, 2], []) == Milestones(2.0, 5.0, 5.0)
    assert milestones(days, LINE, [2], []) == Milestones(2.0, 5.0, 7.0)
    assert milestones(days, LINE, [], []) == Milestones(2.0, 5.0, None)


def test_with_a_sink_what_counts_is_the_way_to_it() -> None:
    days = {0: math.inf, 1: 5.0, 2: 7.0, 3: 2.0}
    assert milestones(days, LINE, [2], [0]) == Milestones(2.0, 5.0, 5.0)
    assert milestones(days, LINE, [1, 2, 3], [0]) == Milestones(2.0, 5.0, 2.0)
    assert milestones({0: 3.0, 1: 5.0, 2: 7.0, 3: 9.0}, LINE, [2], [0]).accuracy_days == 3.0


def test_a_network_that_dies_from_its_ends_falls_apart_when_one_node_is_left() -> None:
    assert milestones({0: 1.0, 1: 3.0, 2: 4.0, 3: 2.0}, LINE, [], []).partition_days == 3.0
    assert milestones({0: 1.0, 1: math.inf, 2: 4.0, 3: 2.0}, LINE, [], [1]).partition_days == 4.0


def test_nodes_that_die_together_are_taken_out_together() -> None:
    """One after the other node 0 would be alone for no time at all: but the other end is dead by then."""
    ring = [(0, 1), (1, 2), (2, 3), (3, 0)]
    assert milestones({0: 5.0, 1: 2.0, 2: 5.0, 3: 9.0}, ring, [], []).partition_days == 5.0
    assert milestones({0: 5.0, 1: 2.0, 2: 9.0, 3: 2.0}, ring, [], []).partition_days == 2.0


def test_who_is_not_connected_at_the_start_is_left_out() -> None:
    days = {0: 9.0, 1: 8.0, 2: 7.0, 3: 1.0, 4: 2.0}
    assert milestones(days, [(0, 1), (1, 2), (3, 4)], [2, 3], []) == Milestones(1.0, 8.0, 7.0)
    assert milestones(days, [(0, 1), (1, 2), (3, 4)], [2, 3], [4]) == Milestones(1.0, 1.0, 1.0)
    assert milestones(days, [], [0], [1]) == Milestones(1.0, None, None)
    assert milestones({}, [], [], []) == Milestones(None, None, None)


def test_mains_power_never_ends() -> None:
    days = dict.fromkeys(range(4), math.inf)
    assert milestones(days, LINE, [0, 3], [1]) == Milestones(None, None, None)


NODES = st.integers(1, 7)
DAYS = st.integers(1, 6).map(float) | st.just(math.inf)


@st.composite
def networks(draw: st.DrawFn) -> tuple[dict[int, float], list[tuple[int, int]], list[int], list[int]]:
    count = draw(NODES)
    days = {node: draw(DAYS) for node in range(count)}
    pairs = [(one, other) for one in range(count) for other in range(one)]
    links = draw(st.lists(st.sampled_from(pairs), unique=True)) if pairs else []
    some = st.lists(st.integers(0, count - 1), unique=True)
    return days, links, draw(some), draw(some)


def by_networkx(
    days: dict[int, float], links: list[tuple[int, int]], needed: list[int], sinks: list[int]
) -> Milestones:
    """The definitions word by word: kill the nodes day by day and look."""
    graph = nx.Graph()
    graph.add_nodes_from(sorted(days))
    graph.add_edges_from(links)
    parts = sorted(nx.connected_components(graph), key=lambda part: (-len(part), min(part)))
    parts = [part for part in parts if part & set(sinks)] if sinks else parts[:1]
    wanted = set(needed) & set().union(*parts)
    goals = set(sinks) or {min(wanted, default=0)}
    apart = lost = None
    for day in sorted({day for day in days.values() if day < math.inf}):
        living = graph.subgraph(node for node in days if days[node] > day)
        halves = [living.subgraph(part) for part in parts if len(part) > 1]
        if apart is None and any(len(half) < 2 or not nx.is_connected(half) for half in halves):
            apart = day
        reached = set().union(*(nx.node_connected_component(living, goal) for goal in goals & set(living)))
        if lost is None and not wanted <= reached:
            lost = day
    first = min(days.values())
    return Milestones(first if first < math.inf else None, apart, lost)


@given(networks())
def test_milestones_are_those_of_killing_node_after_node(network) -> None:
    assert milestones(*network) == by_networkx(*network)


def never_last(days: float | None) -> float:
    return math.inf if days is None else days


@given(networks(), st.integers(0, 6), st.integers(1, 3))
def test_order_and_growth(network, node: int, more: int) -> None:
    """Nothing goes wrong before a node dies; more energy in a needed node or sink never brings loss of accuracy nearer."""
    days, links, needed, sinks = network
    before = milestones(days, links, needed, sinks)
    assert never_last(before.first_dead_days) <= never_last(before.partition_days)
    assert never_last(before.first_dead_days) <= never_last(before.accuracy_days)
    if node in days:
        after = milestones(days | {node: days[node] + more}, links, needed, sinks)
        assert never_last(after.first_dead_days) >= never_last(before.first_dead_days)
        assert never_last(after.accuracy_days) >= never_last(before.accuracy_days)


@given(networks())
def test_fewer_needs_last_no_shorter(network) -> None:
    days, links, needed, sinks = network
    whole = never_last(milestones(days, links, needed, sinks or [0]).accuracy_days)
    assert never_last(milestones(days, links, needed[1:], sinks or [0]).accuracy_days) >= whole


def test_reach_notes_links_that_carry_both_ways() -> None:
    reach = Reach()
    handlers = reach.handlers()
    names = ["a", "b", "c"]
    table = NodeTable(
        [3, 4, 5], names, ["g"] * 3, ["sensor", "sink", "sensor"], [0.0, 1.0, 2.0], [5.0] * 3, names, names, [1.0] * 3
    )
    handlers[NodeTable](table, 0)
    handlers[LinkTable](LinkTable([3, 4, 4, 5, 3], [4, 3, 5, 4, 5], [0.0] * 5, [0.9, 0.5, 0.9, 0.4, 1.0]), 0)
    handlers[VariablePlacement](VariablePlacement([0, 1], ["x", "y"], [5, 5], [0], [1]), 0)
    assert reach.links == ((3, 4),)
    assert (reach.hosts, reach.sinks) == ({5}, {4})
    assert reach.positions_m[4] == (1.0, 5.0)
    assert reach.names == {3: "a", 4: "b", 5: "c"}
