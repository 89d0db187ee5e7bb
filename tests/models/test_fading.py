"""Fading: mean 1, the moments and the quantiles of the distribution, and draws that do not depend on how many are asked."""

import math

import numpy as np
import pytest

from netsim.models.fading import (
    FadingParameters,
    LogNormalFading,
    NakagamiFading,
    RayleighFading,
    RicianFading,
    peak_db,
)

K = 10**0.6
SD = 3.0 * math.log(10) / 10
# Variance of the power gain at mean 1.
VARIANCES: list[tuple[FadingParameters, float]] = [
    (RayleighFading(), 1.0),
    (RicianFading(k_db=6.0), (1 + 2 * K) / (1 + K) ** 2),
    (NakagamiFading(m=2.5), 1 / 2.5),
    (LogNormalFading(sd_db=3.0), math.exp(SD**2) - 1),
]  # fmt: skip
ALL = [fading for fading, _ in VARIANCES]
COUNT = 200_000


@pytest.mark.parametrize(("fading", "variance"), VARIANCES)
def test_mean_and_variance(fading: FadingParameters, variance: float) -> None:
    """Five standard errors, the variance's from the sample's fourth moment."""
    gains = fading.gains(np.random.default_rng(8), COUNT)
    assert gains.min() >= 0.0
    assert abs(gains.mean() - 1.0) < 5 * math.sqrt(variance / COUNT)
    squares = (gains - 1.0) ** 2
    assert abs(squares.mean() - variance) < 5 * squares.std() / math.sqrt(COUNT)


@pytest.mark.parametrize("fading", ALL)
def test_quantiles_are_those_of_the_draws(fading: FadingParameters) -> None:
    """The share of draws below each quantile, inside five binomial standard errors."""
    gains = fading.gains(np.random.default_rng(9), COUNT)
    for share in (0.01, 0.1, 0.5, 0.9, 0.999):
        below = np.mean(gains < fading.quantile(np.array([share]))[0])
        assert abs(below - share) < 5 * math.sqrt(share * (1 - share) / COUNT)


@pytest.mark.parametrize("fading", ALL)
def test_quantiles_average_to_about_one(fading: FadingParameters) -> None:
    """The 32 equally likely gains that link qualities are averaged over lose a little of the upper tail, no more."""
    mean = fading.quantile((np.arange(32) + 0.5) / 32).mean()
    assert 0.97 < mean <= 1.0001


@pytest.mark.parametrize("fading", ALL)
def test_the_first_draws_do_not_depend_on_how_many_follow(fading: FadingParameters) -> None:
    few, many = (fading.gains(np.random.default_rng(3), size) for size in (5, 9))
    assert few.tolist() == many[:5].tolist()


def test_nakagami_of_1_and_rician_without_a_steady_path_are_rayleigh() -> None:
    share = np.linspace(0.0, 0.999, 50)
    rayleigh = RayleighFading().quantile(share)
    np.testing.assert_allclose(NakagamiFading(m=1.0).quantile(share), rayleigh, atol=1e-12)
    np.testing.assert_allclose(RicianFading(k_db=-20.0).quantile(share), rayleigh, rtol=0.02, atol=1e-3)


def test_peaks() -> None:
    assert peak_db(None) == 0.0
    assert peak_db(RayleighFading()) == pytest.approx(10 * math.log10(math.log(1000)))
    assert peak_db(LogNormalFading(sd_db=0.0)) == 0.0
