"""Figures, differences and verdicts in words."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from netsim.study.differences import EQUAL, HIGHER, LOWER, TOO_FEW, UNDECIDED
from netsim.study.levels import label_of
from netsim.study.reporting.blocks import plain
from netsim.study.reporting.names import better_of
from netsim.study.reporting.numbers import decimals_of, interval, percent, signed, with_half
from netsim.study.reporting.view import View
from netsim.study.samples import CONFIDENCE, merged

Row = Mapping[str, Any]
"""A row of the paired differences."""


def value_of(view: View, variant: int, metric: str) -> str:
    """A figure in words: `64.0 ± 2.1 mJ`."""
    scale, found = view.scale(metric), view.estimate(variant, metric)
    unit = "" if scale.unit == "byte" else scale.unit  # the title says it
    return f"{with_half(found.mean, found.half, scale)} {unit}".strip()


def decided(row: Row) -> str:
    """A verdict that stands after Holm's adjustment for all comparisons of the metric: the one that a report gives."""
    verdict = str(row["verdict"])
    return UNDECIDED if verdict in (LOWER, HIGHER) and not row["p_holm"] < 1 - CONFIDENCE else verdict


def verdict_of(row: Row) -> str:
    """The verdict in words: whether it is better or worse."""
    verdict = decided(row)
    if verdict in (LOWER, HIGHER):
        better = better_of(row["metric"])
        return ("better" if better == verdict else "worse") if better else verdict
    if verdict == EQUAL:
        return "equal in every pair"
    if verdict == TOO_FEW:
        return "too few pairs to tell"
    return "undecided" if row["verdict"] == UNDECIDED else "undecided among so many comparisons"


def difference_of(view: View, row: Row) -> str:
    """A paired difference in words: `−12.3 [−15.1, −9.5] mJ, −15 %, better`."""
    if row["verdict"] == EQUAL:
        return "equal in every pair"
    scale = view.scale(row["metric"])
    low, high = float(row["low"]), float(row["high"])
    decimals = decimals_of((high - low) / 2 * scale.factor)
    size = signed(float(row["difference"]) * scale.factor, decimals, digits=2)
    size += f" {interval(low, high, scale)}" if not math.isnan(low) else ""
    size += f" {scale.unit}" if scale.unit else ""
    return ", ".join(filter(None, (size, percent(float(row["relative"])), verdict_of(row))))


def relative_range(rows: Iterable[Row]) -> str:
    """From the least relative difference of some rows to the largest: `−83 % to −77 %`; says where there is none."""
    rows = list(rows)
    shares = [float(row["relative"]) for row in rows if math.isfinite(row["relative"])]
    ends = [percent(share) for share in (min(shares), max(shares))] if shares else []
    left = len(rows) - len(shares)
    told = f" (baseline 0 in {left} of {len(rows)})" if shares and left else ""
    return " to ".join(dict.fromkeys(ends)) + told


def rows_of(view: View, metric: str, levels: Mapping[str, Any]) -> list[Row]:
    """The paired differences of a metric at given levels of any axes, as far as there are pairs."""
    if view.differences is None:
        return []
    wanted = {axis: label_of(level) for axis, level in levels.items()}
    rows = view.differences[(view.differences["metric"] == metric) & (view.differences["n"] > 0)].to_dict("records")
    return [row for row in rows if all(label_of(row[axis]) == label for axis, label in wanted.items())]


def pareto_chain(view: View, cost: str, variants: Sequence[int]) -> str:
    """A Pareto set from the best error on, those with the same means joined: `a → b = c`; `none` for an empty one.

    Variants that lack a figure in some trial are named: what is missing may be the best or the worst.
    """
    members = view.pareto(cost, variants)
    both = (str(view.error), cost)
    means = [merged({number: view.estimate(number, metric).mean for number in members}) for metric in both]
    alike: dict[tuple[float, ...], list[str]] = {}
    for number in members:
        alike.setdefault(tuple(each[number] for each in means), []).append(name_within(view, number))
    return (chain([" = ".join(_few(names)) for names in alike.values()]) or "none") + missing(view, both, variants)


def missing(view: View, metrics: Sequence[str], variants: Sequence[int]) -> str:
    """Which of some variants lack a figure of one of the metrics in some trial: ` (not every trial has a figure: a)`."""
    found = [number for number in variants if not all(view.is_whole(number, metric) for metric in metrics)]
    names = _few([bracketed(name_within(view, number)) for number in found])
    return f" (not every trial has a figure: {', '.join(names)})" if names else ""


def rivals(view: View, cost: str, variants: Sequence[int]) -> str:
    """The variants outside the Pareto set of the means of which it is not shown that another dominates them."""
    members = view.pareto(cost, variants)
    found = [number for number in variants if number in view.candidates(cost) and number not in members]
    names = _few([bracketed(name_within(view, number)) for number in found])
    return f" (not shown to be dominated: {', '.join(names)})" if names else ""


def name_within(view: View, variant: int) -> str:
    """A variant in words, without the circumstances."""
    return plain(view.name(variant, [axis.name for axis in view.conditions]))


def sides_of(metrics: Sequence[str], lower: str, higher: str, mixed: str) -> str:
    """A word for which way some metrics are better; those of which that is not known count as lower."""
    found = {better_of(metric) == "higher" for metric in metrics}
    return mixed if len(found) > 1 else higher if True in found else lower


def _few(names: Sequence[str], most: int = 4) -> list[str]:
    left = len(names) - most
    return [*names[:most], f"{left} more"] if left > 0 else list(names)


def chain(names: Sequence[str], most: int = 7) -> str:
    """Names in an order, the middle of many left out: `a → b → c`."""
    if len(names) <= most:
        return " → ".join(names)
    return " → ".join([*names[: most - 3], "…", *names[-2:]]) + f" ({len(names)} in all)"


def bracketed(text: str) -> str:
    """Text in parentheses if it holds a comma, so that it can stand in a list."""
    return f"({text})" if "," in text else text


def and_list(words: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
