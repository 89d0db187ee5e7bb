"""What a node can certify from a part of the reports: bounds that hold for the whole graph, whatever is missing."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import GRAPHS

from netsim.kernels.correlation_decay import DecayGraph, certified_interval, mask, members
from netsim.kernels.decay_interval import DecayInterval, LeastWidth
from netsim.kernels.event_association import EventModel, PredictedEvent
from netsim.kernels.known_association import KnownAssociation, report_of
from netsim.kernels.matchings import association_probabilities

fast = settings(deadline=None, max_examples=60)
MODEL = EventModel((1.0, 0.3, 0.5), 4.0, 0.8, 0.1)
NODES = range(3, 9)


@dataclass(frozen=True)
class World:
    """Six sensors' measurements and some events, all within a few standard deviations."""

    points_m: dict
    events: tuple
    observers: dict

    @property
    def reports(self):
        return {node: report_of(node, self.points_m[node], self.events, MODEL) for node in NODES}

    def known(self, nodes):
        return KnownAssociation.of({node: self.reports[node] for node in nodes}, self.observers, MODEL)

    @property
    def truth(self):
        """Exact probability of every gated pair, by measurement's name and event's number."""
        names = [(node, number) for node in NODES for number in range(len(self.points_m[node]))]
        points_m = np.concatenate([self.points_m[node] for node in NODES])
        places_m = np.array([(event.x_m, event.y_m) for event in self.events]).reshape(-1, 2)
        beta = association_probabilities(MODEL.weights(points_m, places_m))
        return {(names[j], self.events[k].event): beta[j, k] for j, k in np.argwhere(beta > 0.0).tolist()}

    def bounds(self, nodes, depth):
        known = self.known(nodes)
        interval = DecayInterval(known.graph, known.incomplete)
        return {
            (known.measurements[j], known.events[k].event): interval.pair(j, k, depth)
            for j, k in np.argwhere(known.graph.weights > 0.0).tolist()
        }


def world(seed, events, measurements):
    """Sensors may have a measurement of every event of which they have one, and of some others."""
    rng = np.random.default_rng(seed)
    places_m = rng.uniform(-3.0, 3.0, (events, 2))
    listed = tuple(PredictedEvent(10 + k, int(rng.choice(NODES)), *place) for k, place in enumerate(places_m.tolist()))
    owners, points_m = rng.choice(NODES, measurements), rng.uniform(-3.5, 3.5, (measurements, 2))
    of_node = {node: points_m[owners == node] for node in NODES}
    gated = {node: MODEL.weights(of_node[node], places_m).any(axis=0) for node in NODES}
    observers = {
        event.event: {node for node in NODES if gated[node][k] or rng.random() < 0.2} for k, event in enumerate(listed)
    }
    return World(of_node, listed, observers)


WORLDS = st.builds(world, st.integers(0, 2**32 - 1), st.integers(0, 5), st.integers(0, 9))
PARTS = st.sets(st.sampled_from(NODES))


@settings(deadline=None, max_examples=150)
@given(WORLDS, PARTS, st.integers(1, 8))
def test_intervals_hold_for_the_whole_graph_whatever_reports_are_missing(scene, nodes, depth):
    for pair, (low, high) in scene.bounds(nodes, depth).items():
        assert 0.0 <= low <= scene.truth[pair] + 1e-12
        assert scene.truth[pair] - 1e-12 <= high <= 1.0


@fast
@given(WORLDS, PARTS, PARTS, st.integers(1, 6))
def test_intervals_are_nested_as_reports_come_and_levels_grow(scene, nodes, more, depth):
    first, deeper, richer = (
        scene.bounds(nodes, depth),
        scene.bounds(nodes, depth + 1),
        scene.bounds(nodes | more, depth),
    )
    assert first.keys() == deeper.keys() <= richer.keys()
    for pair, (low, high) in first.items():
        for narrower in (deeper[pair], richer[pair]):
            assert low - 1e-12 <= narrower[0] <= narrower[1] + 1e-12
            assert narrower[1] <= high + 1e-12


@fast
@given(WORLDS)
def test_with_all_reports_nothing_is_left_open_and_deep_intervals_are_points(scene):
    known = scene.known(NODES)
    assert not known.incomplete
    truth, bounds = scene.truth, scene.bounds(NODES, known.graph.exact_depth + 1)
    assert bounds.keys() == truth.keys()
    for pair, (low, high) in bounds.items():
        assert low == pytest.approx(truth[pair], rel=1e-10)
        assert high == pytest.approx(truth[pair], rel=1e-10)


@fast
@given(WORLDS, PARTS)
def test_known_graphs_are_put_together_in_the_order_of_names(scene, nodes):
    """Every known measurement has all its edges, with the weights of the whole; events with an observer that is silent are
    marked, and no others.
    """
    known = scene.known(nodes)
    assert list(known.measurements) == sorted(known.measurements)
    assert [event.event for event in known.events] == sorted({event.event for event in known.events})
    assert known.vertex_of_measurement == {name: row for row, name in enumerate(known.measurements)}
    rows = len(known.measurements)
    assert known.vertex_of_event == {event.event: rows + column for column, event in enumerate(known.events)}
    edges = {(known.measurements[j], known.events[k].event) for j, k in np.argwhere(known.graph.weights > 0.0).tolist()}
    assert edges == {(name, event) for name, event in scene.truth if name[0] in nodes}
    for event in known.events:
        is_open = bool(scene.observers[event.event] - nodes)
        assert (known.vertex_of_event[event.event] in known.incomplete) == is_open


@fast
@given(GRAPHS, st.integers(0, 7), st.randoms(use_true_random=False))
def test_where_all_is_known_both_ends_are_factors_of_two_neighbouring_depths(weights, depth, random):
    graph, interval = DecayGraph(weights), DecayInterval(DecayGraph(weights))
    removed = [vertex for vertex in range(sum(weights.shape)) if random.random() < 0.3]
    for vertex in set(range(sum(weights.shape))) - set(removed):
        low, high = interval.factor(vertex, depth, mask(removed))
        assert high == pytest.approx(graph.factor(vertex, depth - depth % 2, removed), rel=1e-12)
        right = graph.factor(vertex, depth - 1 + depth % 2, removed) if depth else 0.0
        assert low == pytest.approx(right, rel=1e-12)


@fast
@given(GRAPHS, st.integers(1, 6))
def test_the_interval_of_a_pair_is_never_wider_than_that_of_two_factors(weights, depth):
    interval = DecayInterval(DecayGraph(weights))
    below, above = certified_interval(DecayGraph(weights), depth)
    for j, k in np.argwhere(weights > 0.0).tolist():
        low, high = interval.pair(j, k, depth)
        assert low >= below[j, k] * (1 - 1e-12)
        assert high <= above[j, k] * (1 + 1e-12)


@fast
@given(GRAPHS, st.integers(1, 5), st.randoms(use_true_random=False))
def test_an_interval_that_remembers_mistakes_nothing_for_something_else(weights, depth, random):
    """Asked for many removed sets and depths, it answers as one that was never asked before."""
    graph, everything = DecayGraph(weights), range(sum(weights.shape))
    incomplete = [vertex for vertex in everything if vertex >= len(weights) and random.random() < 0.5]
    kept = DecayInterval(graph, incomplete)
    for _ in range(8):
        removed = mask(vertex for vertex in everything if random.random() < 0.4)
        level = random.randint(1, depth)
        for vertex in set(everything) - set(members(removed)):
            assert kept.factor(vertex, level, removed) == DecayInterval(graph, incomplete).factor(
                vertex, level, removed
            )


def test_levels_beyond_the_longest_path_cost_nothing_more():
    graph = DecayGraph(np.ones((5, 3)))
    interval = DecayInterval(graph)
    deep = interval.factor(0, graph.exact_depth + 1)
    spent = interval.operations
    assert interval.factor(0, 100) == deep
    assert interval.operations == spent


def test_operations_are_counted_by_sum_and_term():
    interval = DecayInterval(DecayGraph(np.array([[1.0], [2.0], [3.0]])))
    assert interval.factor(3, 2) == pytest.approx((1.0 / 7.0, 1.0 / 7.0))
    assert interval.operations == (4 + 3 * 6) + 3 * 4


def test_the_last_sums_of_a_pair_are_counted_each_time():
    """A measurement of one event with three: sums of one term and of three."""
    interval = DecayInterval(DecayGraph(np.array([[1.0], [2.0], [3.0]])))
    first, spent = interval.pair(0, 0, 2), interval.operations
    assert interval.pair(0, 0, 2) == first
    assert interval.operations - spent == (1 + 3) * 6 + 22


@settings(deadline=None, max_examples=150)
@given(WORLDS, PARTS, PARTS, PARTS, st.integers(1, 5), st.integers(1, 8))
def test_no_report_of_others_and_no_level_makes_an_interval_narrower_than_the_least(
    scene, nodes, silent, later, depth, end
):
    """Sensors that will never tell, and others of which some will."""
    silent, known = silent - nodes, scene.known(nodes)
    missing = {event.event: scene.observers[event.event] - nodes for event in known.events}
    closed = [known.vertex_of_event[event] for event, those in missing.items() if those & silent]
    pending = [known.vertex_of_event[event] for event, those in missing.items() if those - silent]
    least, at_the_end = LeastWidth(known.graph, pending, closed), scene.bounds(nodes | later - silent, end)
    for j, k in np.argwhere(known.graph.weights > 0.0).tolist():
        low, high = at_the_end[known.measurements[j], known.events[k].event]
        assert least.pair(j, k, depth) <= high - low + 1e-12


def test_the_least_width_of_an_event_that_will_never_be_whole_is_what_is_possible_of_it():
    """As in the next test, and with another measurement of the event, both known for certain."""
    graph = DecayGraph(np.array([[4.0]]))
    assert LeastWidth(graph, [], [1]).pair(0, 0, 8) == pytest.approx(0.8)
    assert LeastWidth(graph, [1], [1]).pair(0, 0, 8) == LeastWidth(graph, [], []).pair(0, 0, 8) == 0.0
    both = DecayGraph(np.array([[4.0], [3.0]]))
    assert LeastWidth(both, [], [2]).pair(0, 0, 8) == pytest.approx(4.0 / 8.0)


def test_an_event_with_missing_measurements_still_bounds_from_above():
    """One measurement, one event of which others may have measurements: any number from nothing to w / (1 + w)."""
    graph = DecayGraph(np.array([[4.0]]))
    assert DecayInterval(graph, [1]).pair(0, 0, 8) == (0.0, pytest.approx(0.8))


def test_a_report_leaves_out_what_is_not_gated_and_keeps_numbers():
    events = (PredictedEvent(2, 5, 0.0, 0.0), PredictedEvent(7, 6, 50.0, 0.0))
    report = report_of(4, np.array([[30.0, 30.0], [0.5, 0.0], [-0.5, 0.2]]), events, MODEL)
    assert report.numbers == (1, 2)
    assert report.events == events[:1]
    assert report.measurements_m.tolist() == [[0.5, 0.0], [-0.5, 0.2]]
    empty = report_of(4, np.empty((0, 2)), (), MODEL)
    assert (empty.numbers, empty.events, empty.measurements_m.shape) == ((), (), (0, 2))


def test_what_its_sensor_does_not_count_nobody_counts():
    """A measurement in the gate of an event that the report does not name, as positions rounded on the air may have it."""
    near, other = PredictedEvent(0, 1, 0.0, 0.0), PredictedEvent(1, 2, 0.5, 0.0)
    reports = {
        1: report_of(1, np.array([[0.1, 0.0]]), (near,), MODEL),
        2: report_of(2, np.zeros((1, 2)), (other,), MODEL),
    }
    known = KnownAssociation.of(reports, {0: [1], 1: [2]}, MODEL)
    assert (known.graph.weights > 0.0).tolist() == [[True, False], [False, True]]
