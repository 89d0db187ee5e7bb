"""The tail probability of readings: quadrature, and uniform under the model it assumes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import kstest, norm

from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec
from netsim.kernels.gating import amplitude_cdf, tail_probability
from netsim.kernels.grid_belief import Grid, uniform

GRID = Grid((0.0, 0.0), 5.0, 20, 20)
AMPLITUDE = SensorSpec((40.0, 30.0), AmplitudeModel(low=0.0, high=80.0, sd=0.1))
BEARING = SensorSpec((40.0, 30.0), BearingModel())
PRECISE = SensorSpec((40.0, 30.0), BearingModel(sd_rad=math.radians(0.4)))


@settings(deadline=None, max_examples=40)
@given(
    amplitude=st.floats(-0.5, 30.0),
    range_m=st.floats(1.0, 150.0),
    low=st.floats(0.0, 20.0),
    width=st.floats(1.0, 80.0),
    sd=st.floats(0.05, 1.0),
)
def test_the_cdf_is_the_integral_of_the_density(amplitude, range_m, low, width, sd):
    model = AmplitudeModel(low=low, high=low + width, sd=sd)
    below = low / range_m - 12.0 * sd
    points = [edge for edge in (low / range_m, (low + width) / range_m) if below < edge < amplitude]
    density = lambda z: math.exp(float(model.log_density(z, range_m)))  # noqa: E731
    expected = quad(density, below, amplitude, points=points or None, limit=200)[0] if amplitude > below else 0.0
    assert float(amplitude_cdf(model, amplitude, range_m)) == pytest.approx(expected, abs=1e-7)


def readings(sensor, belief, count, rng):
    """Drawn from the predictive distribution."""
    places = belief.centres_m[rng.choice(len(belief.cells), size=count, p=belief.probability)]
    offsets = places - np.asarray(sensor.position_m)
    range_m = np.maximum(np.hypot(*offsets.T), 0.5)
    if sensor.measures_bearing:
        true = np.arctan2(offsets[:, 0], offsets[:, 1])
        error = sensor.model.spread_rad(range_m) * rng.standard_normal(count)
        keep = np.abs(error) <= np.pi  # the model cuts off at half a turn
        return (true + error)[keep]
    model = sensor.model
    return rng.uniform(model.low, model.high, count) / range_m + model.sd * rng.standard_normal(count)


@pytest.mark.parametrize(
    ("sensor", "half_m"), [(AMPLITUDE, 0.0), (AMPLITUDE, 30.0), (BEARING, 0.0), (BEARING, 30.0), (PRECISE, 0.0)]
)
def test_tails_of_readings_that_fit_are_uniform(sensor, half_m):
    belief = uniform(GRID, (72.0, 81.0), half_m)
    tails = [
        tail_probability(belief, sensor, reading)
        for reading in readings(sensor, belief, 200 if sensor.measures_bearing else 800, np.random.default_rng(3))
    ]
    assert kstest(tails, "uniform").pvalue > 0.001


def test_a_loud_reading_far_from_the_belief_is_an_outlier():
    belief = uniform(GRID, (90.0, 90.0), 7.0)
    assert tail_probability(belief, AMPLITUDE, 0.5) > 0.3
    assert tail_probability(belief, AMPLITUDE, 20.0) < 1e-9
    assert tail_probability(belief, BEARING, math.radians(39.8)) > 0.9
    assert tail_probability(belief, BEARING, math.radians(-140.0)) < 1e-6


@pytest.mark.parametrize("sd_deg", [0.1, 1.0, 10.0])
def test_a_bearing_is_judged_by_its_distance_in_spreads_however_small_those_are(sd_deg):
    """Of a belief in one cell: the two tails of a normal distribution."""
    belief = uniform(GRID, (72.0, 81.0), 0.0)
    sensor = SensorSpec((40.0, 30.0), BearingModel(sd_rad=math.radians(sd_deg)))
    (offset_m,) = belief.centres_m - np.asarray(sensor.position_m)
    for spreads in (0.0, 1.0, 2.0, 3.3):
        reading = math.atan2(*offset_m) + spreads * math.radians(sd_deg)
        assert tail_probability(belief, sensor, reading) == pytest.approx(2.0 * norm.sf(spreads), rel=0.2)


def test_no_reading_is_no_outlier():
    assert tail_probability(uniform(GRID), AMPLITUDE, math.nan) == 1.0
