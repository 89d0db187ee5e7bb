"""`netsim lifetime`."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from netsim.cli.console import say, show
from netsim.metrics.lifetime import Lifetime, spread_of
from netsim.scenario.outlook import Outlook, outlook


def lifetime_command(folder: Path, changes: dict[str, Any]) -> None:
    """Print how long the nodes of a run last, and what that takes for granted."""
    found = outlook(folder, changes)
    table = Table(title=f"lifetime in days: {found.title}", box=box.SIMPLE_HEAD, title_justify="left")
    table.add_column("group")
    headings = ("nodes", "an activity", "between", "first dead", "median", "last dead")
    for name in headings:
        table.add_column(name, justify="right")
    groups: dict[str, list[Lifetime]] = {}
    for each in found.lifetimes:
        groups.setdefault(each.use.group, []).append(each)
    for name, members in groups.items():
        table.add_row(*_row(name, members))
    if len(groups) > 1:
        table.add_section()
        table.add_row(*_row("all", found.lifetimes))
    show(table)
    for line in _milestones(found):
        say(line)
    say("Assumptions:")
    for sentence in found.assumptions:
        say(f"- {sentence}")


def _milestones(found: Outlook) -> Iterator[str]:
    stages = found.milestones
    if stages is None:
        yield "Partition and loss of accuracy: not known, for the folder has no trace.mcap, which tells links and hosts."
        return
    yield f"First node dead: {_or_never(stages.first_dead_days)}"
    yield f"Network falls apart: {_or_never(stages.partition_days)}"
    if found.needed:
        why = f"one of the {found.needed} nodes that the answer needs is dead or cut off"
        yield f"First loss of accuracy ({why}): {_or_never(stages.accuracy_days)}"
    else:
        yield "First loss of accuracy: does not apply; no node hosts a variable of a problem, and there is no sink."


def _or_never(days: float | None) -> str:
    return "never" if days is None else _days(days) + (" days" if days >= 1.0 else "")


def _row(name: str, members: Sequence[Lifetime]) -> tuple[str, ...]:
    activity_j = sum(each.use.activity_j for each in members) / len(members)
    between_mw = sum(each.use.between_mw for each in members) / len(members)
    head = (name, str(len(members)), f"{activity_j:.4g} J", f"{between_mw:.4g} mW")
    spread = spread_of(members)
    if spread is None:
        return (*head, "mains", "mains", "mains")
    first, last = (f"{_days(each.days)} ({each.use.name})" for each in (spread.first, spread.last))
    return (*head, first, _days(spread.median_days), last)


def _days(days: float) -> str:
    if days == math.inf or days >= 1.0:
        return "never" if days == math.inf else f"{days:.4g}"
    hours = 24.0 * days
    return f"{hours:.4g} h" if hours >= 1.0 else f"{3600.0 * hours:.4g} s"
