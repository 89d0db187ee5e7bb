"""What a few numbers say of what they are drawn from: means, differences, and 95 % intervals by Student's t.

Pure functions of Python numbers. Sums are exactly rounded, so the order of the numbers changes no digit.

References:
    Student (1908), "The probable error of a mean", Biometrika 6.
    Welch (1947), "The generalization of Student's problem when several different population variances are involved",
        Biometrika 34; degrees of freedom after Satterthwaite (1946).
    Holm (1979), "A simple sequentially rejective multiple test procedure", Scandinavian Journal of Statistics 6.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from scipy.special import stdtr, stdtrit

CONFIDENCE = 0.95
"""Of every interval."""
ROUNDING = 1e-12
"""Two floats that differ by less than this share of the larger are one figure: the rest is the rounding of sums."""

Number = int | float


@dataclass(frozen=True, slots=True)
class Sample:
    """A mean, or a difference of means, and how well it is known.

    Attributes:
        n: How many numbers, or pairs, it rests on.
        mean: The mean; NaN without numbers.
        sd: Standard deviation with n - 1 below the line; NaN below two numbers.
        se: Standard error of the mean.
        low: Lower end of the 95 % interval.
        high: Upper end.
        p: Of the t test that the true mean is 0, two-sided; NaN where there is no standard error.
    """

    n: int
    mean: float
    sd: float = math.nan
    se: float = math.nan
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan


def sample_of(values: Sequence[Number]) -> Sample:
    """Mean, standard deviation, standard error and t interval of independent numbers.

    Args:
        values: Finite numbers.
    """
    n = len(values)
    mean, sd = moments(values)
    if n < 2:
        return Sample(n, mean)
    return _interval(Sample(n, mean, sd, sd / math.sqrt(n)), n - 1)


def differences_of(values: Sequence[Number], baseline: Sequence[Number]) -> list[Number]:
    """Values less the baseline's, pair by pair; 0 where they differ by rounding only."""
    return [difference(a, b) for a, b in zip(values, baseline, strict=True)]


def difference(a: Number, b: Number) -> Number:
    """`a - b`; exact between integers, and 0 between floats that differ by rounding only."""
    if isinstance(a, int) and isinstance(b, int):
        return a - b
    return 0 if abs(a - b) <= ROUNDING * max(abs(a), abs(b)) else a - b


def welch(values: Sequence[Number], baseline: Sequence[Number]) -> Sample:
    """Difference of the means of two independent samples, after Welch; `n` is that of the smaller sample.

    Args:
        values: Finite numbers.
        baseline: Those whose mean is taken off.
    """
    (mean, sd), (base_mean, base_sd) = moments(values), moments(baseline)
    n = min(len(values), len(baseline))
    apart = float(difference(mean, base_mean))
    if n < 2:
        return Sample(n, apart)
    first, second = sd**2 / len(values), base_sd**2 / len(baseline)
    se = math.sqrt(first + second)
    below = first**2 / (len(values) - 1) + second**2 / (len(baseline) - 1)
    return _interval(Sample(n, apart, math.nan, se), se**4 / below if below > 0 else math.inf)


def moments(values: Sequence[Number]) -> tuple[float, float]:
    """Mean and standard deviation (n - 1 below the line); NaN where there are too few numbers."""
    n = len(values)
    if n == 0:
        return math.nan, math.nan
    if min(values) == max(values):
        return float(values[0]), 0.0 if n > 1 else math.nan
    whole = all(isinstance(value, int) for value in values)
    mean = float(sum(values) / n if whole else math.fsum(values) / n)
    return mean, math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (n - 1))


def holm(p: Sequence[float]) -> list[float]:
    """p-values adjusted after Holm: comparing them with 5 % keeps the chance of any false verdict among all below 5 %.

    Args:
        p: One a comparison; NaN stands for none and stays NaN.
    """
    order = sorted((index for index, value in enumerate(p) if not math.isnan(value)), key=lambda index: p[index])
    adjusted = [math.nan] * len(p)
    largest = 0.0
    for rank, index in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - rank) * p[index]))
        adjusted[index] = largest
    return adjusted


def _interval(sample: Sample, freedom: float) -> Sample:
    """The sample with its t interval and p-value; `freedom` degrees of freedom, infinite without any spread."""
    mean, se = sample.mean, sample.se
    if se == 0:
        return Sample(sample.n, mean, sample.sd, se, mean, mean, 1.0 if mean == 0 else 0.0)
    half = quantile(freedom) * se
    p = 2 * float(stdtr(freedom, -abs(mean) / se))
    return Sample(sample.n, mean, sample.sd, se, mean - half, mean + half, p)


@lru_cache(maxsize=1024)
def quantile(freedom: float) -> float:
    """The t quantile that a two-sided 95 % interval takes."""
    return float(stdtrit(freedom, (1 + CONFIDENCE) / 2))
