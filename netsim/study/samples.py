"""What a few numbers say of what they are drawn from: means, differences, and 95 % intervals by Student's t.

Pure functions of Python numbers. Sums are exactly rounded, so the order of the numbers changes no digit.

Numbers that are all equal, or equal but for rounding, have no spread, and the t interval would claim certainty after two of
them: two runs of a metric that counts in whole steps easily agree. There the exact permutation test decides (all signs, or
all ways to deal the numbers to two samples, being equally likely), and unless it reaches 5 % - six pairs, or four against
four - there is no interval.

References:
    Fisher (1935), "The Design of Experiments", section 21: permutation test.
    Student (1908), "The probable error of a mean", Biometrika 6.
    Welch (1947), "The generalization of Student's problem when several different population variances are involved",
        Biometrika 34; degrees of freedom after Satterthwaite (1946).
    Holm (1979), "A simple sequentially rejective multiple test procedure", Scandinavian Journal of Statistics 6.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
        low: Lower end of the 95 % interval; NaN below two numbers, or where too few of them are all equal.
        high: Upper end.
        p: Of the test that the true mean is 0, two-sided; NaN below two numbers.
    """

    n: int
    mean: float
    sd: float = math.nan
    se: float = math.nan
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan


def sample_of(values: Sequence[Number], scale: float = 0.0) -> Sample:
    """Mean, standard deviation, standard error and t interval of independent numbers.

    Args:
        values: Finite numbers.
        scale: Magnitude of what they were made of, should that be larger than they: how much of them is rounding.
    """
    n = len(values)
    mean, sd = moments(values, scale)
    if n < 2:
        return Sample(n, mean)
    return _interval(Sample(n, mean, sd, sd / math.sqrt(n)), n - 1, 2**n)


def paired_sample(values: Sequence[Number], baseline: Sequence[Number]) -> Sample:
    """The mean of values less the baseline's, pair by pair; differences that are alike but for rounding have no spread.

    Args:
        values: Finite numbers.
        baseline: As many.
    """
    return sample_of(differences_of(values, baseline), max(map(abs, (*values, *baseline)), default=0.0))


def differences_of(values: Sequence[Number], baseline: Sequence[Number]) -> list[Number]:
    """Values less the baseline's, pair by pair; 0 where they differ by rounding only."""
    return [difference(a, b) for a, b in zip(values, baseline, strict=True)]


def difference(a: Number, b: Number) -> Number:
    """`a - b`; exact between integers, and 0 between floats that differ by rounding only."""
    if isinstance(a, int) and isinstance(b, int):
        return a - b
    return 0 if abs(a - b) <= ROUNDING * max(abs(a), abs(b)) else a - b


def are_equal(values: Sequence[Number]) -> bool:
    """Whether there are numbers, and no two of them differ by more than rounding."""
    return bool(values) and difference(max(values), min(values)) == 0


def merged(values: Mapping[int, float]) -> dict[int, float]:
    """The same numbers by the same keys in the same order, those that differ by rounding only made one: the least of them.

    Args:
        values: Finite numbers.
    """
    found: dict[int, float] = {}
    last = least = math.nan
    for key in sorted(values, key=lambda key: (values[key], key)):
        if difference(values[key], last) != 0:
            least = values[key]
        last = values[key]
        found[key] = least
    return {key: found[key] for key in values}


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
    se, base_se = sd / math.sqrt(len(values)), base_sd / math.sqrt(len(baseline))
    both = math.hypot(se, base_se)
    arrangements = math.comb(len(values) + len(baseline), len(values))
    if both == 0:
        return _interval(Sample(n, apart, math.nan, 0.0), math.inf, arrangements)
    below = (se / both) ** 4 / (len(values) - 1) + (base_se / both) ** 4 / (len(baseline) - 1)
    return _interval(Sample(n, apart, math.nan, both), 1 / below, arrangements)


def moments(values: Sequence[Number], scale: float = 0.0) -> tuple[float, float]:
    """Mean and standard deviation (n - 1 below the line); NaN where there are too few numbers.

    Args:
        values: Finite numbers.
        scale: As of `sample_of`.
    """
    n = len(values)
    if n == 0:
        return math.nan, math.nan
    if min(values) == max(values):
        return float(values[0]), 0.0 if n > 1 else math.nan
    whole = all(isinstance(value, int) for value in values)
    if not whole and max(values) - min(values) <= ROUNDING * max(scale, *map(abs, values)):
        return math.fsum(values) / n, 0.0
    anchor = min(values) if whole else 0
    apart = [value - anchor for value in values]  # of integers exact, however large they are
    centre = math.fsum(apart) / n
    widest = max(abs(value - centre) for value in apart)
    squares = math.fsum(((value - centre) / widest) ** 2 for value in apart)
    return sum(values) / n if whole else centre, widest * math.sqrt(squares / (n - 1))


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


def _interval(sample: Sample, freedom: float, arrangements: int) -> Sample:
    """The sample with its interval and p-value.

    Args:
        sample: With mean and standard error.
        freedom: Degrees of freedom.
        arrangements: How many the permutation test has, for a sample without spread.
    """
    mean, se = sample.mean, sample.se
    if se == 0:
        chance = 2 / arrangements
        half = 0.0 if chance < 1 - CONFIDENCE else math.nan
        p = 1.0 if mean == 0 else min(1.0, chance)
    else:
        half = quantile(freedom) * se
        p = 2 * float(stdtr(freedom, -abs(mean) / se))
    return replace(sample, low=mean - half, high=mean + half, p=p)


@lru_cache(maxsize=1024)
def quantile(freedom: float) -> float:
    """The t quantile that a two-sided 95 % interval takes."""
    return float(stdtrit(freedom, (1 + CONFIDENCE) / 2))
