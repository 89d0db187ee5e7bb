"""Exact origins of measurements against the dense joint of all sensors."""

import numpy as np
import pytest
from association_oracle import instance, joint, model, origin_table
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from netsim.errors import ScenarioError
from netsim.kernels.association_marginals import exact_origins

SENSORS = 3
COVERAGE = st.lists(
    st.sets(st.integers(0, SENSORS - 1), min_size=1).map(lambda sensors: tuple(sorted(sensors))), min_size=1, max_size=4
)


@settings(max_examples=40)
@given(COVERAGE, st.lists(st.integers(0, 2), min_size=SENSORS, max_size=SENSORS), st.integers(0, 99), st.booleans())
def test_origins_are_those_of_the_joint(coverage, counts, seed, strict):
    problem = instance(coverage, counts, seed, model("strict" if strict else "geometric"))
    log_joint = joint(problem)
    if not np.isfinite(log_joint).any():
        with pytest.raises(ScenarioError):
            exact_origins(problem)
        return
    for sensor, found in enumerate(exact_origins(problem)):
        others = tuple(axis for axis in range(SENSORS) if axis != sensor)
        expected = origin_table(problem, sensor, logsumexp(log_joint, axis=others), np.sum)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_a_problem_too_large_says_how_large():
    problem = instance([(0, 1)] * 4, [3, 3], 1, model("geometric"))
    with pytest.raises(ScenarioError, match="table of 256 entries, more than the limit of 100"):
        exact_origins(problem, 100)
    with pytest.raises(ScenarioError, match="more than the limit of 300"):
        exact_origins(problem, 300)  # the model fits, elimination does not
    assert [found.shape for found in exact_origins(problem)] == [(3, 5), (3, 5)]
