"""Correlation decay against Algorithms 1 and 2 as the paper prints them, and against sums over all matchings."""

import math
import sys

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import GRAPHS, TREES, alone, partition, phi, random_weights, without

from netsim.kernels.correlation_decay import (
    Chain,
    DecayGraph,
    certified_interval,
    literal,
    literal_pair,
    literal_ratio,
    mask,
    members,
    normalised,
    two_factor,
    vertex_order,
)
from netsim.kernels.event_gating import gated_weights
from netsim.kernels.matchings import association_probabilities
from netsim.kernels.scaled_product import Product

fast = settings(deadline=None, max_examples=25)
depths = st.integers(0, 6)
sides = st.sampled_from(["event", "measurement"])
ORDERS = ("measurements_first", "events_first", "few_neighbours_first", "many_neighbours_first")


def subsets(weights, random, at_least=()):
    """Some vertices in some order, with some for certain."""
    everything = range(sum(weights.shape))
    kept = [vertex for vertex in everything if vertex in at_least or random.random() < 0.5]
    random.shuffle(kept)
    return kept


def all_pairs(weights):
    return np.argwhere(weights > 0.0).tolist()


@fast
@given(GRAPHS, depths, st.randoms(use_true_random=False))
def test_factors_are_those_of_algorithm_1_without_memory(weights, depth, random):
    """Asked in any order of one graph that remembers: what is kept is never mistaken for something else."""
    graph = DecayGraph(weights)
    for _ in range(12):
        removed = subsets(weights, random)
        level = random.randint(0, depth)
        for vertex in set(range(sum(weights.shape))) - set(removed):
            right = phi(without(weights, *removed), vertex, level)
            assert graph.factor(vertex, level, removed) == pytest.approx(right, rel=1e-13)


@fast
@given(TREES)
def test_exact_on_a_tree_at_its_depth(weights):
    rows, columns = weights.shape
    tree = nx.Graph((int(j), rows + int(k)) for j, k in np.argwhere(weights > 0.0))
    graph = DecayGraph(weights)
    for vertex, eccentricity in nx.eccentricity(tree).items():
        assert graph.factor(vertex, eccentricity) == pytest.approx(alone(weights, vertex), rel=1e-12)
    assert len(tree) == rows + columns


@fast
@given(GRAPHS, st.integers(0, 3))
def test_exact_from_twice_the_smaller_side_on(weights, more):
    graph = DecayGraph(weights)
    assert graph.exact_depth == 2 * min(weights.shape)
    for vertex in range(sum(weights.shape)):
        found = graph.factor(vertex, graph.exact_depth + more)
        assert found == pytest.approx(alone(weights, vertex), rel=1e-12)


@fast
@given(GRAPHS, st.floats(0.01, 100.0))
def test_even_depths_fall_to_the_truth_and_odd_ones_rise_to_it(weights, scale):
    weights = weights * scale
    graph = DecayGraph(weights)
    for vertex in range(sum(weights.shape)):
        truth = alone(weights, vertex)
        found = [graph.factor(vertex, depth) for depth in range(10)]
        assert all(low <= truth * (1 + 1e-12) for low in found[1::2])
        assert all(high >= truth * (1 - 1e-12) for high in found[::2])
        assert all(later <= before * (1 + 1e-12) for before, later in zip(found[::2], found[2::2], strict=False))
        assert all(later >= before * (1 - 1e-12) for before, later in zip(found[1::2], found[3::2], strict=False))


@fast
@given(GRAPHS, st.randoms(use_true_random=False))
def test_a_chain_of_factors_is_a_ratio_of_partition_functions(weights, random):
    """Lemma 1, at full depth, of any list and with anything missing beforehand."""
    graph = DecayGraph(weights)
    listed = subsets(weights, random)
    cut = random.randint(0, len(listed))
    removed, vertices = listed[:cut], listed[cut:]
    right = partition(without(weights, *listed)) / partition(without(weights, *removed))
    assert float(graph.chain(Chain(tuple(vertices), frozenset(removed)), 20)) == pytest.approx(right, rel=1e-11)


@fast
@given(GRAPHS, depths, st.randoms(use_true_random=False))
def test_the_literal_estimator_is_a_ratio_over_any_list_with_the_pair_in_it(weights, depth, random):
    """At any depth it is Algorithm 2 as printed over that list; at full depth it is exact."""
    graph, exact = DecayGraph(weights), association_probabilities(weights)
    for j, k in all_pairs(weights):
        ends = (j, graph.event(k))
        listed = subsets(weights, random, ends)
        above, below, left, bare = 1.0, 1.0, weights, without(weights, *ends)
        for vertex in listed:
            above, left = above * phi(left, vertex, depth), without(left, vertex)
            if vertex not in ends:
                below, bare = below * phi(bare, vertex, depth), without(bare, vertex)
        assert literal_pair(graph, j, k, depth, listed) == pytest.approx(weights[j, k] * above / below, rel=1e-12)
        assert literal_pair(graph, j, k, 20, listed) == pytest.approx(exact[j, k], rel=1e-11)


@fast
@given(GRAPHS)
def test_at_full_depth_the_order_does_not_matter(weights):
    graph, exact = DecayGraph(weights), association_probabilities(weights)
    for order in ORDERS:
        listed = vertex_order(graph, order)
        assert sorted(listed) == list(range(sum(weights.shape)))
        assert literal(graph, graph.exact_depth, listed) == pytest.approx(exact, rel=1e-11)


def test_before_full_depth_the_order_matters_and_a_literal_probability_can_exceed_one():
    graph = DecayGraph(np.full((3, 2), 50.0))
    found = {order: literal(graph, 1, vertex_order(graph, order)) for order in ORDERS}
    assert not np.allclose(found["measurements_first"], found["events_first"])
    assert all(literal(graph, 2, vertex_order(graph, order)).max() > 8.0 for order in ORDERS)


def test_vertex_orders():
    graph = DecayGraph(np.array([[1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]))
    assert vertex_order(graph, "measurements_first") == (0, 1, 2, 3, 4)
    assert vertex_order(graph, "events_first") == (3, 4, 0, 1, 2)
    assert vertex_order(graph, "few_neighbours_first") == (2, 1, 4, 0, 3)
    assert vertex_order(graph, "many_neighbours_first") == (0, 3, 1, 4, 2)


@fast
@given(GRAPHS, depths, sides)
def test_two_factors_bracket_the_truth(weights, depth, side):
    graph, exact = DecayGraph(weights), association_probabilities(weights)
    found = two_factor(graph, depth, side)
    assert (found >= exact * (1 - 1e-11)).all() if depth % 2 == 0 else (found <= exact * (1 + 1e-11)).all()
    assert two_factor(graph, 20, side) == pytest.approx(exact, rel=1e-11)


@fast
@given(GRAPHS, st.integers(1, 7))
def test_certified_intervals_hold_and_shrink_to_a_point(weights, depth):
    graph, exact = DecayGraph(weights), association_probabilities(weights)
    below, above = certified_interval(graph, depth)
    assert (below <= exact + 1e-12).all()
    assert (above >= exact - 1e-12).all()
    assert (above <= 1.0).all()
    tighter_below, tighter_above = certified_interval(graph, depth + 1)
    assert (tighter_below >= below - 1e-12).all()
    assert (tighter_above <= above + 1e-12).all()
    low, high = certified_interval(graph, graph.exact_depth + 1)
    assert high - low == pytest.approx(np.zeros_like(low), abs=1e-11)


@fast
@given(GRAPHS, depths, sides)
def test_normalised_probabilities_sum_to_one_on_their_side(weights, depth, side):
    """With what is left for the vertex alone, 1 / (1 + sum w Phi)."""
    graph, exact = DecayGraph(weights), association_probabilities(weights)
    found = normalised(graph, depth, side)
    assert (found <= 1.0).all()
    for number, line in enumerate(weights.T if side == "event" else weights):
        vertex = graph.event(number) if side == "event" else number
        alone_too = graph.factor(vertex, depth + 1)
        stated = (found.T if side == "event" else found)[number]
        assert len(line) == len(stated)
        assert alone_too + stated.sum() == pytest.approx(1.0, rel=1e-11)
    assert normalised(graph, 20, side) == pytest.approx(exact, rel=1e-11)


@fast
@given(GRAPHS, GRAPHS, st.integers(1, 6), st.sampled_from(ORDERS))
def test_disconnected_components_do_not_influence_each_other(first, second, depth, order):
    both = np.zeros((len(first) + len(second), first.shape[1] + second.shape[1]))
    both[: len(first), : first.shape[1]], both[len(first) :, first.shape[1] :] = first, second
    whole, part = DecayGraph(both), DecayGraph(first)
    corner = slice(len(first)), slice(first.shape[1])
    for estimate in (two_factor, normalised):
        np.testing.assert_array_equal(estimate(whole, depth)[corner], estimate(part, depth))
    np.testing.assert_array_equal(certified_interval(whole, depth)[0][corner], certified_interval(part, depth)[0])
    found = literal(whole, depth, vertex_order(whole, order))[corner]
    assert found == pytest.approx(literal(part, depth, vertex_order(part, order)), rel=1e-12)


@fast
@given(GRAPHS, depths)
def test_measurements_and_events_may_change_places(weights, depth):
    graph, turned = DecayGraph(weights), DecayGraph(weights.T)
    assert two_factor(graph, depth, "event") == pytest.approx(two_factor(turned, depth, "measurement").T, rel=1e-13)
    assert normalised(graph, depth, "event") == pytest.approx(normalised(turned, depth, "measurement").T, rel=1e-13)
    for side, other in (("measurements_first", "events_first"), ("events_first", "measurements_first")):
        found = literal(graph, depth, vertex_order(graph, side))
        assert found == pytest.approx(literal(turned, depth, vertex_order(turned, other)).T, rel=1e-12)


@given(st.sets(st.integers(0, 200)))
def test_sets_of_vertices_as_bits(vertices):
    assert list(members(mask(vertices))) == sorted(vertices)


@fast
@given(GRAPHS, depths)
def test_balls_are_those_of_breadth_first_search(weights, depth):
    rows = len(weights)
    network = nx.Graph([(j, rows + k) for j, k in all_pairs(weights)])
    network.add_nodes_from(range(sum(weights.shape)))
    graph = DecayGraph(weights)
    for vertex in network:
        within = nx.single_source_shortest_path_length(network, vertex, depth)
        assert set(members(graph.ball(vertex, depth))) == set(within)


def test_what_was_computed_once_is_not_computed_again():
    """Not a factor; products and last sums are."""
    graph = DecayGraph(random_weights(3, 8, 6, 1.0))
    listed = vertex_order(graph, "measurements_first")
    first, spent = literal(graph, 4, listed), graph.operations
    np.testing.assert_array_equal(literal(graph, 4, listed), first)
    again = graph.operations - spent
    assert again == 48 * (14 + 12 + 2) < spent
    two_factor(graph, 4)
    spent = graph.operations
    two_factor(graph, 4)
    assert graph.operations - spent == 48 * 3
    normalised(graph, 4)
    spent = graph.operations
    normalised(graph, 4)
    assert graph.operations - spent == 48 * (3 * 8 + 2)


@pytest.mark.parametrize("events", [30, 70, 200])
def test_products_that_no_float_can_hold_have_the_right_ratio(events):
    """Of many equal components of one event: 1 / Z is 12001^-events."""
    weights = np.kron(np.eye(events), np.full((20, 1), 600.0))
    graph, right = DecayGraph(weights), 600.0 / 12001.0
    whole = graph.chain(Chain(vertex_order(graph, "measurements_first")), 2)
    assert math.log(whole.mantissa) + whole.exponent * math.log(2.0) == pytest.approx(-events * math.log(12001.0))
    assert literal_pair(graph, 0, 0, 2, vertex_order(graph, "measurements_first")) == pytest.approx(right, rel=1e-12)
    assert literal_pair(graph, 0, 0, 2, vertex_order(graph, "events_first")) == pytest.approx(right, rel=1e-12)


@given(st.lists(st.floats(1e-3, 1.0), max_size=60), st.lists(st.floats(1e-3, 1.0), max_size=20))
def test_scaled_products_have_the_bits_of_plain_ones(first, second):
    scaled, plain = Product(), 1.0
    for factor in first:
        scaled, plain = scaled.times(factor), plain * factor
    assert float(scaled) == plain
    assert 0.5 <= scaled.mantissa < 1.0
    other = Product()
    for factor in second:
        other = other.times(factor)
    assert float(scaled.and_all_of(other)) == plain * float(other)
    assert literal_ratio(2.5, scaled, other) == 2.5 * plain / float(other)


def test_a_ratio_beyond_floats_is_the_largest_of_them():
    assert literal_ratio(1.0, Product(), Product(0.5, -5000)) == sys.float_info.max


def test_operations_are_counted_by_sum_and_term():
    """A star of three: the hub's sum has three terms, each leaf's, without the hub, none."""
    graph = DecayGraph(np.array([[1.0], [2.0], [3.0]]))
    assert graph.factor(3, 2) == pytest.approx(1.0 / 7.0)
    assert graph.operations == (2 + 3 * 3) + 3 * 2


def of_the_papers_set_up(seed):
    """Section VI: six events, 24 measurements; where these are is in a picture only."""
    predicted_m = np.array([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1)], dtype=float)
    measurements_m = np.random.default_rng(seed).uniform(-1.4, 1.4, (24, 2))
    weights = gated_weights(measurements_m, predicted_m, 0.5 * np.eye(2), 4.0, 0.8, 0.5)
    return DecayGraph(weights), association_probabilities(weights)


def test_the_papers_figure_2_at_six_levels():
    graph, exact = of_the_papers_set_up(0)
    assert np.abs(normalised(graph, 6) - exact).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_papers_figure_2_at_nine_levels(seed):
    graph, exact = of_the_papers_set_up(seed)
    assert np.abs(normalised(graph, 9) - exact).max() < 0.005


def test_the_interval_of_depth_one_is_that_of_depths_zero_and_one():
    weights = random_weights(5, 3, 3, 1.0)
    graph = DecayGraph(weights)
    _, above = certified_interval(graph, 1)
    assert above == pytest.approx(np.minimum(weights, 1.0))
