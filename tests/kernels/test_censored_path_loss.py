"""Path loss is found again although the weakest links are missing; least squares does not find it."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import chi2, norm

from netsim.kernels.censored_path_loss import fit_censored_path_loss
from netsim.kernels.path_loss_fit import fit_path_loss

LIMIT_DB = -88.0
TRUE = np.array([3.0, 40.0, (5.0**2 + 3.0**2 / 4) ** 0.5])


def field(seed, nodes=30):
    """Both directions of every pair: distance, gain, number of the pair."""
    generator = np.random.default_rng(seed)
    where = generator.uniform(0.0, 60.0, (nodes, 2))
    i, j = np.triu_indices(nodes, 1)
    distance = np.hypot(*(where[i] - where[j]).T)
    gain = -40.0 - 30.0 * np.log10(distance) + generator.normal(0.0, 5.0, len(i))
    half = generator.normal(0.0, 1.5, len(i))
    return np.tile(distance, 2), np.concatenate([gain - half, gain + half]), np.tile(np.arange(len(i)), 2)


def fitted(seed, truncated):
    distance, gain, pair = field(seed)
    seen = gain >= LIMIT_DB
    limit = np.full(len(gain), LIMIT_DB)
    if truncated:
        return fit_censored_path_loss(distance[seen], gain[seen], limit[seen], pair[seen], truncated=True)
    return fit_censored_path_loss(distance, np.where(seen, gain, np.nan), limit, pair, truncated=False)


@pytest.mark.parametrize("truncated", [False, True])
def test_over_a_hundred_fields_the_errors_are_those_stated(truncated):
    """Standard scores within 99.9 % bounds for a hundred; the errors are asymptotic, so a tenth more is allowed."""
    scores = []
    for seed in range(100):
        fit = fitted(seed, truncated)
        found = np.array([fit.exponent, fit.reference_loss_db, fit.sd_db])
        errors = np.array([fit.exponent_se, fit.reference_loss_se_db, fit.sd_se_db])
        scores.append((found - TRUE) / errors)
    assert np.all(np.abs(np.mean(scores, axis=0)) < 3.3 / 10.0)
    low, high = chi2.interval(0.999, 100)
    assert np.all((np.sum(np.square(scores), axis=0) > low / 1.2) & (np.sum(np.square(scores), axis=0) < high * 1.2))


def test_least_squares_through_what_was_seen_is_biased():
    plain = []
    for seed in range(20):
        distance, gain, _ = field(seed)
        plain.append(fit_path_loss(distance[gain >= LIMIT_DB], gain[gain >= LIMIT_DB]).exponent)
    assert np.mean(plain) < 2.6


@pytest.mark.parametrize("truncated", [False, True])
def test_it_is_the_maximum_of_the_likelihood_written_out(truncated):
    distance, gain, _ = field(7)
    seen = gain >= LIMIT_DB
    fit = fitted(7, truncated)

    def loss(theta):
        mean = -theta[1] - 10.0 * theta[0] * np.log10(distance)
        logs = norm.logpdf(gain[seen], mean[seen], theta[2])
        if truncated:
            return -np.sum(logs - norm.logsf(LIMIT_DB, mean[seen], theta[2]))
        return -np.sum(logs) - np.sum(norm.logcdf(LIMIT_DB, mean[~seen], theta[2]))

    found = minimize(
        loss, [2.5, 45.0, 4.0], method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9, "maxiter": 9000}
    )
    assert [fit.exponent, fit.reference_loss_db, fit.sd_db] == pytest.approx(found.x, rel=1e-4)


def test_with_nothing_missing_it_is_least_squares():
    distance, gain, pair = field(2)
    fit = fit_censored_path_loss(distance, gain, np.full(len(gain), -300.0), pair, truncated=False)
    plain = fit_path_loss(distance, gain)
    assert (fit.exponent, fit.reference_loss_db) == pytest.approx((plain.exponent, plain.reference_loss_db), rel=1e-6)
    assert fit.sd_db == pytest.approx(plain.shadowing_sd_db, rel=5e-3)
    assert (fit.seen, fit.unseen, fit.truncated) == (len(gain), 0, False)


def test_too_little_is_refused():
    one = np.ones(5)
    with pytest.raises(ValueError, match="two or more distances"):
        fit_censored_path_loss(one, -one, -2 * one, np.arange(5), truncated=False)
    with pytest.raises(ValueError, match="at least four"):
        fit_censored_path_loss(np.arange(1.0, 6.0), np.full(5, np.nan), -one, np.arange(5), truncated=False)
