"""All tables and columns of an export, as Markdown."""

from collections.abc import Iterator

from netsim.export.metric_table import COLUMNS, NAME, TITLE
from netsim.export.sheet_list import SHEETS

_METRIC_TYPES = ("string", "string", "float64", "string")


def markdown_tables() -> str:
    """A section a table: what a row is, and its columns with type and meaning."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    for sheet in SHEETS:
        columns = [(column.name, column.wire, column.meaning) for column in sheet.columns]
        yield from _section(sheet.name, f"{sheet.title} (topic `{sheet.event.topic}`).", columns)
    metrics = [(name, wire, meaning) for (name, meaning), wire in zip(COLUMNS.items(), _METRIC_TYPES, strict=True)]
    yield from _section(NAME, f"{TITLE}.", metrics)


def _section(name: str, title: str, columns: list[tuple[str, str, str]]) -> Iterator[str]:
    yield from (f"### {name}", "", title, "", "| column | type | meaning |", "| --- | --- | --- |")
    for column, wire, meaning in columns:
        told = meaning if meaning.endswith("...") else meaning.removesuffix(".")
        yield f"| `{column}` | {wire} | {told.replace('|', '/')} |"
    yield ""
