"""`netsim list` and `netsim schema`."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from netsim.algorithms.registry import SHIPPED
from netsim.cli.console import say, show
from netsim.errors import ScenarioError
from netsim.models.device_tables import shipped
from netsim.reading import OpenTypes, field_reference, json_schema, read_document
from netsim.scenario.schema import Scenario
from netsim.study.schema import Study

SCHEMA_ID = "netsim-scenario-1"
STUDY_SCHEMA_ID = "netsim-study-1"
OPEN_TYPES = {
    path: {name: entry.record for name, entry in SHIPPED.items()}
    for path in (("algorithm",), ("nodes", "*", "algorithm"))
}


def list_command() -> None:
    """Print what is shipped."""
    algorithms = _table("Algorithms (your own: module:Class)", "name", "what it does", "source")
    for entry in SHIPPED.values():
        algorithms.add_row(entry.name, entry.summary, entry.citation)
    show(algorithms)
    devices = _table("Devices (your own: path of a YAML file)", "kind", "names")
    for kind in ("radios", "cpus", "batteries"):
        devices.add_row(kind, ", ".join(shipped(kind)))
    show(devices)
    say("Scenarios\n")
    for path, description in _scenarios():
        say(f" {path}")
        say(f"     {description}")


def schema_command(reference: bool, study: bool) -> None:
    """Print the schema, or the field reference as a Markdown table; of study files instead of scenario files."""
    if study:
        sys.stdout.write(_reference(Study, {}) if reference else study_schema_text())
    else:
        sys.stdout.write(reference_text() if reference else schema_text())


def study_schema_text() -> str:
    """The JSON Schema of study files."""
    return json.dumps(json_schema(Study, "netsim study", STUDY_SCHEMA_ID, {}), indent=2) + "\n"


def schema_text() -> str:
    """The JSON Schema of scenario files."""
    schema = json_schema(Scenario, "netsim scenario", SCHEMA_ID, OPEN_TYPES)
    return json.dumps(schema, indent=2) + "\n"


def reference_text() -> str:
    """Every field of a scenario as a Markdown table."""
    return _reference(Scenario, OPEN_TYPES)


def _reference(record: type[Any], open_types: OpenTypes) -> str:
    lines = ["| field | type | default | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for row in field_reference(record, open_types):
        cells = (f"`{row.path}`", row.type, row.default, row.range, row.description)
        lines.append("| " + " | ".join(_cell(cell) for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(text: object) -> str:
    return " ".join(str(text).split()).replace("|", "\\|")


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left")
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def scenario_folder() -> Path | None:
    """Where the shipped scenarios are: beside the package in a checkout, inside it when installed."""
    package = Path(__file__).resolve().parent.parent
    candidates = (package.parent / "scenarios", package / "_scenarios")
    return next((folder for folder in candidates if folder.is_dir()), None)


def _scenarios() -> Iterator[tuple[Path, str]]:
    folder = scenario_folder()
    for path in sorted(folder.rglob("*.yaml")) if folder else ():
        try:
            plain = read_document(path).plain()
        except ScenarioError:
            continue
        if isinstance(plain, dict) and plain.get("kind") == "scenario":
            yield _nearby(path), " ".join(str(plain.get("description", "")).split())


def _nearby(path: Path) -> Path:
    """The path as one would type it from here."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
