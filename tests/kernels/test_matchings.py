"""Sums over matchings against enumeration, their symmetries, and what is out of reach."""

import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_enumeration import GRAPHS, matchings, partition, probabilities, random_weights

from netsim.errors import ScenarioError
from netsim.kernels import matchings as kernel
from netsim.kernels.matchings import association_probabilities, components, count_matchings, log_partition, table_size

fast = settings(deadline=None, max_examples=40)
scales = st.sampled_from([1e-12, 1.0, 1e9])


@fast
@given(GRAPHS, scales)
def test_all_sums_are_those_of_enumeration(weights, scale):
    weights = weights * scale
    assert count_matchings(weights) == len(list(matchings(weights)))
    assert log_partition(weights) == pytest.approx(math.log(partition(weights)), rel=1e-12, abs=1e-12)
    assert association_probabilities(weights) == pytest.approx(probabilities(weights), rel=1e-11, abs=1e-300)


@fast
@given(GRAPHS)
def test_measurements_and_events_may_change_places(weights):
    assert count_matchings(weights.T) == count_matchings(weights)
    assert log_partition(weights.T) == pytest.approx(log_partition(weights), rel=1e-13, abs=1e-13)
    assert association_probabilities(weights.T) == pytest.approx(association_probabilities(weights).T, rel=1e-12)


@fast
@given(GRAPHS, GRAPHS, st.randoms(use_true_random=False))
def test_components_are_independent(first, second, random):
    """Beside any other graph, and however the two are mingled: the same bits."""
    rows, columns = len(first) + len(second), first.shape[1] + second.shape[1]
    both = np.zeros((rows, columns))
    row_places = np.array(random.sample(range(rows), rows), dtype=int)
    column_places = np.array(random.sample(range(columns), columns), dtype=int)
    mine = np.ix_(np.sort(row_places[: len(first)]), np.sort(column_places[: first.shape[1]]))
    theirs = np.ix_(np.sort(row_places[len(first) :]), np.sort(column_places[first.shape[1] :]))
    both[mine], both[theirs] = first, second
    np.testing.assert_array_equal(association_probabilities(both)[mine], association_probabilities(first))
    np.testing.assert_array_equal(association_probabilities(both)[theirs], association_probabilities(second))
    assert count_matchings(both) == count_matchings(first) * count_matchings(second)
    assert log_partition(both) == pytest.approx(log_partition(first) + log_partition(second), rel=1e-12, abs=1e-12)


def test_components_have_every_edge_once_and_no_lonely_vertex():
    weights = np.zeros((5, 4))
    weights[0, 3] = weights[4, 3] = weights[2, 0] = weights[2, 1] = 1.0
    parts = [(part.measurements.tolist(), part.events.tolist()) for part in components(weights)]
    assert parts == [([0, 4], [3]), ([2], [0, 1])]
    assert table_size(weights) == 2 << 1


@pytest.mark.parametrize("shape", [(0, 0), (0, 3), (3, 0), (2, 3)])
def test_without_pairs_there_is_one_association_event(shape):
    weights = np.zeros(shape)
    assert count_matchings(weights) == 1
    assert log_partition(weights) == 0.0
    assert association_probabilities(weights).shape == shape


@pytest.mark.parametrize("rows", [4, 20])
def test_complete_graphs_are_counted_exactly(rows):
    """Sum over k of the ways to choose k measurements and k of 6 events, and to pair them: whole numbers, no rounding."""
    right = sum(math.comb(rows, k) * math.comb(6, k) * math.factorial(k) for k in range(7))
    assert count_matchings(np.ones((rows, 6))) == count_matchings(np.ones((6, rows))) == right


def test_counts_beyond_floats_are_exact():
    """Of 60 components that hold 41 association events each."""
    weights = np.kron(np.eye(60), np.ones((40, 1)))
    assert count_matchings(weights) == 41**60


@pytest.mark.parametrize("shape", [(21, 30), (30, 21)])
def test_what_is_out_of_reach_is_refused_with_its_size(shape):
    for sums in (count_matchings, log_partition, association_probabilities):
        with pytest.raises(
            ScenarioError, match=r"a table of 6.29e\+07 numbers, more than 5e\+07: use fewer events, or a"
        ):
            sums(np.ones(shape))


def test_what_no_float_can_say_is_refused_too():
    with pytest.raises(ScenarioError, match=r"a table of 2\^1110 numbers"):
        association_probabilities(np.ones((1100, 1100)))


def test_only_the_components_sizes_count(monkeypatch):
    monkeypatch.setattr(kernel, "MOST_NUMBERS", 24)
    weights = np.kron(np.eye(4), np.ones((6, 2)))
    assert table_size(weights) == 24
    assert count_matchings(weights) == (1 + 12 + 30) ** 4


def test_ten_events_and_forty_measurements_are_quick():
    """A complete graph is the worst; milliseconds where nothing else runs."""
    weights = random_weights(1, 40, 10, share=1.0)
    begin_s = time.process_time()
    found = association_probabilities(weights)
    assert time.process_time() - begin_s < 1.0
    assert (found.sum(axis=0) < 1.0).all()
    assert found == pytest.approx(association_probabilities(weights[::-1])[::-1], rel=1e-12)
