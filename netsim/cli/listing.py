"""`netsim list`: what comes with netsim, with the source of each part."""

import textwrap
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any, Final, get_args

from rich import box
from rich.table import Table
from rich.text import Text

from netsim.cli.console import WIDTH_ELSEWHERE, say, show
from netsim.cli.sections import Section
from netsim.errors import ScenarioError
from netsim.reading import read_document
from netsim.scenario.sources import everything

PARTS: Final[Mapping[Section, tuple[str, tuple[str, ...]]]] = {
    "algorithms": ("Algorithms (your own: module:Class)", ("algorithm",)),
    "problems": (
        "Problems",
        ("problem", "targets", "target", "track", "events", "measurements", "sensor model", "coverage", "model graph"),
    ),
    "media": (
        "Media",
        ("medium", "reception", "modulation", "shadowing", "hardware variation", "fading", "noise"),
    ),
    "macs": ("Medium access (MAC)", ("MAC", "LoRa airtime")),
    "networks": ("Networks", ("network", "neighbours", "time synchronisation")),
    "nodes": ("Nodes", ("placement", "mobility", "clock", "sensor", "duty cycle", "energy allowance", "lifetime plan")),
    "batteries": ("Batteries", ("battery", "harvester")),
    "devices": (
        "Devices (your own: path of a YAML file)",
        ("radio", "radio energy", "processor", "battery table"),
    ),
    "radios": ("Radios (your own: path of a YAML file)", ("radio", "radio energy")),
    "processors": ("Processors (your own: path of a YAML file)", ("processor",)),
    "faults": ("Faults", ("fault",)),
}
"""Title of each section of models, and which parts stand in it."""

OVERVIEW: Final[tuple[Section, ...]] = tuple(
    section for section in PARTS if section not in ("nodes", "radios", "processors")
)
"""Sections of models of which an overview shows the main parts."""

_DETAILS: Final = {part for _, parts in PARTS.values() for part in parts[1:]} - {"processor", "battery table"}
"""Parts that an overview leaves out."""


def list_command(section: Section | None, *, metrics: bool) -> None:
    """Print one section, or the main parts of all but the metrics.

    Args:
        section: Which; None for an overview.
        metrics: As the section `metrics`.
    """
    if metrics or section == "metrics":
        _print_metrics()
    elif section == "scenarios":
        _print_files("Scenarios: netsim run FILE", "scenario", "description")
    elif section == "studies":
        _print_files("Studies: netsim study FILE", "study", "question")
    elif section is not None:
        title, parts = PARTS[section]
        _print_parts(title, parts)
    else:
        _print_overview()


def _print_overview() -> None:
    for section in OVERVIEW:
        title, parts = PARTS[section]
        main = tuple(part for part in parts if part not in _DETAILS)
        _print_parts(title, main)
        if main != parts:
            _say_wrapped(f"netsim list {section} adds {', '.join(part for part in parts if part in _DETAILS)}", "  ")
            say("")
    _print_files("Scenarios: netsim run FILE", "scenario", "description")
    _print_files("Studies: netsim study FILE", "study", "question")
    _say_wrapped(f"One section in full: netsim list SECTION, one of {', '.join(get_args(Section))}", "")


def scenario_folder() -> Path | None:
    """Where the shipped scenarios are: beside the package in a checkout, inside it when installed."""
    package = Path(__file__).resolve().parent.parent
    candidates = (package.parent / "scenarios", package / "_scenarios")
    return next((folder for folder in candidates if folder.is_dir()), None)


def _print_parts(title: str, parts: tuple[str, ...]) -> None:
    """A table of parts; where there are several, each begins with a line of its own."""
    found = everything()
    table = _table(title, "name", "what it is", "source")
    for part in parts:
        indent = "  " if len(parts) > 1 else ""
        if indent:
            table.add_row(Text(part, style="bold"))
        for source in found[part]:
            table.add_row(*map(Text, (indent + source.name, source.summary, source.citation)))
    show(table)


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left")
    for column in columns:
        table.add_column(Text(column), no_wrap=column in ("name", "unit", "better"), overflow="fold")
    return table


def _print_metrics() -> None:
    from netsim.metrics.catalogue import CATALOGUE

    for group, metrics in groupby(CATALOGUE.values(), key=lambda metric: metric.group):
        table = _table(group.capitalize(), "name", "unit", "better", "what it is [and from which events]")
        for metric in metrics:
            text = Text(metric.definition).append(f" [{metric.source}]", style="dim")
            table.add_row(Text(metric.name), metric.unit, metric.better, text)
        show(table)


def _print_files(title: str, kind: str, key: str) -> None:
    files = list(_shipped_files(kind, key))
    if not files:
        return
    say(f"{title}\n")
    for path, text in files:
        say(f" {path}")
        _say_wrapped(text, "     ")
    say("")


def _say_wrapped(text: str, indent: str) -> None:
    say(textwrap.fill(text, WIDTH_ELSEWHERE, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False))


def _shipped_files(kind: str, key: str) -> Iterator[tuple[Path, str]]:
    """The shipped files of a kind with what they say of themselves."""
    folder = scenario_folder()
    for path in sorted(folder.rglob("*.yaml")) if folder else ():
        try:
            plain: Any = read_document(path).plain()
        except ScenarioError:
            continue
        if isinstance(plain, dict) and plain.get("kind") == kind:
            yield _nearby(path), " ".join(str(plain.get(key, "")).split())


def _nearby(path: Path) -> Path:
    """The path as one would type it from here."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
