"""What readings tell of classes, and so of targets."""

import numpy as np
import pytest

from netsim.kernels.identity import even, evidence, mix, unmixed
from netsim.kernels.signatures import VEHICLES, Classifier, SpectrumModel
from netsim.kernels.vehicle_labels import VehicleLabels, classes_of, label_probabilities


def test_classes_are_numbered_alike_whatever_the_order():
    assert classes_of(["truck", "car", "truck"]) == (("car", "truck"), (1, 0, 1))


def test_a_label_leaves_the_rest_to_the_other_classes():
    np.testing.assert_allclose(label_probabilities(1, 3, 0.94), [0.03, 0.94, 0.03])
    np.testing.assert_allclose(label_probabilities(0, 1, 0.94), [0.94])


def test_without_a_label_nothing_is_told():
    labels = VehicleLabels((0, 1))
    assert labels.likelihood(np.zeros(2), 0.8) is None
    assert labels.likelihood(np.array([0.7, 0.3]), 0.8) is None
    np.testing.assert_array_equal(labels.likelihood(np.array([0.06, 0.94]), 0.8), [0.06, 0.94])


def test_targets_of_one_class_cannot_be_told_apart():
    likelihood = VehicleLabels((0, 0, 1)).likelihood(np.array([0.94, 0.06]), 0.8)
    mixed = mix(unmixed(3), (0, 1, 2), even(3))
    row = evidence(mixed, 0, likelihood)[0]
    np.testing.assert_allclose(row, np.array([0.94, 0.94, 0.06]) / 1.94, atol=1e-12)


@pytest.fixture(scope="module")
def heard():
    model, names = SpectrumModel(), ("car", "truck")
    rng = np.random.default_rng(1)
    sounds = [VEHICLES[name] for name in names]
    classifier = Classifier.trained(*model.examples(sounds, 400, (3.0, 48.0), rng), 10)
    return VehicleLabels((0, 1), classifier, 0.01), model, sounds, rng


def test_a_sound_alone_is_told(heard):
    labels, model, sounds, rng = heard
    told = [labels.likelihood(model.spectrum([(sounds[1], 40.0)], rng), 0.8) for _ in range(40)]
    sure = [each for each in told if each is not None]
    assert len(sure) > 35
    assert np.mean([each[1] > each[0] for each in sure]) > 0.95
    assert min(each.min() for each in sure) >= 0.005 - 1e-12  # a hundredth of the sounds may be anybody's


def test_two_sounds_at_once_tell_less(heard):
    """Near targets mix, and confidence falls."""
    labels, model, sounds, rng = heard
    alone = [labels.likelihood(model.spectrum([(sounds[0], 30.0)], rng), 0.8) for _ in range(60)]
    both = [labels.likelihood(model.spectrum([(sounds[0], 30.0), (sounds[1], 30.0)], rng), 0.8) for _ in range(60)]
    assert sum(each is None for each in both) > 2 * sum(each is None for each in alone) + 10


def test_work_is_that_of_the_classifier(heard):
    labels = heard[0]
    assert labels.operations() > labels.classifier.operations() > VehicleLabels((0, 1)).operations() > 0
