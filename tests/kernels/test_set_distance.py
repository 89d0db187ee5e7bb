"""OSPA and GOSPA against brute force over all assignments, and the laws of a metric."""

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.kernels.set_distance import distances, gospa, keep_and_match, match, ospa

CUT_OFF_M = 3.0
PLACE = st.tuples(st.floats(-4, 4), st.floats(-4, 4))
POINTS = st.lists(PLACE, max_size=4).map(lambda places: np.array(places, dtype=float).reshape(-1, 2))
ORDERS = st.sampled_from([1.0, 2.0, 3.0])


def ospa_by_permutations(one, other, cut_off, order):
    """The definition of Schuhmacher et al. 2008, word by word."""
    if len(one) > len(other):
        one, other = other, one
    if len(other) == 0:
        return 0.0
    sums = [
        sum(min(np.linalg.norm(point - other[to]), cut_off) ** order for point, to in zip(one, chosen, strict=False))
        for chosen in permutations(range(len(other)), len(one))
    ]
    return ((min(sums) + cut_off**order * (len(other) - len(one))) / len(other)) ** (1 / order)


def gospa_by_assignment_sets(truth, found, cut_off, order):
    """Rahmathullah et al. 2017, proposition 1: the least over all sets of pairs, also those that leave points alone."""
    least = np.inf
    for count in range(min(len(truth), len(found)) + 1):
        for rows in combinations(range(len(truth)), count):
            for columns in permutations(range(len(found)), count):
                near = sum(
                    np.linalg.norm(truth[row] - found[column]) ** order
                    for row, column in zip(rows, columns, strict=True)
                )
                least = min(least, near + cut_off**order / 2 * (len(truth) + len(found) - 2 * count))
    return least ** (1 / order)


@given(POINTS, POINTS, ORDERS)
def test_ospa_is_the_least_over_all_permutations(one, other, order):
    assert ospa(one, other, CUT_OFF_M, order) == pytest.approx(
        ospa_by_permutations(one, other, CUT_OFF_M, order), abs=1e-9
    )


@given(POINTS, POINTS, ORDERS)
def test_gospa_is_the_least_over_all_sets_of_pairs(truth, found, order):
    whole = gospa(truth, found, CUT_OFF_M, order)
    assert whole.distance == pytest.approx(gospa_by_assignment_sets(truth, found, CUT_OFF_M, order), abs=1e-9)
    assert whole.localisation + whole.missed + whole.false == pytest.approx(whole.distance**order, abs=1e-9)
    assert min(whole.localisation, whole.missed, whole.false) >= 0.0


@given(POINTS, POINTS, POINTS, ORDERS)
def test_both_are_metrics(one, other, third, order):
    for distance in (ospa, lambda *arguments: gospa(*arguments).distance):
        there = distance(one, other, CUT_OFF_M, order)
        assert there == pytest.approx(distance(other, one, CUT_OFF_M, order), abs=1e-9)
        way_round = distance(one, third, CUT_OFF_M, order) + distance(third, other, CUT_OFF_M, order)
        assert there <= way_round + 1e-9
        assert distance(one, one[::-1], CUT_OFF_M, order) == pytest.approx(0.0, abs=1e-9)


@given(POINTS, ORDERS)
def test_against_nothing_ospa_is_the_cut_off(points, order):
    empty = np.zeros((0, 2))
    assert ospa(points, empty, CUT_OFF_M, order) == pytest.approx(CUT_OFF_M if len(points) else 0.0)
    whole = gospa(points, empty, CUT_OFF_M, order)
    assert (whole.localisation, whole.false) == (0.0, 0.0)
    assert whole.missed == pytest.approx(CUT_OFF_M**order / 2 * len(points))


def test_by_hand():
    """One track 3 m off of two targets, another 100 m off: p = 2, c = 10."""
    truth = np.array([[0.0, 0.0], [50.0, 0.0]])
    found = np.array([[3.0, 0.0], [150.0, 0.0]])
    assert ospa(truth, found, 10.0, 2.0) == pytest.approx(np.sqrt((9 + 100) / 2))
    whole = gospa(truth, found, 10.0, 2.0)
    assert (whole.localisation, whole.missed, whole.false) == (9.0, 50.0, 50.0)


def test_pairs_that_must_not_be_are_left_out():
    distance = np.array([[np.inf, 1.0], [np.inf, 2.0]])
    assert match(distance, 10.0, 2.0) == [(0, 1)]
    assert match(np.zeros((0, 3)), 10.0, 2.0) == []


@given(POINTS, POINTS)
def test_what_was_paired_stays_while_it_is_near(one, other):
    distance = distances(one, other)
    before = [(number, number) for number in range(min(len(one), len(other)))]
    pairs = keep_and_match(distance, before, CUT_OFF_M, 2.0)
    assert {pair for pair in before if distance[pair] < CUT_OFF_M} <= set(pairs)
    assert all(distance[pair] < CUT_OFF_M for pair in pairs)
    assert len({row for row, _ in pairs}) == len({column for _, column in pairs}) == len(pairs)
    assert keep_and_match(distance, [], CUT_OFF_M, 2.0) == match(distance, CUT_OFF_M, 2.0)
