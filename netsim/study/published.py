"""Published figures beside the measured ones."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from netsim.study.info import PublishedInfo, StudyInfo
from netsim.study.levels import at, words

COLUMNS = (
    *("metric", "at", "published", "published_se", "variant", "levels"),
    *("measured", "n", "se", "low", "high", "z", "source", "note"),
)


def published_table(info: StudyInfo, summary: pd.DataFrame) -> pd.DataFrame:
    """Each published figure beside what was measured at the levels it is given for.

    Args:
        info: The study.
        summary: What `aggregate` gave, with the metrics published.

    Returns:
        A row for each published figure and variant at its levels (one without a variant if there is none): `metric`, `at`
        (the levels it is given for, in words), `published`, `published_se`, `variant`, `levels` (all of the variant's, in
        words), `measured` (the mean), `n`, `se`, `low`, `high`, `z` (measured less published in standard errors of this
        difference: from both if the published one is known, else from the measured one alone, which makes z too large),
        `source`, `note`.
    """
    rows = [row for figure in info.published for row in _rows(figure, summary, info.axis_names)]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    return table.astype({"variant": "Int64", "n": int, "published_se": float})


def z_score(measured: float, se: float, published: float, published_se: float | None) -> float:
    """How many standard errors a measured mean lies above a published figure; NaN without a standard error."""
    both = math.hypot(se, published_se or 0.0)
    return (measured - published) / both if both > 0 else math.nan


def _rows(figure: PublishedInfo, summary: pd.DataFrame, axes: list[str]) -> Iterator[dict[str, Any]]:
    rows = summary[summary["metric"] == figure.metric]
    found = rows[at(rows, figure.at)].to_dict("records")
    for row in found:
        levels = words({axis: row[axis] for axis in axes})
        yield {**_head(figure), "variant": row["variant"], "levels": levels, **_measured(row, figure)}
    if not found:
        nothing = dict.fromkeys(("measured", "se", "low", "high", "z"), math.nan)
        yield {**_head(figure), "variant": None, "levels": "", "n": 0, **nothing}


def _measured(row: Mapping[Any, Any], figure: PublishedInfo) -> dict[str, Any]:
    z = z_score(row["mean"], row["se"], figure.value, figure.standard_error)
    return {"measured": row["mean"], **{name: row[name] for name in ("n", "se", "low", "high")}, "z": z}


def _head(figure: PublishedInfo) -> dict[str, Any]:
    return {
        "metric": figure.metric,
        "at": words(figure.at),
        "published": figure.value,
        "published_se": figure.standard_error,
        "source": figure.source,
        "note": figure.note,
    }
