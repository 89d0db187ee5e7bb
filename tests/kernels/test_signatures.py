"""Sound signatures: powers that add up, classes told apart, and sounds of no class that speak for none."""

import math
from functools import cache

import numpy as np
import pytest

from netsim.kernels.signatures import (
    VEHICLES,
    Classifier,
    SpectrumModel,
    VehicleSound,
    confident,
    identity_likelihood,
    log_shape,
)

MODEL = SpectrumModel()
SOUNDS = list(VEHICLES.values())
POWERS = (0.3, 100.0)


@cache
def classifier() -> Classifier:
    spectra, labels = MODEL.examples(SOUNDS, 600, POWERS, np.random.default_rng(1))
    return Classifier.trained(spectra, labels, components=8)


def told(spectra) -> np.ndarray:
    return np.stack([classifier().probabilities(spectrum) for spectrum in spectra])


def test_a_sound_has_its_power_in_lines_at_multiples_of_its_rate():
    sound = VehicleSound(40.0, (0.75, 0.25))
    power = MODEL.mean(sound)
    assert power.sum() == pytest.approx(1.0, abs=0.01)
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] > power[2:])) + 1
    assert MODEL.frequencies_hz[peaks].tolist() == [40.0, 80.0]
    assert power[peaks[0]] / power[peaks[1]] == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize("sound", SOUNDS)
def test_shares_of_power_sum_to_one(sound):
    assert sum(sound.harmonics) == pytest.approx(1.0)
    drawn = sound.drawn(np.random.default_rng(2))
    assert sum(drawn.harmonics) == pytest.approx(1.0)
    assert drawn.base_hz != sound.base_hz


def test_sounds_add_up_in_power_and_scatter_as_averaged_periodograms_do():
    steady = [VehicleSound(60.0, (0.6, 0.4), 0.0, 0.0), VehicleSound(25.0, (1.0,), 0.0, 0.0)]
    rng = np.random.default_rng(3)
    measured = np.stack([MODEL.spectrum([(steady[0], 5.0), (steady[1], 2.0)], rng) for _ in range(2000)])
    expected = 1.0 / MODEL.bins + 5.0 * MODEL.mean(steady[0]) + 2.0 * MODEL.mean(steady[1])
    sd = 1.0 / math.sqrt(MODEL.windows)  # relative, of one bin
    np.testing.assert_allclose(measured.mean(axis=0) / expected, 1.0, atol=5 * sd / math.sqrt(2000))
    np.testing.assert_allclose(measured.std(axis=0) / expected, sd, rtol=0.12)


def test_features_do_not_depend_on_the_loudness_of_the_whole():
    spectrum = MODEL.spectrum([(SOUNDS[0], 3.0)], np.random.default_rng(4))
    np.testing.assert_allclose(log_shape(1e6 * spectrum), log_shape(spectrum), rtol=1e-12)


def test_clear_sounds_are_told_apart_with_confidence():
    spectra, labels = MODEL.examples(SOUNDS, 300, (3.0, 100.0), np.random.default_rng(5))
    found = told(spectra)
    assert (found.argmax(axis=1) == labels).mean() > 0.98
    assert np.mean([confident(one) == label for one, label in zip(found, labels, strict=True)]) > 0.95


def test_probabilities_sum_to_one_however_strange_the_sound():
    for spectrum in (np.ones(64), np.eye(64)[3] + 1e-12, np.geomspace(1e-300, 1e300, 64)):
        found = classifier().probabilities(spectrum)
        assert found.sum() == pytest.approx(1.0, abs=1e-12)
        assert (found > 0.0).all()


def test_two_sounds_at_once_and_none_are_seldom_taken_for_one():
    rng = np.random.default_rng(6)
    pairs = [(SOUNDS[a], SOUNDS[b]) for a, b in ((0, 1), (0, 2), (1, 2)) for _ in range(60)]
    mixed = told([MODEL.spectrum([(a, 10.0), (b, 10.0)], rng) for a, b in pairs])
    noise = told([MODEL.spectrum([], rng) for _ in range(100)])
    clear = told(MODEL.examples(SOUNDS, 180, (10.0, 10.0), rng)[0])
    shares = [np.mean([confident(one) is not None for one in found]) for found in (mixed, noise, clear)]
    assert shares[0] < 0.3
    assert shares[1] < 0.05
    assert shares[2] > 0.9
    np.testing.assert_allclose(noise, 1.0 / 3.0, atol=0.35)


def test_confidence_is_no_more_than_it_should_be():
    """Where it claims a probability, it is right at least as often, to within three standard errors."""
    spectra, labels = MODEL.examples(SOUNDS, 1500, POWERS, np.random.default_rng(7))
    found = told(spectra)
    right, claimed = found.argmax(axis=1) == labels, found.max(axis=1)
    for low, high in ((0.33, 0.6), (0.6, 0.8), (0.8, 0.95), (0.95, 1.001)):
        inside = (claimed >= low) & (claimed < high)
        error = math.sqrt(0.25 / max(1, inside.sum())) if low < 0.8 else 0.02
        assert right[inside].mean() > claimed[inside].mean() - 3 * error
    assert abs(right.mean() - claimed.mean()) < 0.08


def test_the_principal_components_are_those_of_the_covariance():
    spectra, labels = MODEL.examples(SOUNDS, 200, POWERS, np.random.default_rng(8))
    found = Classifier.trained(spectra, labels, 3)
    values, vectors = np.linalg.eigh(np.cov(log_shape(spectra).T))
    np.testing.assert_allclose(np.abs(found.axes @ vectors[:, ::-1][:, :3]), np.eye(3), atol=1e-6)
    assert values[-1] > values[-2]


def test_densities_are_normal_with_the_classes_pooled_covariance():
    """The ratio of two classes is that of linear discriminant analysis."""
    spectra, labels = MODEL.examples(SOUNDS, 200, POWERS, np.random.default_rng(9))
    found = Classifier.trained(spectra, labels, 4, unknown=0.0)
    points = (log_shape(spectra) - found.mean) @ found.axes.T
    pooled = sum((labels == c).sum() * np.cov(points[labels == c].T, bias=True) for c in range(3)) / (200 - 3)
    point = (log_shape(spectra[0]) - found.mean) @ found.axes.T
    away = [point - points[labels == c].mean(axis=0) for c in range(3)]
    logs = np.array([-0.5 * off @ np.linalg.solve(pooled, off) for off in away])
    np.testing.assert_allclose(np.diff(np.log(found.probabilities(spectra[0]))), np.diff(logs), rtol=1e-6)


def test_a_threshold_decides_what_is_told():
    assert confident(np.array([0.1, 0.85, 0.05])) == 1
    assert confident(np.array([0.1, 0.8, 0.1])) is None
    assert confident(np.array([0.1, 0.8, 0.1]), threshold=0.5) == 1


def test_targets_of_a_class_share_its_probability():
    np.testing.assert_array_equal(identity_likelihood(np.array([0.9, 0.1]), (1, 0, 0)), [0.1, 0.9, 0.9])
    np.testing.assert_allclose(identity_likelihood(np.array([1.0, 0.0]), (1, 0), mistaken=0.1), [0.05, 0.95])


@pytest.mark.parametrize(
    ("labels", "components", "match"),
    [([0, 0, 0, 0, 0, 0], 2, "two classes"), ([0, 0, 0, 0, 0, 1], 2, "two each"), ([0, 1] * 3, 4, "expected 1 to 3")],
)
def test_training_needs_examples(labels, components, match):
    spectra = np.random.default_rng(0).uniform(1.0, 2.0, (6, 10))
    with pytest.raises(ValueError, match=match):
        Classifier.trained(spectra, labels, components)
    with pytest.raises(ValueError, match="positive powers"):
        Classifier.trained(spectra - 1.5, [0, 1] * 3, 2)


def test_work_grows_with_bins_and_components():
    assert classifier().operations() > 2 * 8 * 64
