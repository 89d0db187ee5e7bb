"""The figures of a run, which its trace carries, as rows: name, item, value."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from netsim.errors import TraceError
from netsim.trace.reader import trace_attachments

METRICS_FILE = "metrics.json"
NAME = "metrics"
TITLE = "A figure of the whole run, whatever part is exported; what they mean: docs/metrics.md"
COLUMNS = {
    "metric": "Name of the figure, with its unit",
    "item": "Of which node, message kind, round, ... it is; empty for the whole run",
    "value": "The figure; missing where it is a text, or could not be had",
    "text": "The figure where it is a text; else missing",
}

Row = tuple[str, str, float | None, str | None]


def metric_rows(trace: Path) -> list[Row]:
    """The figures of a run; none where the run did not come to its end.

    Raises:
        TraceError: If the trace, or the figures in it, cannot be read.
    """
    content = trace_attachments(trace).get(METRICS_FILE, b"{}")
    try:
        figures = json.loads(content)
    except ValueError as error:
        msg = f"{trace}: its {METRICS_FILE} is damaged: {error}"
        raise TraceError(msg) from error
    return [row for name, value in figures.items() for row in _rows(name, (), value)]


def _rows(name: str, place: tuple[str, ...], value: Any) -> Iterator[Row]:
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, part in items:
            yield from _rows(name, (*place, str(key)), part)
    elif isinstance(value, str):
        yield name, ".".join(place), None, value
    else:
        yield name, ".".join(place), None if value is None else float(value), None
