"""How figures of runs that are compared, and their differences, are printed."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from netsim.cli.console import WIDTH_UNWRAPPED, show
from netsim.cli.tables import plain_table
from netsim.study.settings import Setting

NAMED = 8
"""So many names are told where there are more."""


def show_settings(title: str, settings: Sequence[Setting], names: Sequence[str]) -> None:
    """A table of what differs, one column a run; nothing if nothing does."""
    if settings:
        table = plain_table(title, ("", *names), ())
        for setting in settings:
            table.add_row(setting.path, *setting.values)
        show(table, WIDTH_UNWRAPPED)


def listed(names: Iterable[str]) -> str:
    """Some names, and how many more there are."""
    every = list(names)
    more = f" and {len(every) - NAMED} more" if len(every) > NAMED else ""
    return ", ".join(every[:NAMED]) + more


def figure(value: Any) -> str:
    """A figure as it is printed: counts whole, others to six digits."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int) else f"{value:.6g}" if isinstance(value, float) else str(value)


def signed(value: float | None) -> str:
    """A difference with its sign."""
    if value is None or math.isnan(value):
        return "-"
    return "0" if value == 0 else f"{value:+,}" if isinstance(value, int) else f"{value:+.4g}"


def share(value: float | None) -> str:
    """A relative difference in percent."""
    if value is None or math.isnan(value):
        return "-"
    return "0 %" if value == 0 else f"{100 * value:+.3g} %" if math.isfinite(value) else "from 0"


def metric_label(metric: str, unit: str) -> str:
    """A metric, with its unit where its name does not end in it."""
    return (
        metric if unit in ("", "1") or metric.partition(".")[0].endswith(f"_{unit.lower()}") else f"{metric} ({unit})"
    )
