"""The tables of a report."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import metric_of
from netsim.study.differences import EQUAL, HIGHER, LOWER
from netsim.study.levels import label_of
from netsim.study.reporting.blocks import Table, code, plain, prose
from netsim.study.reporting.names import bounds_of, title_of, title_with
from netsim.study.reporting.numbers import decimals_of, number, percent, signed, with_half
from netsim.study.reporting.phrases import Row, decided
from netsim.study.reporting.view import View
from netsim.study.reporting.winners import clear_winners
from netsim.study.samples import quantile
from netsim.study.statistics import published_table

METRICS_A_TABLE = 5
"""So many metrics stand side by side, and fit on a page."""
DIFFERENCES_A_TABLE = 4
"""Likewise, paired differences, which are longer."""
MOST_ROWS = 60
"""So many variants are listed."""
MOST_DIFFERENCES = 48
"""So many paired differences are listed, a row each."""


def result_tables(view: View) -> Iterator[Table]:
    """Mean and interval of each metric by variant, a few metrics a table."""
    parts = _parts(tuple(dict.fromkeys((*view.compared, *view.metrics))))
    for place, metrics in enumerate(parts):
        yield _result_table(view, metrics, is_last=place == len(parts) - 1)


def difference_tables(view: View) -> Iterator[Table]:
    """Paired differences against the baseline of error and costs, a few metrics a table."""
    parts = _parts(view.compared, DIFFERENCES_A_TABLE)
    for place, metrics in enumerate(parts):
        table = _difference_table(view, metrics, is_last=place == len(parts) - 1)
        if table is not None:
            yield table


def _parts(metrics: Sequence[str], most: int = METRICS_A_TABLE) -> list[Sequence[str]]:
    """Metrics in lots of about one size, small enough for a table."""
    count = math.ceil(len(metrics) / most)
    size = math.ceil(len(metrics) / count) if count else 1
    return [metrics[first : first + size] for first in range(0, len(metrics), size)]


def published(view: View) -> Table | None:
    """Published figures beside the measured ones."""
    rows = published_table(view.info, view.summary).to_dict("records")
    if not rows:
        return None
    header = ("metric", "at", "published", "measured", "difference in SE", "n", "source", "note")
    caption = (
        "Published: value ± its standard error, where that is known. Measured: mean ± standard error (not the interval). "
        "Difference: in standard errors of the difference; the two agree where it is within the bound in brackets, "
        "Student's t at 95 % for n − 1 degrees of freedom. Where the published figure has none, in those of the measured "
        "one alone, which makes it look larger than it is."
    )
    return Table(header, tuple(map(_published_row, rows)), 2, 2, caption)


def lifetimes(view: View) -> Table | None:
    """The days of a duty plan, by variant."""
    if not view.lifetimes or not view.variants:
        return None
    header = (*_head(view), *(title_with(name, "days") for name in view.lifetimes))
    rows = tuple(
        (*_levels(view, number), *(_days(view, number, name) for name in view.lifetimes)) for number in view.variants
    )
    caption = (
        "Mean ± half of the 95 % interval over the trials in which it happens. Extrapolated from the run by the scenario's "
        "`duty_plan`, not simulated; “never” where nobody's battery runs down to that."
    )
    return Table(header, rows[:MOST_ROWS], 1 + len(view.info.axes), caption=caption)


def definitions(view: View) -> Table:
    """What the metrics shown are."""
    rows = []
    for name in view.shown:
        try:
            known = metric_of(name)
        except ScenarioError:
            rows.append((code(name), "", "", "Recorded by the algorithm; not in the catalogue of metrics."))
            continue
        unit = "–" if known.unit in ("1", "") else known.unit
        rows.append((code(name), unit, known.better, prose(f"{known.definition} Made of: {known.source}.")))
    return Table(("metric", "unit", "better", "definition"), tuple(rows), 4)


def failures(view: View, most: int = 20) -> Table | None:
    """The trials that failed, with the commands that reproduce them."""
    trials = view.results.trials
    rows = trials[trials["status"] != "ok"].to_dict("records")
    if not rows:
        return None
    shown = tuple(
        (
            str(row["trial"]),
            plain(view.name(row["variant"])),
            str(row["repetition"]),
            plain(row["error"]),
            code(row["command"]),
        )
        for row in rows[:most]
    )
    left = f" {len(rows) - most} more failed; see results.csv." if len(rows) > most else ""
    header = ("trial", "variant", "repetition", "error", "command")
    return Table(header, shown, 5, caption=f"The commands are to be typed in the study's folder.{left}")


def _result_table(view: View, metrics: Sequence[str], *, is_last: bool) -> Table:
    best = {metric: clear_winners(view, metric) for metric in metrics}
    chosen = _chosen(view)
    header = (*_head(view), "n", *(title_with(metric, view.scale(metric).unit) for metric in metrics))
    rows = []
    for variant in chosen:
        trials = max((view.estimate(variant, metric).n for metric in metrics), default=0)
        cells = [_cell(view, variant, metric, trials, variant in best[metric]) for metric in metrics]
        rows.append((*_levels(view, variant), str(trials), *cells))
    caption = _result_caption(view, len(chosen)) if is_last else ""
    return Table(header, tuple(rows), 1 + len(view.info.axes), caption=caption)


def _result_caption(view: View, shown: int) -> str:
    text = "Mean ± half of the 95 % t interval over n trials"
    text += "." if len(view.info.repetitions) > 1 else "; with one repetition there is no interval."
    if len(view.info.repetitions) > 1 and len(view.variants) > 1:
        where = " of its setting" if view.conditions else ""
        text += (
            f" **Bold**: better than every other variant{where}, the interval of each paired difference excludes 0 even "
            "after Holm's adjustment; nothing is bold where a trial lacks the figure."
        )
    if _is_any_wide(view):
        text += (
            " Where an interval is wider than its mean, the repetitions do not tell even the mean's order of magnitude."
        )
    if shown < len(view.variants):
        text += f" {shown} of {len(view.variants)} variants: the baseline and the Pareto sets first; all are in summary.csv."
    return text


def _is_any_wide(view: View) -> bool:
    """Whether any interval of what cannot be negative reaches below 0."""
    shown = {name for name in (*view.compared, *view.metrics) if bounds_of(name)[0] == 0.0}
    return any(found.half > found.mean for (_, name), found in view.estimates.items() if name in shown)


def _chosen(view: View) -> list[int]:
    """The variants to list: all, or if they are too many those that matter most."""
    if len(view.variants) <= MOST_ROWS:
        return list(view.variants)
    axis, base = view.info.compare_axis, label_of(view.info.baseline)
    first = [number for number in view.variants if axis is not None and label_of(view.levels(number)[axis]) == base]
    members = [
        number for cost in view.costs for variants in view.settings.values() for number in view.pareto(cost, variants)
    ]
    order = dict.fromkeys((*members, *first, *view.variants))
    return sorted(list(order)[:MOST_ROWS])


def _cell(view: View, variant: int, metric: str, trials: int, is_best: bool) -> str:
    found = view.estimate(variant, metric)
    text = with_half(found.mean, found.half, view.scale(metric))
    text = f"**{text}**" if is_best else text
    return f"{text} (n = {found.n})" if 0 < found.n < trials else text


def _difference_table(view: View, metrics: Sequence[str], *, is_last: bool) -> Table | None:
    axis = view.info.compare_axis
    if view.differences is None or axis is None:
        return None
    others = [name for name in view.info.axis_names if name != axis]
    cells: dict[tuple[str, ...], dict[str, str]] = {}
    for row in view.differences.to_dict("records"):
        if row["metric"] in metrics:
            key = (*(plain(label_of(row[name])) for name in others), plain(label_of(row[axis])))
            cells.setdefault(key, {})[row["metric"]] = _difference(view, row)
    rows = tuple((*key, *(found.get(metric, "–") for metric in metrics)) for key, found in cells.items())
    header = (*map(plain, [*others, axis]), *(title_with(metric, view.scale(metric).unit) for metric in metrics))
    base = f"{plain(axis)} {plain(label_of(view.info.baseline))}"
    caption = (
        f"Difference from {base} within repetitions ± half of its 95 % t interval, and relative to the baseline's mean. "
        "**Bold**: other than 0, even after Holm's adjustment for all comparisons of the metric."
    )
    if len(rows) > MOST_DIFFERENCES:
        caption += f" {MOST_DIFFERENCES} of {len(rows)} rows; all are in differences.csv."
    return Table(header, rows[:MOST_DIFFERENCES], len(others) + 1, caption=caption if is_last else "")


def _difference(view: View, row: Row) -> str:
    if row["n"] == 0:
        return "–"
    if row["verdict"] == EQUAL:
        return "equal"
    half = (float(row["high"]) - float(row["low"])) / 2
    text = with_half(float(row["difference"]), half, view.scale(row["metric"]), sign=True)
    text = f"**{text}**" if decided(row) in (LOWER, HIGHER) else text
    relative = percent(float(row["relative"]))
    return f"{text} ({relative})" if relative else text


def _published_row(row: dict[Any, Any]) -> tuple[str, ...]:
    decimals = decimals_of(float(row["se"]))
    known = not math.isnan(row["published_se"])
    value = number(float(row["published"]), digits=6)
    return (
        plain(title_of(row["metric"])),
        plain(row["levels"] or row["at"]) or "everywhere",
        f"{value} ± {number(float(row['published_se']), digits=2)}" if known else value,
        f"{number(float(row['measured']), decimals)} ± {number(float(row['se']), decimals)}" if row["n"] > 1
        else number(float(row["measured"])),
        _apart(float(row["z"]), int(row["n"])),
        str(row["n"]),
        plain(row["source"]),
        plain(row["note"]),
    )  # fmt: skip


def _apart(z: float, n: int) -> str:
    """A difference in standard errors, and the bound within which two figures agree."""
    shown = signed(z, 1)
    return f"{shown} (±{number(quantile(n - 1), 1)})" if n > 1 and math.isfinite(z) else shown


def _days(view: View, variant: int, name: str) -> str:
    trials = view.ended[view.ended["variant"] == variant]
    found = view.estimate(variant, name)
    if found.n == 0:
        return "never"
    text = with_half(found.mean, found.half, view.scale(name))
    return text if found.n == len(trials) else f"{text} (in {found.n} of {len(trials)}, else never)"


def _head(view: View) -> tuple[str, ...]:
    return ("variant", *map(plain, view.info.axis_names))


def _levels(view: View, variant: int) -> tuple[str, ...]:
    levels = view.levels(variant)
    return (str(variant), *(plain(label_of(levels[axis])) for axis in view.info.axis_names))
