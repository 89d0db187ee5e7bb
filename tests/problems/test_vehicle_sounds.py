"""What sensors read besides the energy: spectra and labels."""

import numpy as np
import pytest

from netsim.errors import ScenarioError
from netsim.models.tracks import StraightTrack
from netsim.problems.energy_tracking import EnergyTarget, EnergyTrackingParameters, build
from netsim.problems.vehicle_sounds import LabelParameters
from netsim.rng import Streams
from netsim.scenario.load import load

SENSORS_M = {0: (0.0, 0.0), 1: (200.0, 0.0), 2: (400.0, 0.0)}
BOX = (0.0, -50.0, 400.0, 50.0)
S = 1_000_000_000


def target(x_m, vehicle=None):
    track = StraightTrack(type="straight", from_m=(x_m, 10.0), to_m=(x_m + 1.0, 10.0), speed_m_per_s=0.0005)
    return EnergyTarget(track=track, vehicle=vehicle)


def problem_of(tmp_path, *vehicles, seed=1, **parameters):
    targets = tuple(target(200.0 * number, vehicle) for number, vehicle in enumerate(vehicles))
    return build(EnergyTrackingParameters(targets=targets, **parameters), SENSORS_M, BOX, Streams(seed), tmp_path)


def test_without_either_nothing_changes(tmp_path):
    plain = problem_of(tmp_path, "car", "truck")
    assert plain.observe(0, S).shape == (1,)
    assert plain.knowledge(0).labels is None
    more = problem_of(tmp_path, "car", "truck", spectrum_bins=32)
    assert more.observe(0, S).shape == (33,)
    assert more.observe(0, S)[0] == plain.observe(0, S)[0]


def test_a_reading_is_the_same_whoever_asks_and_how_often(tmp_path):
    one, other = (problem_of(tmp_path, "car", "truck", spectrum_bins=32) for _ in range(2))
    np.testing.assert_array_equal(one.observe(0, S), other.observe(0, S))
    np.testing.assert_allclose(one.observe(0, S), one.observe(0, S + 7))
    assert (one.observe(0, S) != one.observe(0, 2 * S)).any()


def test_the_classifier_knows_the_nearest_vehicle(tmp_path):
    problem = problem_of(tmp_path, "truck", "car", spectrum_bins=64)
    labels = problem.knowledge(0).labels
    for node, right in ((0, 0), (1, 1)):
        told = [labels.likelihood(problem.observe(node, step * S)[1:], 0.8) for step in range(40)]
        sure = [int(np.argmax(each)) for each in told if each is not None]
        assert len(sure) > 20
        assert np.mean(np.array(sure) == right) > 0.9


def test_labels_are_as_frequent_and_as_right_as_stated(tmp_path):
    problem = problem_of(tmp_path, None, None, labels=LabelParameters(accuracy=0.9, rate_per_s=0.5))
    steps = 1000  # the targets are there for twice as long
    told = np.array([problem.observe(0, step * S)[1:] for step in range(steps)])
    given = told[told.any(axis=1)]
    assert abs(len(given) - 0.5 * steps) < 4.0 * np.sqrt(0.25 * steps)
    right = (given[:, 0] > given[:, 1]).sum()
    assert abs(right - 0.9 * len(given)) < 4.0 * np.sqrt(0.09 * len(given))
    np.testing.assert_allclose(np.sort(given, axis=1), [[0.1, 0.9]] * len(given))


def test_no_label_of_a_target_out_of_range(tmp_path):
    problem = problem_of(tmp_path, None, None, labels=LabelParameters(rate_per_s=1.0))
    assert problem.observe(1, S)[1:].any()
    assert not problem.observe(2, S)[1:].any()


def test_vehicles_of_one_class_share_a_label(tmp_path):
    problem = problem_of(tmp_path, "car", "car", labels=LabelParameters(rate_per_s=1.0))
    assert problem.knowledge(0).labels.class_of == (0, 0)
    assert problem.observe(0, S).shape == (2,)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["problem.spectrum_bins=32", "problem.labels={accuracy: 0.9}"], "either spectrum_bins or labels"),
        (["problem.spectrum_bins=8"], "spectrum_bins of 0, or 16 or more"),
    ],
)
def test_what_cannot_be_is_told(scenarios, settings, told):
    with pytest.raises(ScenarioError, match=told):
        load(scenarios / "liu2004" / "identity.yaml", settings)


def test_a_spectrum_needs_vehicles(scenarios):
    with pytest.raises(ScenarioError, match="a vehicle for every target"):
        load(scenarios / "liu2004" / "crossing.yaml", ["problem.spectrum_bins=32"])
