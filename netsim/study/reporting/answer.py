"""The short answer: what the results say, in words, and no more than they say."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from netsim.study.differences import HIGHER, LOWER
from netsim.study.levels import label_of
from netsim.study.reporting.blocks import Block, Bullets, Table, Text, plain
from netsim.study.reporting.names import better_of, level_name, title_of
from netsim.study.reporting.phrases import (
    and_list,
    bracketed,
    difference_of,
    missing,
    pareto_chain,
    relative_range,
    rivals,
    rows_of,
    sides_of,
    value_of,
    verdict_of,
)
from netsim.study.reporting.view import View
from netsim.study.samples import merged
from netsim.study.statistics import verdicts

MOST_SETTINGS = 6
"""With more settings of the conditions, the extremes of each are left to the tables."""
MOST_NAMES = 4
"""So many variants that are alike are named."""
MOST_SENTENCES = 6
"""So many levels of the compare axis get a sentence."""
MOST_LEVELS = 12
"""So many levels of the compare axis stand in the table of verdicts."""


def answer(view: View) -> tuple[Block, ...]:
    """What the results say."""
    if not view.variants:
        return (Text("No trial ended, so there is no answer."),)
    items = (*_in_words(view), *_extremes(view), *_pareto(view))
    blocks = (Bullets(items) if items else None, _verdicts(view))
    return tuple(block for block in blocks if block is not None) or (Text(_alone(view)),)


def _in_words(view: View) -> Iterator[str]:
    """Each level against the baseline in a sentence: in what it is better, worse, or neither."""
    axis = view.info.compare_axis
    if axis is None or view.differences is None:
        return
    levels: dict[str, dict[str, list[str]]] = {}
    for metric in view.compared:
        for row in verdicts(view.results.trials, view.info, metric).to_dict("records"):
            name = plain(level_name(axis, row["level"]))
            levels.setdefault(name, {}).setdefault(_overall(view, metric, row), []).append(title_of(metric))
    for name, found in list(levels.items())[:MOST_SENTENCES]:
        if len(found) == 1 and len(view.compared) > 1:
            yield f"**{name}** against {plain(level_name(axis, view.info.baseline))}: {next(iter(found))} in every metric."
            continue
        said = "; ".join(f"{overall} in {and_list(titles)}" for overall, titles in sorted(found.items(), key=_order))
        yield f"**{name}** against {plain(level_name(axis, view.info.baseline))}: {said}."
    left = len(levels) - MOST_SENTENCES
    if left > 0:
        yield f"{left} more level{'s' if left > 1 else ''} of {plain(axis)}: in the table of verdicts below."


def _overall(view: View, metric: str, row: Mapping[str, Any]) -> str:
    """A metric's verdict over all settings."""
    if row[LOWER] and row[HIGHER]:
        return "better or worse, depending on the setting," if better_of(metric) else "lower or higher, by setting,"
    if not _has_pairs(view, metric, row):
        return "no pairs to compare"
    counts = {
        _sense(metric, LOWER): int(row[LOWER]),
        _sense(metric, HIGHER): int(row[HIGHER]),
        "undecided": int(row["undecided"]),
        "equal": int(row["equal"]),
        "too few pairs to tell": int(row["too_few"]),
    }
    (first, count), *others = ((word, number) for word, number in counts.items() if number)
    if not others:
        return first
    total = int(row["combinations"])
    if len(others) == 1:
        rest = f"{others[0][0]} in the other{'s' if others[0][1] > 1 else ''}"
    else:
        rest = and_list([f"{word} in {number}" for word, number in others])
    return f"{first} in {count} of {total} settings, {rest},"


def _has_pairs(view: View, metric: str, row: Mapping[str, Any]) -> bool:
    """Whether a level has a repetition in common with the baseline in any setting."""
    return bool(rows_of(view, metric, {str(view.info.compare_axis): row["level"]}))


def _order(item: tuple[str, list[str]]) -> int:
    """Better before worse, what is sure before what is not."""
    places = ("**better**", "**better** ", "**worse**", "**worse** ", "better or")
    return max((place for place, start in enumerate(places) if item[0].startswith(start)), default=len(places))


def _verdicts(view: View) -> Table | None:
    """Each level of the compare axis against its baseline, over all settings of the other axes."""
    axis = view.info.compare_axis
    if axis is None or view.differences is None:
        return None
    rows: dict[str, list[str]] = {}
    for metric in view.compared:
        for row in verdicts(view.results.trials, view.info, metric).to_dict("records"):
            name = plain(level_name(axis, row["level"]))
            rows.setdefault(name, [name]).append(_verdict(view, metric, row))
    if not rows:
        return None
    base = plain(level_name(axis, view.info.baseline))
    header = (f"against {base}", *(title_of(metric) for metric in view.compared))
    several = any(len(each.levels) > 1 for each in view.info.axes if each.name != axis)
    left = len(rows) - MOST_LEVELS
    more = f" {left} more levels stand in the table of paired differences." if left > 0 else ""
    return Table(
        header, tuple(map(tuple, list(rows.values())[:MOST_LEVELS])), len(header), caption=_how(several) + more
    )


def _how(several: bool) -> str:
    """How to read the table of verdicts."""
    text = "Mean difference within repetitions, relative to the baseline"
    text += ", from the least to the largest over the settings of the other axes" if several else ""
    return (
        f"{text}. **Better** or **worse**: the 95 % interval of the paired difference excludes 0, even after Holm's "
        "adjustment for all comparisons of the metric in this study; otherwise it is undecided."
    )


def _verdict(view: View, metric: str, row: Mapping[str, Any]) -> str:
    """One metric of one level over all settings."""
    axis, total = str(view.info.compare_axis), int(row["combinations"])
    rows = rows_of(view, metric, {axis: row["level"]})
    if not rows:
        return "no pairs"
    counts = {
        _sense(metric, LOWER): int(row["lower"]),
        _sense(metric, HIGHER): int(row["higher"]),
        "equal": int(row["equal"]),
        "undecided": int(row["undecided"]),
        "too few pairs": int(row["too_few"]),
    }
    there = {word: count for word, count in counts.items() if count}
    said = ", ".join(word if count == total else f"{word} in {count} of {total}" for word, count in there.items())
    said += " – **the verdict flips**" if row["verdict"] == "flips" else ""
    share = relative_range(rows) if counts["equal"] < total else ""
    return f"{share}: {said}" if share else said


def _sense(metric: str, verdict: str) -> str:
    better = better_of(metric)
    return f"**{('better' if better == verdict else 'worse') if better else verdict}**"


def _extremes(view: View) -> Iterator[str]:
    """The variants of best error and best cost, each against the baseline in the same setting."""
    if len(view.settings) > MOST_SETTINGS:
        return
    for where, variants in view.settings.items():
        parts = [*_least_error(view, variants), *_cheapest(view, variants)] if len(variants) > 1 else []
        if parts:
            yield f"{f'**{plain(where)}:** ' if where else ''}{' '.join(parts)}"
    others = _other_choices(view)
    if others and view.differences is not None:
        base = plain(level_name(str(view.info.compare_axis), view.info.baseline))
        yield f"Differences and verdicts in these sentences are against {base} at the same {and_list(others)}."


def _least_error(view: View, variants: Sequence[int]) -> Iterator[str]:
    best = _best(view, view.error, variants) if view.error is not None else []
    if view.error is None or not best:
        return
    title = title_of(view.error)
    text = f"{'Highest' if better_of(view.error) == 'higher' else 'Lowest'} mean {title}: {_names(view, best)}"
    text += f" with {value_of(view, best[0], view.error)}{missing(view, (view.error,), variants)}"
    rows = rows_of(view, view.error, view.levels(best[0]))
    yield f"{text} (against the baseline {difference_of(view, rows[0])})." if rows else f"{text}{_base(view, best)}."


def _cheapest(view: View, variants: Sequence[int]) -> Iterator[str]:
    """Which variant is best in which costs, what it saves, and what it costs in error."""
    groups: dict[tuple[int, ...], list[str]] = {}
    for cost in view.costs:
        best = tuple(_best(view, cost, variants))
        if best:
            groups.setdefault(best, []).append(cost)
    for best, costs in groups.items():
        parts = []
        for cost in costs:
            rows = rows_of(view, cost, view.levels(best[0]))
            share = f" ({relative_range(rows)}, {verdict_of(rows[0])})" if rows and relative_range(rows) else ""
            parts.append(title_of(cost) + share)
        told = view.error is None or best[0] in _best(
            view, view.error, variants
        )  # of the best error it is said already
        rows = [] if told else rows_of(view, str(view.error), view.levels(best[0]))
        price = f"; its {title_of(rows[0]['metric'])} {difference_of(view, rows[0])}" if rows else ""
        most = sides_of(costs, "Least", "Most", "Best")
        names = f"{_names(view, best)}{missing(view, costs, variants)}"
        yield f"{most} on average in {and_list(parts)}: {names}{price or _base(view, best)}."


def _base(view: View, variants: Sequence[int]) -> str:
    """Says so where the first of some variants is at the baseline."""
    axis = view.info.compare_axis
    is_base = axis is not None and label_of(view.levels(variants[0])[axis]) == label_of(view.info.baseline)
    if not is_base or len(variants) > 1 or view.differences is None:
        return ""
    return f", with the baseline's {plain(str(axis))}" if _other_choices(view) else ", the baseline"


def _other_choices(view: View) -> list[str]:
    """The axes, other than that of the comparison, along which one would choose."""
    wide = (axis for axis in view.choices if axis.name != view.info.compare_axis and len(axis.levels) > 1)
    return [plain(axis.name) for axis in wide]


def _best(view: View, metric: str, variants: Sequence[int]) -> list[int]:
    """The variants whose mean is best; none if all are equal, be it but for rounding."""
    sign = -1 if better_of(metric) == "higher" else 1
    means = {variant: sign * view.estimate(variant, metric).mean for variant in variants}
    known = merged({variant: mean for variant, mean in means.items() if not math.isnan(mean)})
    if len(set(known.values())) < 2:
        return []
    return [variant for variant, mean in known.items() if mean == min(known.values())]


def _names(view: View, variants: Sequence[int]) -> str:
    left_out = [axis.name for axis in view.conditions]
    names = [f"**{plain(view.name(variant, left_out))}**" for variant in variants[:MOST_NAMES]]
    left = len(variants) - MOST_NAMES
    more = [f"{left} more"] if left > 0 else []
    return and_list([*names, *more]) + (" alike" if len(variants) > 1 else "")


def _pareto(view: View) -> Iterator[str]:
    """The Pareto sets of error and each cost, by the means, within each setting; equal ones are told once."""
    if view.error is None or not any(len(variants) > 1 for variants in view.settings.values()):
        return
    by_text: dict[str, list[str]] = {}
    for cost in view.costs:
        by_text.setdefault(_members(view, cost), []).append(cost)
    for text, costs in by_text.items():
        against = f"each of {and_list(list(map(title_of, costs)))}" if len(costs) > 1 else title_of(costs[0])
        end = sides_of(costs, "least", "best", "best")
        yield f"**Pareto set** of {title_of(view.error)} and {against}, from the best error to the {end} cost: {text}."


def _members(view: View, cost: str) -> str:
    """The members within each setting: `ideal and csma: A → B; lpl: A`."""
    found: dict[str, list[str]] = {}
    for where, variants in view.settings.items():
        text = pareto_chain(view, cost, variants) + rivals(view, cost, variants)
        found.setdefault(text, []).append(bracketed(plain(where)))
    if len(found) == 1:
        return next(iter(found)) + (" in every setting" if len(view.settings) > 1 else "")
    return "; ".join(f"{and_list(places)}: {members}" for members, places in found.items())


def _alone(view: View) -> str:
    """The figures of the only variant."""
    found = ", ".join(f"{title_of(metric)} {value_of(view, view.variants[0], metric)}" for metric in view.compared)
    return (
        f"One variant, nothing to compare it with: {found}." if found else "None of the metrics asked for has figures."
    )
