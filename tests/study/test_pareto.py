"""Pareto sets against a search by hand."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from study_records import study, trials

from netsim.study.statistics import aggregate, pareto_candidates, pareto_set

COORDINATE = st.one_of(st.integers(0, 4).map(float), st.just(float("nan")))
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=1, max_size=12)


def summary_of(points, error="association_error", cost="energy_j"):
    rows = [
        (number, metric, value)
        for number, point in enumerate(points)
        for metric, value in zip((error, cost), point, strict=True)
    ]
    return pd.DataFrame(rows, columns=["variant", "metric", "mean"])


def by_hand(points):
    """Those with both coordinates that no other dominates."""
    whole = {number: point for number, point in enumerate(points) if not np.isnan(point).any()}
    return {
        number
        for number, (x, y) in whole.items()
        if not any(u <= x and v <= y and (u, v) != (x, y) for u, v in whole.values())
    }


@given(POINTS)
def test_the_set_is_that_of_a_search_by_hand(points):
    found = pareto_set(summary_of(points), "association_error", "energy_j")
    assert set(found) == by_hand(points)
    assert [points[number][0] for number in found] == sorted(points[number][0] for number in found)
    assert len(set(found)) == len(found)


@given(POINTS)
def test_rounding_neither_beats_nor_parts_equals(points):
    """A third of the points' values are shifted by less than sums are rounded: the set is the same."""
    shaken = [(x * (1 + 1e-15 * (place % 3)), y * (1 - 1e-15 * (place % 2))) for place, (x, y) in enumerate(points)]
    found = pareto_set(summary_of(shaken), "association_error", "energy_j")
    assert set(found) == by_hand(points)


@given(POINTS)
def test_where_higher_is_better_the_catalogue_knows(points):
    mirrored = [(-first, second) for first, second in points]
    found = pareto_set(summary_of(mirrored, error="delivery_ratio_unicast"), "delivery_ratio_unicast", "energy_j")
    assert set(found) == by_hand(points)


def measured(seed, spread, repetitions=6, variants=5):
    """A study of variants with random true means and a spread between repetitions."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(0, 1, size=(variants, 2))
    info = study({"level": list(range(variants))}, repetitions)

    def figures(levels, repetition):
        error, cost = truth[levels["level"]] + spread * rng.normal(size=2)
        return {"association_error": error, "energy_j": cost}

    return info, trials(info, figures)


@given(st.integers(0, 2**32), st.sampled_from([0.01, 0.1, 1.0]))
def test_the_cautious_set_holds_the_set_of_the_means(seed, spread):
    info, table = measured(seed, spread)
    summary = aggregate(table, info.axis_names, ["association_error", "energy_j"])
    names = ("association_error", "energy_j")
    assert set(pareto_set(summary, *names)) <= set(pareto_candidates(table, *names))


def test_with_enough_repetitions_the_cautious_set_is_the_true_one():
    truth = {"a": (0.1, 3.0), "b": (0.3, 1.0), "c": (0.31, 1.1), "d": (0.3, 3.2)}
    rng = np.random.default_rng(5)
    info = study({"level": list(truth)}, 40)
    noise = rng.normal(size=40)

    def figures(levels, repetition):
        error, cost = truth[levels["level"]]
        own = 0.002 * rng.normal(size=2)
        return {"association_error": error + noise[repetition] + own[0], "energy_j": cost + own[1]}

    table = trials(info, figures)
    assert pareto_candidates(table, "association_error", "energy_j") == [0, 1]
    few = table[table["repetition"] < 1]
    assert pareto_candidates(few, "association_error", "energy_j") == [0, 1, 2, 3]


def test_pairs_are_made_within_groups_only():
    info = study({"level": ["a", "b", "c"]}, 8)
    table = trials(info, lambda levels, n: dict.fromkeys(("association_error", "energy_j"), ord(levels["level"]) + n))
    names = ("association_error", "energy_j")
    assert pareto_candidates(table, *names) == [0]
    assert pareto_candidates(table, *names, [[0], [1, 2]]) == [0, 1]
    assert pareto_candidates(table, *names, [[2]]) == [2]


@pytest.mark.parametrize(("levels", "found"), [("ab", [0]), ("abcdefgh", list(range(8)))])
def test_the_cautious_set_counts_how_many_pairs_were_looked_at(levels, found):
    """b costs 1 to 3 more than the others, with p = 0.015: that decides one pair, and none among 28."""
    info = study({"level": list(levels)}, 4)
    more = (1.0, 2.0, 3.0, 2.5)
    table = trials(
        info,
        lambda at, n: {"association_error": 0.5, "energy_j": 1.0 + (more[n] if at["level"] == "b" else 0.0)},
    )
    assert pareto_candidates(table, "association_error", "energy_j") == found


def test_equal_in_one_and_better_in_the_other_dominates():
    info = study({"level": ["a", "b", "c"]}, 6)
    figures = {"a": (0.5, 10), "b": (0.5, 12), "c": (None, 1)}
    table = trials(
        info,
        lambda levels, repetition: dict(zip(("association_error", "frames"), figures[levels["level"]], strict=True)),
    )
    assert pareto_candidates(table, "association_error", "frames") == [0]
