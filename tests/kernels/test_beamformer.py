"""The beamformer against signals whose bearing is known, the bound of its error, and the least squares of eq 9 by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.acoustics import wrapped_rad
from netsim.kernels.beamformer import (
    ArrayProcessing,
    beam_power,
    beamforming_operations,
    bearing_bound_rad,
    bearing_of,
    reading_of,
    reading_operations,
    square_m,
)
from netsim.models.sound import MicrophoneArray, heard, source_spectrum

PLAIN = ArrayProcessing()
HANN = ArrayProcessing(window="hann")
ARRAY = MicrophoneArray()
ALL_ROUND = np.radians(np.arange(-180.0, 180.0, 2.3))


def error_deg(found_rad, true_rad):
    return math.degrees(float(wrapped_rad(found_rad - true_rad)))


def repeating(bearing, processing, rng, loudness=1.0):
    """Samples of a source that repeats itself with the DFT's length, for which eq 8 is exact; and its spectrum."""
    bins = len(processing.frequencies_hz())
    spectrum = loudness * (rng.standard_normal(bins) + 1j * rng.standard_normal(bins))
    turned = spectrum * np.exp(-2j * np.pi * processing.delays_s(bearing)[:, None] * processing.frequencies_hz())
    whole = np.zeros((len(turned), processing.samples // 2 + 1), dtype=complex)
    whole[:, 1 : bins + 1] = turned
    return np.fft.irfft(whole, processing.samples, axis=1), spectrum


def plane(bearing, rng, amplitude=1.0):
    """Samples of a plane wave of a vehicle's sound, which does not repeat itself."""
    return heard(source_spectrum(ARRAY, rng), ARRAY, list(PLAIN.delays_s(bearing)), [amplitude] * 4)


def test_the_array_of_figure_4():
    sides_m = [math.dist(a, b) for a, b in zip(square_m(), (*square_m()[1:], square_m()[0]), strict=True)]
    np.testing.assert_allclose(sides_m, 0.3048)
    np.testing.assert_allclose(np.mean(square_m(), axis=0), 0.0)


@given(st.floats(-math.pi, math.pi))
def test_who_is_nearer_to_the_source_hears_it_earlier(bearing):
    towards = np.array([math.sin(bearing), math.cos(bearing)])
    far_m = 1e6 * towards
    late_s = (np.hypot(*(far_m - np.asarray(square_m())).T) - 1e6) / 343.0
    np.testing.assert_allclose(PLAIN.delays_s(bearing), late_s, atol=1e-9)


@pytest.mark.parametrize("samples", [256, 511])
def test_without_noise_the_bearing_is_exact_all_round(samples):
    processing, rng = ArrayProcessing(samples=samples), np.random.default_rng(1)
    errors = [error_deg(bearing_of(repeating(true, processing, rng)[0], processing), true) for true in ALL_ROUND]
    assert np.abs(errors).max() < 1e-4


def test_without_noise_a_sound_that_does_not_repeat_itself_is_off_by_less_than_a_hundredth_of_a_degree_with_a_window():
    rng = np.random.default_rng(2)
    errors = [error_deg(bearing_of(plane(true, rng), HANN), true) for true in ALL_ROUND]
    assert np.abs(errors).max() < 0.01


def test_without_noise_and_window_the_ends_of_the_samples_cost_a_tenth_of_a_degree():
    rng = np.random.default_rng(2)
    errors = [error_deg(bearing_of(plane(true, rng), PLAIN), true) for true in ALL_ROUND]
    assert 0.02 < np.std(errors) < 0.3
    assert np.abs(errors).max() < 1.5


@settings(max_examples=10, deadline=None)
@given(st.floats(-math.pi, math.pi), st.integers(0, 2**32 - 1))
def test_least_squares_over_all_bins_of_both_signs_is_least_where_the_beam_is_strongest(true, seed):
    """Eqs 9 and 10 as they stand: pseudo-inverse, l from 0 to L - 1, those above L / 2 as negative frequencies."""
    rng, processing = np.random.default_rng(seed), ArrayProcessing(samples=63)
    samples = repeating(true, processing, rng)[0] + 0.3 * rng.standard_normal((4, 63))
    spectra, hz = np.fft.fft(samples, axis=1), np.fft.fftfreq(63, 1.0 / processing.sampling_hz)
    tried = np.linspace(-math.pi, math.pi, 25)
    squares = []
    for bearing in tried:
        steering = np.exp(-2j * np.pi * hz * processing.delays_s(bearing)[:, None])
        estimate = [np.linalg.pinv(steering[:, [bin_]]) @ spectra[:, bin_] for bin_ in range(63)]
        squares.append(np.linalg.norm(spectra - steering * np.ravel(estimate)) ** 2)
    power = beam_power(np.fft.rfft(samples, axis=1)[:, 1:], tried, processing)
    whole = np.linalg.norm(spectra) ** 2 - np.abs(spectra[:, 0].sum()) ** 2 / 4.0
    np.testing.assert_allclose(squares, whole - 2.0 * power / 4.0, rtol=1e-9)


def first_order_spread_rad(spectrum, noise_sd, processing):
    """Spread of eq 9's bearing to first order in the noise, also where that is not small against the signal in every bin.

    With b = D^H G, b' = D'^H G and J = sum |b|^2 the error is J' / -J''. Signal and noise give J' a variance of 2 sum |D'|^2
    L s^2 (M^2 |S|^2 + M L s^2), and -J'' is 2 M sum |D'|^2 |S|^2, so the bound's square grows by 1 + sum f^2 L s^2 / (M sum
    f^2 |S|^2).
    """
    weight = processing.frequencies_hz() ** 2
    noise = processing.samples * noise_sd**2 * weight.sum() / (4.0 * (weight * np.abs(spectrum) ** 2).sum())
    return bearing_bound_rad(spectrum, noise_sd, processing) * math.sqrt(1.0 + noise)


@pytest.mark.parametrize("noise_sd", [1.0, 20.0])
def test_the_spread_is_the_cramer_rao_bound_and_what_the_noise_of_every_bin_adds(noise_sd):
    rng, count = np.random.default_rng(3), 300
    errors, bounds, expected = [], [], []
    for _ in range(count):
        true = rng.uniform(-math.pi, math.pi)
        samples, spectrum = repeating(true, PLAIN, rng, loudness=150.0)
        found = bearing_of(samples + noise_sd * rng.standard_normal(samples.shape), PLAIN)
        errors.append(float(wrapped_rad(found - true)))
        bounds.append(bearing_bound_rad(spectrum, noise_sd, PLAIN))
        expected.append(first_order_spread_rad(spectrum, noise_sd, PLAIN))
    spread = math.sqrt(np.mean(np.square(expected)))
    over_bound = math.sqrt(1.0 + 512 * noise_sd**2 / (4.0 * 2.0 * 150.0**2))  # 1.001 and 1.46
    assert spread / math.sqrt(np.mean(np.square(bounds))) == pytest.approx(over_bound, rel=0.02)
    assert np.std(errors) == pytest.approx(spread, rel=4.0 / math.sqrt(2 * count))  # four standard errors of a spread
    assert abs(np.mean(errors)) < 4.0 * spread / math.sqrt(count)


def test_the_spread_grows_as_the_source_fades():
    spreads = []
    for range_m in (10.0, 30.0, 60.0, 120.0):
        rng, errors = np.random.default_rng(4), []
        for true in rng.uniform(-math.pi, math.pi, 50):
            noisy = plane(true, rng, 40.0 / range_m) + ARRAY.noise_sd * rng.standard_normal((4, 512))
            errors.append(error_deg(bearing_of(noisy, PLAIN), true))
        spreads.append(np.std(errors))
    assert spreads == sorted(spreads)
    assert spreads[0] < 1.0 < 5.0 < spreads[-1]


def test_two_sources_and_the_louder_one_is_found():
    rng = np.random.default_rng(5)
    errors = [error_deg(bearing_of(plane(1.0, rng, 2.0) + plane(-1.5, rng, 0.2), PLAIN), 1.0) for _ in range(20)]
    assert np.abs(errors).max() < 3.0


def test_readings_are_themselves_and_samples_become_bearings():
    assert reading_of(np.array([1.25]), None) == 1.25
    assert reading_of(np.array([1.25]), PLAIN) == 1.25
    samples = plane(0.7, np.random.default_rng(6))
    assert reading_of(samples, PLAIN) == bearing_of(samples, PLAIN) == pytest.approx(0.7, abs=0.02)


@pytest.mark.parametrize("nothing", [np.zeros(0), np.zeros((0, 512))])
def test_a_dead_sensor_s_reading_is_no_number(nothing):
    assert math.isnan(reading_of(nothing, PLAIN))
    assert reading_operations(nothing, PLAIN) == 0


def test_samples_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"expected samples of shape \(4, 512\), got \(4, 100\)"):
        bearing_of(np.zeros((4, 100)), PLAIN)
    with pytest.raises(ValueError, match="need an ArrayProcessing"):
        reading_of(np.zeros((4, 512)), None)


def test_a_constant_offset_of_the_microphones_changes_nothing():
    samples = plane(2.0, np.random.default_rng(7))
    offsets = np.array([[3.0], [-1.0], [0.5], [10.0]])
    assert bearing_of(samples + offsets, PLAIN) == pytest.approx(bearing_of(samples, PLAIN), abs=1e-9)


def test_only_the_beamformer_is_work():
    assert reading_operations(np.array([1.0]), PLAIN) == 0
    work = reading_operations(np.zeros((4, 512)), PLAIN)
    assert work == beamforming_operations(PLAIN) > 255 * 120 * 8 * 4  # the coarse search alone
    assert beamforming_operations(HANN) == work + 4 * 512
    assert 1.8 < beamforming_operations(ArrayProcessing(samples=1024)) / work < 2.2
