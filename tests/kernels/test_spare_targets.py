"""All targets of a joint belief, or one less: evidence by plain sums, and readings that are clear."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.energy_sensing import EnergyModel
from netsim.kernels.particles import ParticleBelief, uniform_disc
from netsim.kernels.spare_targets import spare_operations, spare_target

MODEL = EnergyModel(43200.0, 2.0, 30.0)
SENSORS_M = np.stack(np.meshgrid(np.arange(0.0, 200.0, 40.0), np.arange(0.0, 200.0, 40.0)), axis=-1).reshape(-1, 2)


def found(belief, there_m, noise=0.0):
    readings = MODEL.mean(SENSORS_M, np.reshape(there_m, (-1, 2))) + noise
    likelihood = MODEL.log_likelihood(readings, SENSORS_M, belief.positions_m)
    return spare_target(MODEL, readings, SENSORS_M, belief, likelihood)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(2, 3), st.integers(1, 3))
def test_the_model_of_the_greatest_evidence_is_taken(seed, targets, there):
    rng = np.random.default_rng(seed)
    belief = ParticleBelief(rng.uniform(0, 160, (6, targets, 2)), np.log(rng.dirichlet(np.ones(6))))
    there_m, noise = rng.uniform(0, 160, (there, 2)), rng.normal(size=len(SENSORS_M))

    def evidence(places_m):
        densities = [
            np.prod(
                [
                    np.exp(-0.5 * (z / 200.0) ** 2)
                    for z in MODEL.mean(SENSORS_M, there_m) + noise - MODEL.mean(SENSORS_M, p)
                ]
            )
            for p in places_m
        ]
        return belief.weights @ densities

    faint = EnergyModel(MODEL.amplitude, 200.0, MODEL.saturation_m)  # so that plain densities do not underflow
    readings = MODEL.mean(SENSORS_M, there_m) + noise
    likelihood = faint.log_likelihood(readings, SENSORS_M, belief.positions_m)
    every = evidence(belief.positions_m)
    without = [evidence(np.delete(belief.positions_m, target, axis=1)) for target in range(targets)]
    best = int(np.argmax(without))
    expected = best if without[best] > every else None
    assert spare_target(faint, readings, SENSORS_M, belief, likelihood) == expected


@pytest.mark.parametrize("apart_m", [0.0, 10.0, 60.0])
def test_two_targets_are_two_however_near_and_one_is_one(apart_m):
    rng = np.random.default_rng(1)
    pair_m = np.array([[60.0, 70.0], [60.0 + apart_m, 70.0]])
    belief = uniform_disc(pair_m, 45.0, 200, rng)
    noise = rng.normal(size=len(SENSORS_M))
    assert found(belief, pair_m, noise) is None
    assert found(belief, pair_m[0], noise) is not None
    assert found(uniform_disc(pair_m[0], 45.0, 200, rng), pair_m[0]) is None


def test_the_one_that_is_gone_is_spare():
    belief = uniform_disc(np.array([[40.0, 40.0], [130.0, 120.0]]), 20.0, 200, np.random.default_rng(2))
    assert found(belief, (40.0, 40.0)) == 1
    assert found(belief, (130.0, 120.0)) == 0


def test_work_is_that_of_the_smaller_models():
    assert spare_operations(40, 200, 1) == 0
    assert spare_operations(40, 200, 3) > spare_operations(40, 200, 2) > 40 * 200 * 16
