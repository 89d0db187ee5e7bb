"""Errors of target counts from hand-made events."""

import numpy as np
import pytest

from netsim.kernels.counting_exact import exact_counts
from netsim.kernels.target_distribution import CountingModel, DistributionInstance, Subregion
from netsim.metrics.collect import metrics_of
from netsim.trace.events import Marginals, Problem, TruthCounts


def instance():
    """Two subregions of one sensor: 0 to 2 targets and 1 to 5; prior means of 0.5 and 3.2 targets."""
    one = Subregion(1, 0, (0,), 10.0, (0.0, 0.0), (0, 1, 2))
    other = Subregion(2, 0, (0,), 64.0, (0.0, 0.0), (1, 2, 3, 4, 5))
    return DistributionInstance((0,), np.array([3.0]), (one, other), CountingModel(0.05, 0.8, 0.0, 1.0))


def figures(*beliefs, counts=(1, 5)):
    told = [(9, Marginals(0, vertex, probability, number, 0)) for vertex, probability, number in beliefs]
    return metrics_of(
        [(0, Problem("target-distribution", instance().to_json())), (0, TruthCounts([1, 2], list(counts))), *told]
    )


def test_error_is_the_distance_over_the_number_of_states():
    found = figures((1, [0.1, 0.2, 0.7], 3), (2, [0.0, 0.6, 0.2, 0.2, 0.0], 3))
    assert found["count_error"] == pytest.approx((1 / 3 + 3 / 5) / 2)
    assert found["count_error_wrong"] == 1.0
    assert found["count_distance"] == 2.0
    assert found["subregions"] == 2


def test_prior_alone_answers_its_mode():
    """0 targets and 3 are the most probable beforehand."""
    found = figures((1, [0.0, 1.0, 0.0], 3), (2, [0.0, 0.0, 0.0, 0.0, 1.0], 3))
    assert found["count_error"] == 0.0
    assert found["count_error_prior"] == pytest.approx((1 / 3 + 2 / 5) / 2)
    assert found["count_error_prior_wrong"] == 1.0
    assert figures(counts=(0, 3))["count_error_prior"] == 0.0


def test_equal_probabilities_share_the_answer():
    """Taking the first of the equal ones would be right by the order of the states alone."""
    found = figures((1, [0.4, 0.4, 0.2], 3), (2, [0.0, 0.0, 0.0, 0.0, 1.0], 3), counts=(0, 5))
    assert found["count_error_wrong"] == pytest.approx(0.25)
    assert found["count_error"] == pytest.approx(1 / 3 / 2 / 2)


def test_exact_marginals_have_no_distance_to_themselves():
    exact = [np.exp(belief).tolist() for belief in exact_counts(instance())]
    found = figures((1, exact[0], 3), (2, exact[1], 3))
    assert found["count_marginal_error_linf"] == pytest.approx(0.0, abs=1e-12)
    assert found["count_error_exact"] == pytest.approx(found["count_error"])
    off = figures((1, exact[0], 3), (2, [0.0, 0.0, 0.0, 0.0, 1.0], 3))
    assert off["count_marginal_error_linf"] == pytest.approx(max(1.0 - exact[1][4], *exact[1][:4]))


def test_a_subregion_nobody_told_of_counts_with_its_prior():
    found = figures((1, [0.0, 1.0, 0.0], 0), (1, [1.0, 0.0, 0.0], 1))
    assert found["count_error_by_round"] == [pytest.approx(2 / 5 / 2), pytest.approx((1 / 3 + 2 / 5) / 2)]
    assert found["count_error"] == pytest.approx((1 / 3 + 2 / 5) / 2)
    assert figures()["count_error"] is None
