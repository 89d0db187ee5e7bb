"""Mutual information of a reading and a position: laws, quadrature, and how good the reductions of section 4.3 are."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import xlogy
from tracking_beliefs import FIELD, INSIDE_M, compact, mixtures

from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec, bearing_rad
from netsim.kernels.grid_belief import GridBelief, from_dense
from netsim.kernels.information import information_bit, information_operations, mutual_information_bit

AMPLITUDE, BEARING = AmplitudeModel(), BearingModel()
EITHER = pytest.mark.parametrize("model", [AMPLITUDE, BEARING], ids=["amplitude", "bearing"])
BOTH_FORMS = pytest.mark.parametrize("exact", [False, True], ids=["reduced", "exact"])


def fine_information_bit(belief, sensor):
    """Table 3 with a reading that is cut into far finer cells than the product's, of equal width."""
    offsets_m = belief.centres_m - np.asarray(sensor.position_m)
    ranges_m = np.hypot(*offsets_m.T)
    if isinstance(sensor.model, BearingModel):
        width = 2.0 * math.pi / 7200
        readings = -math.pi + width * (np.arange(7200) + 0.5)
        rows = sensor.model.log_density(readings[None, :], bearing_rad(offsets_m)[:, None], ranges_m[:, None])
    else:
        width = sensor.model.sd / 15.0
        top = sensor.model.high / max(ranges_m.min(), sensor.model.least_range_m) + 8.0 * sensor.model.sd
        readings = np.arange(-8.0 * sensor.model.sd, top, width)
        rows = sensor.model.log_density(readings[None, :], ranges_m[:, None])
    cells = np.exp(rows) * width
    marginal = belief.probability @ cells
    return float(
        (belief.probability @ xlogy(cells, cells).sum(axis=1) - xlogy(marginal, marginal).sum()) / math.log(2.0)
    )


def few_cells(seed, count=12):
    """A belief of a few cells anywhere."""
    rng = np.random.default_rng(seed)
    cells = np.sort(rng.choice(FIELD.size, count, replace=False))
    return GridBelief(FIELD, cells, rng.dirichlet(np.ones(count)))


@EITHER
@pytest.mark.parametrize("seed", range(4))
def test_the_exact_form_is_that_of_a_much_finer_reading(model, seed):
    belief = few_cells(seed)
    sensor = SensorSpec((70.0, 120.0), model)
    assert information_bit(belief, sensor, exact=True) == pytest.approx(fine_information_bit(belief, sensor), abs=5e-4)


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("sd_deg", [0.3, 0.5])
def test_bearings_more_precise_than_a_degree_tell_as_much_as_they_do(sd_deg, exact):
    belief, sensor = compact((90.0, 150.0), 6.0), SensorSpec((70.0, 120.0), BearingModel(sd_rad=math.radians(sd_deg)))
    expected = fine_information_bit(belief, sensor)
    assert information_bit(belief, sensor, exact=exact) == pytest.approx(expected, abs=0.005 if exact else 0.05)


def test_readings_that_fall_between_the_middles_of_the_bins_are_a_distribution_still():
    """A hundredth of a degree: twelve cells anywhere are told apart."""
    sd_rad = math.radians(0.01)
    model = BearingModel(sd_rad=sd_rad, sd_at_zero_rad=sd_rad, growth_rad_per_m=0.0)
    belief, sensor = few_cells(0), SensorSpec((70.0, 120.0), model)
    assert information_bit(belief, sensor, exact=True) == pytest.approx(belief.entropy_bit, rel=1e-6)


@EITHER
def test_the_exact_form_is_that_of_a_much_finer_reading_for_a_belief_close_by(model):
    belief, sensor = compact((71.0, 122.0), 6.0), SensorSpec((70.0, 120.0), model)
    assert information_bit(belief, sensor, exact=True) == pytest.approx(fine_information_bit(belief, sensor), abs=5e-4)


@EITHER
@BOTH_FORMS
@settings(max_examples=10, deadline=None)
@given(belief=mixtures(), place_m=INSIDE_M)
def test_information_is_neither_negative_nor_more_than_the_belief_s_entropy(model, exact, belief, place_m):
    bits = information_bit(belief, SensorSpec(place_m, model), exact=exact)
    assert 0.0 <= bits <= belief.entropy_bit + 1e-9


@EITHER
@BOTH_FORMS
@given(place_m=INSIDE_M, cell=st.integers(0, FIELD.size - 1))
def test_who_knows_the_place_learns_nothing(model, exact, place_m, cell):
    belief = GridBelief(FIELD, np.array([cell]), np.array([1.0]))
    assert information_bit(belief, SensorSpec(place_m, model), exact=exact) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    "model", [AmplitudeModel(sd=1e7), BearingModel(1e4, sd_at_zero_rad=1e4)], ids=["amplitude", "bearing"]
)
@BOTH_FORMS
@settings(max_examples=10, deadline=None)
@given(belief=mixtures(), place_m=INSIDE_M)
def test_endless_noise_tells_nothing(model, exact, belief, place_m):
    assert information_bit(belief, SensorSpec(place_m, model), exact=exact) == pytest.approx(0.0, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(mixtures(), INSIDE_M)
def test_the_range_stands_for_the_position_before_an_amplitude(belief, place_m):
    """Eq 19, with ranges in bins of 1 m and less."""
    sensor = SensorSpec(place_m, AMPLITUDE)
    assert abs(information_bit(belief, sensor) - information_bit(belief, sensor, exact=True)) <= 0.02


def test_the_bearing_stands_for_the_position_of_a_compact_belief_nearby():
    """Only nearly, since the spread depends on the range; drawn places, so that the mean has a meaning."""
    rng, errors_bit = np.random.default_rng(11), []
    for _ in range(60):
        centre_m, angle, range_m = (
            rng.uniform((0.0, 0.0), (150.0, 250.0)),
            rng.uniform(0.0, 2.0 * math.pi),
            rng.uniform(0, 60),
        )
        place_m = centre_m + range_m * np.array([math.sin(angle), math.cos(angle)])
        sensor, belief = SensorSpec(tuple(place_m), BEARING), compact(tuple(centre_m), rng.uniform(4.0, 15.0))
        errors_bit.append(information_bit(belief, sensor) - information_bit(belief, sensor, exact=True))
    assert np.abs(errors_bit).max() < 0.1
    assert np.sqrt(np.mean(np.square(errors_bit))) < 0.01


@settings(max_examples=15, deadline=None)
@given(mixtures(), INSIDE_M)
def test_the_reduced_bearing_form_hardly_ever_promises_more_than_there_is(belief, place_m):
    sensor = SensorSpec(place_m, BEARING)
    assert information_bit(belief, sensor) <= information_bit(belief, sensor, exact=True) + 0.03


def test_what_the_spread_tells_of_the_range_is_lost_without_the_range():
    """Two places in one direction, one near and one beyond the far range: the reduced form sees one bearing."""
    cells = np.sort([FIELD.cell_of((75.0, 40.0)), FIELD.cell_of((75.0, 240.0))])
    belief = GridBelief(FIELD, cells, np.array([0.5, 0.5]))
    sensor = SensorSpec(FIELD.centres_m(np.array([FIELD.cell_of((75.0, 5.0))]))[0], BEARING)
    assert information_bit(belief, sensor) == pytest.approx(0.0, abs=1e-9)
    assert information_bit(belief, sensor, exact=True) > 0.3


def test_the_closer_sensor_tells_more_of_an_even_belief():
    belief = compact((75.0, 125.0), 15.0)
    for model in (AMPLITUDE, BEARING):
        bits = [information_bit(belief, SensorSpec((75.0 + range_m, 125.0), model)) for range_m in (30.0, 60.0, 120.0)]
        assert bits == sorted(bits, reverse=True)


def test_a_noiseless_channel_tells_all_and_a_useless_one_nothing():
    prior = np.array([0.5, 0.25, 0.25])
    assert mutual_information_bit(prior, np.eye(3)) == pytest.approx(1.5)
    assert mutual_information_bit(prior, np.full((3, 4), 0.25)) == 0.0


def test_a_mirrored_world_tells_as_much():
    weights = np.random.default_rng(3).random((FIELD.rows, FIELD.columns))
    belief = from_dense(FIELD, weights)
    mirrored = from_dense(FIELD, weights[:, ::-1])
    for model in (AMPLITUDE, BEARING):
        here = information_bit(belief, SensorSpec((40.0, 100.0), model), exact=True)
        there = information_bit(mirrored, SensorSpec((110.0, 100.0), model), exact=True)
        assert there == pytest.approx(here, abs=1e-9)


def test_the_reductions_save_work():
    belief = compact((75.0, 125.0), 20.0)
    for model, share in ((AMPLITUDE, 0.01), (BEARING, 0.8)):
        sensor = SensorSpec((60.0, 100.0), model)
        reduced, exact = (information_operations(belief, sensor, exact=exact) for exact in (False, True))
        assert 0 < reduced < share * exact
