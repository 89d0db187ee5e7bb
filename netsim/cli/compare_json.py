"""Comparisons as JSON."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from netsim.study.compare import Comparison, Row
from netsim.study.contender import Contender
from netsim.study.gate import Judgement
from netsim.study.settings import Setting
from netsim.trace.divergence import Divergence, Recorded


def plain_number(value: Any) -> Any:
    """A figure as JSON has it: what is not finite becomes a text."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def plain_settings(settings: Sequence[Setting] | None) -> Any:
    """What differs, for JSON."""
    return None if settings is None else [{"path": each.path, "values": list(each.values)} for each in settings]


def plain_gates(verdicts: Sequence[tuple[str, Judgement]]) -> list[dict[str, Any]]:
    """What gates say, for JSON."""
    return [
        {
            "run": name,
            "expression": each.expression,
            "failed": each.failed,
            "unjudged": each.unjudged or None,
            "values": {metric: plain_number(value) for metric, value in each.values.items()},
        }
        for name, each in verdicts
    ]


def plain_comparison(comparison: Comparison, verdicts: Sequence[tuple[str, Judgement]]) -> Mapping[str, Any]:
    """A comparison of runs, for JSON."""
    return {
        "runs": [run.name for run in comparison.runs],
        "scenarios": plain_settings(comparison.settings),
        "versions": plain_settings(comparison.versions),
        "metrics": {row.metric: _plain_row(row) for row in comparison.rows},
        "lists": comparison.lists,
        "partings": [
            _plain_parting(*each)
            for each in zip(comparison.runs[1:], comparison.partings, comparison.traced, strict=True)
        ],
        "gates": plain_gates(verdicts),
    }


def _plain_row(row: Row) -> Mapping[str, Any]:
    return {
        "unit": row.unit,
        "values": [plain_number(value) for value in (row.first, *(held.value for held in row.others))],
        "difference": [plain_number(held.difference) for held in row.others],
        "relative": [plain_number(held.relative) for held in row.others],
    }


def _plain_parting(run: Contender, parting: Divergence | None, traced: bool) -> Mapping[str, Any]:
    if not traced:
        return {"run": run.name, "traces": "missing"}
    if parting is None:
        return {"run": run.name, "traces": "equal"}
    first, second = map(_plain_event, (parting.first, parting.second))
    fields = [each.name for each in parting.differences]
    return {
        "run": run.name,
        "traces": "part",
        "common": parting.common,
        "first": first,
        "second": second,
        "fields": fields,
    }


def _plain_event(recorded: Recorded | None) -> Mapping[str, Any] | None:
    return None if recorded is None else {"time_ns": recorded.time_ns, "topic": recorded.event.topic}
