"""Sums of energies: eq 3 by hand, symmetry in the sources, and the range at which one stands out of the noise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from netsim.kernels.energy_sensing import (
    EnergyModel,
    amplitude_for,
    likelihood_operations,
    mean_operations,
    sensing_range_m,
)

MODEL = EnergyModel(amplitude=3.0 * 2.0 * 120.0**2, noise_sd=2.0, saturation_m=30.0)
SEEDS = st.integers(0, 2**32 - 1)


def test_a_reading_is_the_sum_of_what_each_source_gives():
    sensors_m = np.array([[0.0, 0.0], [100.0, 0.0]])
    targets_m = np.array([[60.0, 80.0], [10.0, 0.0]])  # 100 m and 10 m, less than the saturation, from the first sensor
    expected = [86400.0 / 10000.0 + 86400.0 / 900.0, 86400.0 / 8000.0 + 86400.0 / 8100.0]
    np.testing.assert_allclose(MODEL.mean(sensors_m, targets_m), expected, rtol=1e-12)


@given(SEEDS, st.integers(1, 4), st.integers(0, 5), st.integers(1, 6))
def test_the_likelihood_is_a_product_of_normal_densities(seed, targets, sensors, particles):
    rng = np.random.default_rng(seed)
    sensors_m, targets_m = rng.uniform(0, 200, (sensors, 2)), rng.uniform(0, 200, (particles, targets, 2))
    readings = rng.normal(20.0, 10.0, sensors)
    expected = np.zeros(particles)
    for particle, places in enumerate(targets_m):
        for reading, (x, y) in zip(readings, sensors_m, strict=True):
            heard = sum(MODEL.amplitude / max(math.hypot(x - u, y - v), 30.0) ** 2 for u, v in places)
            expected[particle] += norm.logpdf(reading, heard, MODEL.noise_sd)
    np.testing.assert_allclose(MODEL.log_likelihood(readings, sensors_m, targets_m), expected, rtol=1e-9, atol=1e-9)


@given(SEEDS)
def test_readings_do_not_tell_which_source_is_which(seed):
    rng = np.random.default_rng(seed)
    sensors_m, targets_m = rng.uniform(0, 200, (5, 2)), rng.uniform(0, 200, (7, 3, 2))
    readings = rng.normal(20.0, 10.0, 5)
    swapped = MODEL.log_likelihood(readings, sensors_m, targets_m[:, [2, 0, 1]])
    np.testing.assert_allclose(swapped, MODEL.log_likelihood(readings, sensors_m, targets_m), rtol=1e-9)


def test_a_reading_that_is_none_says_nothing():
    sensors_m, targets_m = np.array([[0.0, 0.0], [50.0, 0.0]]), np.array([[[20.0, 30.0]], [[70.0, 0.0]]])
    alone = MODEL.log_likelihood(np.array([12.0]), sensors_m[1:], targets_m)
    np.testing.assert_array_equal(MODEL.log_likelihood(np.array([np.nan, 12.0]), sensors_m, targets_m), alone)
    assert MODEL.log_likelihood(np.array([np.nan, np.nan]), sensors_m, targets_m).tolist() == [0.0, 0.0]


def test_at_the_sensing_range_a_source_gives_three_deviations():
    range_m = sensing_range_m(MODEL)
    assert range_m == pytest.approx(120.0, rel=1e-12)
    heard = MODEL.mean(np.zeros((1, 2)), np.array([[range_m, 0.0]]))
    assert heard[0] == pytest.approx(3.0 * MODEL.noise_sd, rel=1e-12)
    assert amplitude_for(range_m, MODEL.noise_sd) == pytest.approx(MODEL.amplitude, rel=1e-12)


def test_a_source_too_faint_within_the_saturation_range_is_sensed_nowhere():
    assert sensing_range_m(EnergyModel(amplitude=100.0, noise_sd=1.0, saturation_m=30.0)) == 0.0


@pytest.mark.parametrize("wrong", [{"amplitude": 0.0}, {"noise_sd": -1.0}, {"saturation_m": math.nan}])
def test_a_model_without_a_density_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        EnergyModel(**{"amplitude": 1.0, "noise_sd": 1.0, "saturation_m": 1.0, **wrong})


def test_work_grows_with_sensors_particles_and_targets():
    assert mean_operations(10, 200, 2) == 2 * mean_operations(10, 100, 2) == 2 * mean_operations(5, 200, 2) == 32_000
    assert likelihood_operations(10, 200, 2) > mean_operations(10, 200, 2)
