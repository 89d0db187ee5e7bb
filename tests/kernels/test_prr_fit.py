"""Curves drawn from known parameters are found again, within the errors stated."""

import numpy as np
import pytest
from scipy.special import expit, ndtr
from scipy.stats import chi2

from netsim.kernels.prr_fit import fit_prr


def drawn(seed, rows=200, frames=100, half=-90.0, width=5.0, ceiling=0.97, curve="logistic"):
    generator = np.random.default_rng(seed)
    power = generator.uniform(-100.0, -70.0, rows)
    shape = expit(4.394449 * (power - half) / width) if curve == "logistic" else ndtr(2.563103 * (power - half) / width)
    sent = np.full(rows, frames)
    return power, generator.binomial(sent, ceiling * shape), sent


@pytest.mark.parametrize("curve", ["logistic", "erf"])
def test_over_a_hundred_logs_the_errors_are_those_stated(curve):
    """Standard scores have mean 0 and variance 1: both within 99.9 % bounds for a hundred."""
    scores = []
    for seed in range(100):
        fit = fit_prr(*drawn(seed, curve=curve), curve=curve)
        scores.append(
            [
                (fit.half_dbm + 90.0) / fit.half_se_db,
                (fit.width_db - 5.0) / fit.width_se_db,
                (fit.ceiling - 0.97) / fit.ceiling_se,
            ]
        )
    assert np.all(np.abs(np.mean(scores, axis=0)) < 3.3 / 10.0)
    low, high = chi2.interval(0.999, 100)
    assert np.all((np.sum(np.square(scores), axis=0) > low) & (np.sum(np.square(scores), axis=0) < high))


def test_the_deviance_is_about_the_degrees_of_freedom_where_the_model_holds():
    fit = fit_prr(*drawn(1))
    low, high = chi2.interval(0.999, fit.freedom)
    assert low < fit.dispersion * fit.freedom < high
    assert (fit.rows, fit.frames, fit.freedom) == (200, 20_000, 197)


def test_links_that_differ_widen_the_errors_and_the_dispersion():
    """Each link has a 50 % point of its own, 2 dB apart (sd), and is measured ten times."""
    scores = []
    for seed in range(60):
        generator = np.random.default_rng(seed)
        link = np.repeat(np.arange(60), 10)
        power = generator.uniform(-100.0, -80.0, 60)[link]
        received = generator.binomial(100, expit((power + 90.0 - generator.normal(0.0, 2.0, 60)[link]) / 0.5))
        fit = fit_prr(power, received, np.full(600, 100), link, with_ceiling=False)
        assert fit.dispersion > 3.0
        scores.append((fit.half_dbm + 90.0) / fit.half_se_db)
    assert 0.7 < np.std(scores) < 1.4
    assert abs(np.mean(scores)) < 0.5


def test_the_better_curve_has_the_lower_deviance():
    for curve, other in (("logistic", "erf"), ("erf", "logistic")):
        log = drawn(3, rows=2000, curve=curve)
        assert fit_prr(*log, curve=curve).deviance < fit_prr(*log, curve=other).deviance


def test_the_curve_it_returns_is_the_one_it_fitted():
    fit = fit_prr(*drawn(5))
    at = np.array([-300.0, fit.half_dbm - fit.width_db / 2, fit.half_dbm, fit.half_dbm + fit.width_db / 2, 0.0])
    assert fit.prr(at) == pytest.approx(fit.ceiling * np.array([0.0, 0.1, 0.5, 0.9, 1.0]))


@pytest.mark.parametrize(
    ("power", "received", "sent", "what"),
    [
        ([-90.0, -80.0], [1, 2, 3], [9, 9, 9], "one length"),
        ([-90.0, -80.0], [1, 2], [9, 9], "at least 4 rows"),
        ([-90.0] * 6, [1, 2, 3, 4, 5, 6], [9] * 6, "more than one received power"),
        ([-90.0, -80, -70, -60], [0, 0, 0, 0], [9] * 4, "some lost"),
        ([-90.0, -80, -70, -60], [9, 9, 9, 9], [9] * 4, "some lost"),
        ([-90.0, -80, -70, -60], [1, 2, 10, 3], [9] * 4, "received <= sent"),
        ([-90.0, np.nan, -70, -60], [1, 2, 3, 3], [9] * 4, "finite"),
        ([-90.0, -80, -70, -60], [0, 0, 9, 9], [9] * 4, "jump"),
        ([-90.0, -80, -70, -60], [9, 7, 2, 0], [9] * 4, "rise"),
    ],
)
def test_what_shows_no_curve_is_refused(power, received, sent, what):
    with pytest.raises(ValueError, match=what):
        fit_prr(np.array(power), np.array(received), np.array(sent))
