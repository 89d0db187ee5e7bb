"""Rules of selection: each against its definition by brute force, and the laws they must keep."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_beliefs import FIELD, INSIDE_M, compact, mixtures, scattered

from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec
from netsim.kernels.expected_covariance import expected_variance_m2, posterior_variance_m2, variance_operations
from netsim.kernels.grid_belief import GridBelief, condition, from_dense
from netsim.kernels.handoff_cost import HandoffCost, weighed_j
from netsim.kernels.information import information_bit, reading_table
from netsim.kernels.selection import best, choosing_operations, utilities

AMPLITUDE, BEARING = AmplitudeModel(), BearingModel()
EITHER = pytest.mark.parametrize("model", [AMPLITUDE, BEARING], ids=["amplitude", "bearing"])
RNG = np.random.default_rng(0)


def around(belief: GridBelief, count: int = 6, seed: int = 0) -> dict[int, SensorSpec]:
    """Sensors of both kinds within 40 m of a belief's mean, numbered from 10 in steps of 3."""
    rng = np.random.default_rng(seed)
    places_m = belief.mean_m + rng.uniform(-40.0, 40.0, (count, 2))
    models = [AMPLITUDE if rng.random() < 0.6 else BEARING for _ in range(count)]
    return {
        10 + 3 * k: SensorSpec((float(x), float(y)), model)
        for k, ((x, y), model) in enumerate(zip(places_m, models, strict=True))
    }


def variance_by_hand_m2(belief: GridBelief, row, conditional) -> float:
    """The posterior of every reading, its trace, and their mean."""
    total = 0.0
    for column in conditional.T:
        joint = belief.probability * column[row]
        if joint.sum() > 0.0:
            total += joint.sum() * GridBelief(belief.grid, belief.cells, joint / joint.sum()).variance_m2
    return total


@EITHER
@pytest.mark.parametrize("exact", [False, True])
@settings(max_examples=15, deadline=None)
@given(belief=scattered(), place_m=st.tuples(st.floats(-20, 40), st.floats(-20, 40)))
def test_the_expected_variance_is_the_mean_over_all_posteriors(model, exact, belief, place_m):
    sensor = SensorSpec(place_m, model)
    table = reading_table(belief, sensor, exact=exact)
    by_hand = variance_by_hand_m2(belief, table.row, table.conditional)
    assert expected_variance_m2(belief, sensor, exact=exact) == pytest.approx(by_hand, rel=1e-8, abs=1e-8)


@settings(max_examples=50, deadline=None)
@given(
    belief=scattered(),
    weights=st.lists(st.lists(st.floats(0.001, 1.0), min_size=4, max_size=4), min_size=20, max_size=20),
)
def test_the_law_of_total_variance_holds_for_any_table(belief, weights):
    rows = np.array(weights)
    conditional = rows / rows.sum(axis=1, keepdims=True)
    row = np.arange(len(belief.cells))
    found = posterior_variance_m2(belief, row, conditional)
    assert found == pytest.approx(variance_by_hand_m2(belief, row, conditional), rel=1e-8, abs=1e-8)


@EITHER
@settings(max_examples=20, deadline=None)
@given(belief=mixtures(), place_m=INSIDE_M)
def test_the_expected_variance_lies_between_nothing_and_the_present_one(model, belief, place_m):
    assert 0.0 <= expected_variance_m2(belief, SensorSpec(place_m, model)) <= belief.variance_m2


def test_no_gain_from_a_sensor_that_hears_only_noise():
    """Amplitudes under noise of 10^6 tell nothing, nor does a bearing that is anywhere."""
    belief = compact((80.0, 120.0), 12.0)
    deaf = AmplitudeModel(sd=1e6), BearingModel(sd_rad=1e4, sd_at_zero_rad=1e4, growth_rad_per_m=0.0)
    for model in deaf:
        sensor = SensorSpec((70.0, 110.0), model)
        assert expected_variance_m2(belief, sensor) == pytest.approx(belief.variance_m2, rel=1e-6)
        assert information_bit(belief, sensor) == pytest.approx(0.0, abs=1e-6)


def test_a_reading_of_which_the_place_follows_leaves_no_variance():
    belief = GridBelief(FIELD, np.array([3, 400, 911]), np.array([0.2, 0.5, 0.3]))
    assert posterior_variance_m2(belief, np.arange(3), np.eye(3)) == pytest.approx(0.0, abs=1e-9 * belief.variance_m2)
    one_cell = GridBelief(FIELD, np.array([17]), np.array([1.0]))
    assert expected_variance_m2(one_cell, SensorSpec((3.0, 4.0), AMPLITUDE)) == 0.0


@EITHER
def test_readings_drawn_at_random_leave_the_expected_variance(model):
    """The mean of 4000 posteriors' variances, within four standard errors of it."""
    belief, sensor = compact((80.0, 120.0), 9.0), SensorSpec((70.0, 110.0), model)
    rng = np.random.default_rng(5)
    left = []
    for cell in rng.choice(len(belief.cells), 4000, p=belief.probability):
        offset_m = belief.centres_m[cell] - sensor.position_m
        range_m = max(float(np.hypot(*offset_m)), 0.5)
        if model is AMPLITUDE:
            reading = rng.uniform(model.low, model.high) / range_m + model.sd * rng.standard_normal()
        else:
            reading = math.atan2(*offset_m) + float(model.spread_rad(range_m)) * rng.standard_normal()
        left.append(condition(belief, sensor.log_likelihood(reading, belief.centres_m))[0].variance_m2)
    error = np.std(left) / math.sqrt(len(left))
    assert abs(np.mean(left) - expected_variance_m2(belief, sensor, exact=True)) < 4 * error


@pytest.mark.parametrize("seed", range(5))
def test_information_and_covariance_choose_as_brute_force_does(seed):
    belief = compact((60.0 + 5 * seed, 120.0), 8.0)
    sensors = around(belief, seed=seed)
    for rule in ("mutual_information", "all"):
        bits = utilities(rule, belief, sensors, RNG, exact=True)
        assert bits == {node: information_bit(belief, spec, exact=True) for node, spec in sensors.items()}
        assert all(bits[best(bits)] >= each for each in bits.values())
    left = utilities("covariance", belief, sensors, RNG, exact=True)
    for node, spec in sensors.items():
        table = reading_table(belief, spec, exact=True)
        assert -left[node] == pytest.approx(variance_by_hand_m2(belief, table.row, table.conditional), rel=1e-9)
    assert best(left) == min(sensors, key=lambda node: (-left[node], node))


def test_the_two_rules_do_not_always_agree():
    """A belief of two far parts: less entropy is not less variance."""
    differ = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        weights = np.zeros((FIELD.rows, FIELD.columns))
        for _ in range(2):
            row, column = rng.integers(3, FIELD.rows - 3), rng.integers(3, FIELD.columns - 3)
            weights[row - 2 : row + 3, column - 2 : column + 3] = rng.uniform(0.1, 1.0)
        belief = from_dense(FIELD, weights)
        sensors = around(belief, seed=seed)
        rules = ("mutual_information", "covariance")
        differ += len({best(utilities(rule, belief, sensors, RNG)) for rule in rules}) > 1
    assert 0 < differ < 20


def test_nearest_is_nearest_to_the_mean():
    belief = compact((80.0, 120.0), 8.0)
    sensors = around(belief)
    worth = utilities("nearest", belief, sensors, RNG)
    assert best(worth) == min(sensors, key=lambda node: math.dist(sensors[node].position_m, belief.mean_m))


def test_random_chooses_every_candidate_alike():
    """2000 choices among 5: chi-squared with 4 degrees of freedom is below 18.5 with probability 0.999."""
    belief = compact((80.0, 120.0), 8.0)
    sensors = around(belief, 5)
    rng = np.random.default_rng(3)
    counts = Counter(best(utilities("random", belief, sensors, rng)) for _ in range(2000))
    assert sum((counts[node] - 400) ** 2 / 400 for node in sensors) < 18.5


@pytest.mark.parametrize("rule", ["mutual_information", "covariance", "information_per_joule", "nearest", "all"])
def test_ties_go_to_the_lowest_node(rule):
    belief = compact((80.0, 120.0), 8.0)
    spec = SensorSpec((70.0, 110.0), AMPLITUDE)
    sensors = {9: spec, 4: spec, 7: spec}
    assert best(utilities(rule, belief, sensors, RNG, costs=dict.fromkeys(sensors, 2.0))) == 4


def test_bits_are_weighed_against_joules():
    belief = compact((80.0, 120.0), 8.0)
    sensors = around(belief)
    bits = utilities("mutual_information", belief, sensors, RNG)
    costs = {node: 1e-3 * (1 + k) for k, node in enumerate(sensors)}
    less = utilities("information_less_cost", belief, sensors, RNG, costs=costs, bit_per_joule=50.0)
    per = utilities("information_per_joule", belief, sensors, RNG, costs=costs)
    for node in sensors:
        assert less[node] == pytest.approx(bits[node] - 50.0 * costs[node], rel=1e-12)
        assert per[node] == pytest.approx(bits[node] / costs[node], rel=1e-12)
    free = utilities("information_less_cost", belief, sensors, RNG, costs=costs, bit_per_joule=0.0)
    assert free == bits
    dear = utilities("information_less_cost", belief, sensors, RNG, costs=costs, bit_per_joule=1e9)
    assert best(dear) == min(sensors)


def test_a_node_whose_energy_is_short_is_spared():
    """Of two equal sensors the one with less energy left is left out; one not heard of counts as full."""
    belief = compact((80.0, 120.0), 8.0)
    spec = SensorSpec((70.0, 110.0), AMPLITUDE)
    sensors, costs = {1: spec, 2: spec}, {1: 4e-3, 2: 4e-3}
    for rule in ("information_less_cost", "information_per_joule"):
        worth = lambda left: utilities(rule, belief, sensors, RNG, costs=costs, energy_left=left)  # noqa: B023, E731
        assert best(worth({1: 0.5})) == 2
        assert best(worth({1: 0.5, 2: 0.4})) == 1
        assert worth({1: 1.0, 2: 1.0}) == worth({}) == worth(None)
    assert best(utilities("mutual_information", belief, sensors, RNG, costs=costs, energy_left={1: 0.0})) == 1


def test_a_rule_with_a_cost_says_what_it_lacks():
    belief = compact((80.0, 120.0), 8.0)
    sensors = around(belief, 2)
    for costs in (None, {10: 1.0}, {10: 1.0, 13: 0.0}):
        with pytest.raises(ValueError, match=r"joules of the hand-off to each of the nodes \[10, 13\]"):
            utilities("information_per_joule", belief, sensors, RNG, costs=costs)


@given(st.integers(1, 5000), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_handoff_costs_more_on_a_worse_link_and_for_more_bytes(payload_byte, worse, better):
    worse, better = sorted((worse, better))
    cost = HandoffCost(3.5e-6)
    assert cost.joules(payload_byte, worse) >= cost.joules(payload_byte, better) > 0.0
    assert cost.joules(payload_byte + 1, better) > cost.joules(payload_byte, better)


def test_a_handoff_costs_its_frames():
    """210 bytes are three frames of at most 104: 210 + 3 * 40 bytes on the air, twice at a reception ratio of a half."""
    assert HandoffCost(2e-6).joules(210, 0.5) == pytest.approx(2e-6 * (210 + 120) * 2)
    assert HandoffCost(2e-6).joules(210, 0.0) == pytest.approx(2e-6 * (210 + 120) * 10)
    assert weighed_j({1: 2.0, 2: 2.0, 3: 2.0}, {1: 0.25, 2: 0.0}) == {1: 8.0, 2: 2.0 * 255, 3: 2.0}


def test_operations_grow_with_the_work():
    belief = compact((80.0, 120.0), 8.0)
    sensors = around(belief)
    spec = sensors[10]
    assert choosing_operations("nearest", belief, sensors) < 1000
    assert choosing_operations("covariance", belief, sensors) == sum(
        variance_operations(belief, each) for each in sensors.values()
    )
    assert variance_operations(belief, spec, exact=True) > variance_operations(belief, spec)
    wider = compact((80.0, 120.0), 25.0)
    assert variance_operations(wider, spec) > variance_operations(belief, spec)
