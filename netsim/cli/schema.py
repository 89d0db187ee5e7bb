"""`netsim schema`."""

import json
import sys

from netsim.algorithms.registry import SHIPPED
from netsim.reading import field_reference, json_schema
from netsim.scenario.schema import Scenario

SCHEMA_ID = "netsim-scenario-1"
OPEN_TYPES = {
    path: {name: entry.record for name, entry in SHIPPED.items()}
    for path in (("algorithm",), ("nodes", "*", "algorithm"))
}


def schema_command(reference: bool) -> None:
    """Print the schema, or the field reference as a Markdown table."""
    sys.stdout.write(reference_text() if reference else schema_text())


def schema_text() -> str:
    """The JSON Schema of scenario files."""
    schema = json_schema(Scenario, "netsim scenario", SCHEMA_ID, OPEN_TYPES)
    return json.dumps(schema, indent=2) + "\n"


def reference_text() -> str:
    """Every field of a scenario as a Markdown table."""
    lines = ["| field | type | default | range | meaning |", "| --- | --- | --- | --- | --- |"]
    for row in field_reference(Scenario, OPEN_TYPES):
        cells = (f"`{row.path}`", row.type, row.default, row.range, row.description)
        lines.append("| " + " | ".join(_cell(cell) for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(text: object) -> str:
    return " ".join(str(text).split()).replace("|", "\\|")
