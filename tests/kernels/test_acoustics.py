"""Likelihoods of acoustic sensors: closed forms against quadrature, also far out, and densities that are densities."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec, bearing_rad, wrapped_rad

RANGES_M = st.floats(0.5, 400.0)
MODELS = st.builds(
    lambda low, width, sd: AmplitudeModel(low, low + width, sd),
    st.floats(0.0, 50.0),
    st.floats(0.5, 100.0),
    st.floats(0.02, 3.0),
)
BEARING_MODELS = st.builds(
    BearingModel,
    st.floats(0.02, 2.0),
    st.floats(1.0, 50.0),
    st.floats(60.0, 200.0),
    st.floats(0.02, 3.0),
    st.floats(0, 0.1),
)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(120)


def log_integral(log_density, low, high):
    """Logarithm of an integral of exp(log_density) by Gauss's rule."""
    points = low + (high - low) * (NODES + 1.0) / 2.0
    return float(logsumexp(log_density(points), b=WEIGHTS * (high - low) / 2.0))


def integral(log_density, low, high, step):
    """An integral of exp(log_density) by Gauss's rule of 8 points on pieces of at most a step."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(low, high, 2 + int((high - low) / step))
    half = np.diff(edges)[:, None] / 2.0
    points = (edges[:-1] + edges[1:])[:, None] / 2.0 + half * nodes
    return float((np.exp(log_density(points)) * half * weights).sum())


def log_eq_6_by_quadrature(model, z, r):
    """The first line of eq 6, over the source amplitudes that carry all but exp(-40) of the integral."""
    top = min(max(z * r, model.low), model.high)
    gap = math.hypot(z - top / r, math.sqrt(80.0) * model.sd)
    low, high = max(model.low, r * (z - gap)), min(model.high, r * (z + gap))
    normal = lambda a: -0.5 * ((z - a / r) / model.sd) ** 2 - math.log(model.sd * math.sqrt(2.0 * math.pi))  # noqa: E731
    return log_integral(normal, low, high) - math.log(model.high - model.low)


@given(MODELS, RANGES_M, st.floats(-5.0, 200.0))
def test_amplitude_density_is_eq_6_also_in_far_tails(model, r, z):
    found = float(model.log_density(z, r))
    assert found == pytest.approx(log_eq_6_by_quadrature(model, z, r), rel=1e-7, abs=1e-7)


def test_a_reading_beyond_all_bounds_is_impossible():
    assert AmplitudeModel().log_density(1e30, np.array([1.0, 50.0])).tolist() == [-math.inf, -math.inf]


def test_the_tails_reach_where_the_density_itself_is_zero():
    model = AmplitudeModel(0.0, 80.0, 0.1)
    found = model.log_density(np.array([100.0, -100.0]), 1000.0)
    assert np.isfinite(found).all()
    assert (found < -100_000.0).all()


@settings(max_examples=50)
@given(MODELS, RANGES_M)
def test_the_amplitude_density_is_normalised_over_the_reading(model, r):
    low, high = model.low / r - 12.0 * model.sd, model.high / r + 12.0 * model.sd
    assert integral(lambda z: model.log_density(z, r), low, high, 2.0 * model.sd) == pytest.approx(1.0, abs=1e-9)


def test_ranges_below_the_least_count_as_the_least():
    model = AmplitudeModel(least_range_m=0.5)
    assert model.log_density(3.0, 0.0) == model.log_density(3.0, 0.5)
    assert np.isfinite(model.log_density(3.0, 0.0))


def test_the_range_of_greatest_likelihood_is_where_the_loudest_source_would_be():
    """Fig. 3: inside a crater the likelihood grows with the range, outside it falls off within the noise."""
    model, r = AmplitudeModel(0.0, 80.0, 0.1), np.arange(1.0, 400.0)
    z = 1.0
    top = r[np.argmax(model.log_density(z, r))]
    assert 60.0 < top < model.high / z
    np.testing.assert_allclose(
        np.exp(model.log_density(z, np.array([10.0, 20.0]))), [10.0 / 80.0, 20.0 / 80.0], rtol=1e-6
    )


def test_the_spread_of_figure_6():
    model = BearingModel()
    ranges_m = [0.0, 10.0, 20.0, 50.0, 100.0, 120.0]
    np.testing.assert_allclose(np.degrees(model.spread_rad(ranges_m)), [45.0, 27.5, 10.0, 10.0, 10.0, 20.0])


@settings(max_examples=50)
@given(BEARING_MODELS, RANGES_M, st.floats(-math.pi, math.pi))
def test_the_bearing_density_is_normalised_over_the_circle(model, r, true):
    density = lambda z: model.log_density(z, true, r)  # noqa: E731
    assert integral(density, true - math.pi, true + math.pi, 0.05) == pytest.approx(1.0, abs=1e-9)


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.integers(-3, 3))
def test_the_bearing_density_knows_no_turns(z, true, turns):
    model = BearingModel()
    once, again = (float(model.log_density(value, true, 50.0)) for value in (z, z + turns * 2.0 * math.pi))
    assert again == pytest.approx(once, abs=1e-6)


@given(st.floats(-100.0, 100.0))
def test_wrapped_angles(angle):
    found = float(wrapped_rad(angle))
    assert -math.pi <= found < math.pi
    assert math.cos(found) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(found) == pytest.approx(math.sin(angle), abs=1e-9)


def test_bearings_are_from_north_clockwise():
    compass = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, -2.0], [-3.0, 0.0], [1.0, 1.0]])
    np.testing.assert_allclose(np.degrees(bearing_rad(compass)), [0.0, 90.0, 180.0, -90.0, 45.0])


def test_a_sensor_s_likelihood_is_that_of_its_model_at_each_point():
    points = np.array([[10.0, 0.0], [0.0, 30.0], [-40.0, -30.0]])
    amplitude, bearing = AmplitudeModel(), BearingModel()
    found = SensorSpec((0.0, 0.0), amplitude).log_likelihood(1.3, points)
    np.testing.assert_allclose(found, amplitude.log_density(1.3, np.array([10.0, 30.0, 50.0])))
    found = SensorSpec((0.0, 0.0), bearing).log_likelihood(0.2, points)
    true = np.array([math.pi / 2.0, 0.0, -math.pi + math.atan2(40.0, 30.0)])
    np.testing.assert_allclose(found, bearing.log_density(0.2, true, np.array([10.0, 30.0, 50.0])))


@pytest.mark.parametrize("model", [AmplitudeModel(), BearingModel()])
def test_no_reading_says_nothing(model):
    points = np.array([[1.0, 2.0], [100.0, 3.0]])
    assert SensorSpec((0.0, 0.0), model).log_likelihood(math.nan, points).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("model", [AmplitudeModel(), BearingModel()])
def test_the_work_of_a_likelihood_goes_with_the_points(model):
    spec = SensorSpec((0.0, 0.0), model)
    assert spec.likelihood_operations(100) == 100 * spec.likelihood_operations(1) > 100 * model.density_operations
