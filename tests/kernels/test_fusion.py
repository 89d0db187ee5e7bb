"""Fusion of all readings of an instant, against one reading after the other and against the sum over all cells."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_beliefs import FIELD, compact, scattered

from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec
from netsim.kernels.fusion import centralised, fused, fusion_operations, joint_log_likelihood
from netsim.kernels.grid_belief import condition, uniform
from netsim.kernels.idsq import Filter

SENSORS = {
    7: SensorSpec((10.0, 12.0), AmplitudeModel()),
    2: SensorSpec((-4.0, 20.0), BearingModel()),
    5: SensorSpec((22.0, 3.0), AmplitudeModel()),
}
READINGS = {7: 3.1, 2: 1.2, 5: 2.2}
NEAR = {
    1: SensorSpec((30.0, 52.0), AmplitudeModel()),
    2: SensorSpec((52.0, 45.0), BearingModel()),
    3: SensorSpec((55.0, 70.0), AmplitudeModel()),
}


@settings(max_examples=30, deadline=None)
@given(belief=scattered(), amplitude=st.floats(0.5, 6.0), bearing=st.floats(-3.0, 3.0))
def test_at_once_is_one_after_the_other_in_any_order(belief, amplitude, bearing):
    readings = {7: amplitude, 2: bearing, 5: 2.2}
    at_once = fused(belief, SENSORS, readings, 0.0)
    for order in ((7, 2, 5), (5, 7, 2)):
        after = belief
        for node in order:
            after, _ = condition(after, SENSORS[node].log_likelihood(readings[node], after.centres_m))
        there = np.zeros(belief.grid.size)
        there[after.cells] = after.probability
        np.testing.assert_allclose(there[at_once.cells], at_once.probability, rtol=1e-9, atol=1e-12)


def test_the_last_bit_does_not_depend_on_who_came_first():
    points_m = uniform(FIELD).centres_m
    readings = dict(reversed(READINGS.items()))
    once, again = (joint_log_likelihood(SENSORS, each, points_m) for each in (READINGS, readings))
    np.testing.assert_array_equal(once, again)


def test_no_reading_changes_nothing():
    belief = compact((40.0, 60.0), 9.0)
    after = fused(belief, SENSORS, {}, 0.0)
    np.testing.assert_array_equal(after.cells, belief.cells)
    np.testing.assert_allclose(after.probability, belief.probability, rtol=1e-12)


def test_the_error_is_what_the_belief_says():
    """Places and readings drawn from the prior and the model: the mean squared error is the mean variance (4 deviations)."""
    prior, rng = compact((40.0, 60.0), 9.0), np.random.default_rng(4)
    differences_m2 = []
    for cell in rng.choice(len(prior.cells), 400, p=prior.probability):
        readings = {node: _drawn(spec, prior.centres_m[cell], rng) for node, spec in NEAR.items()}
        after = fused(prior, NEAR, readings, 0.0)
        differences_m2.append(float(((after.mean_m - prior.centres_m[cell]) ** 2).sum()) - after.variance_m2)
    assert abs(np.mean(differences_m2)) < 4 * np.std(differences_m2) / np.sqrt(len(differences_m2))


def _drawn(spec, place_m, rng):
    offset_m = place_m - np.asarray(spec.position_m)
    range_m = max(float(np.hypot(*offset_m)), 0.5)
    if spec.measures_bearing:
        return float(np.arctan2(*offset_m)) + float(spec.model.spread_rad(range_m)) * rng.standard_normal()
    return rng.uniform(spec.model.low, spec.model.high) / range_m + spec.model.sd * rng.standard_normal()


def test_a_centre_that_hears_nothing_only_predicts():
    beliefs = list(centralised(FIELD, SENSORS, iter([READINGS, {}]), Filter(7.5, 0.0)))
    expected = Filter(7.5, 0.0).predicted(beliefs[0], 1)
    np.testing.assert_array_equal(beliefs[1].cells, expected.cells)
    np.testing.assert_allclose(beliefs[1].probability, expected.probability, rtol=1e-12)


def test_work_grows_with_sensors_and_with_cells():
    small, large = compact((40.0, 60.0), 5.0), compact((40.0, 60.0), 15.0)
    assert fusion_operations(small, SENSORS, READINGS) < fusion_operations(large, SENSORS, READINGS)
    assert fusion_operations(small, SENSORS, {7: 1.0}) < fusion_operations(small, SENSORS, READINGS)
