"""`netsim schema`."""

import json
import sys
from typing import Any

from netsim.algorithms.registry import SHIPPED
from netsim.reading import OpenTypes, field_reference, json_schema
from netsim.scenario.schema import Scenario
from netsim.study.schema import Study

SCHEMA_ID = "netsim-scenario-1"
STUDY_SCHEMA_ID = "netsim-study-1"
OPEN_TYPES = {
    path: {name: entry.record for name, entry in SHIPPED.items()}
    for path in (("algorithm",), ("nodes", "*", "algorithm"))
}


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
