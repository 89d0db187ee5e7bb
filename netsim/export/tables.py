"""Tables of a trace: one file a table, of those that have rows. What is common to all forms of tables."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import pyarrow as pa

from netsim.export.arrow import Gathered, gathered, rows_of, schema_of, table_of
from netsim.export.job import Job
from netsim.export.metric_table import COLUMNS, NAME, TITLE, Row, metric_rows
from netsim.export.selection import Selection
from netsim.export.sheet_list import SHEETS
from netsim.export.sheets import Sheet
from netsim.trace.events import Event
from netsim.trace.reader import trace_metadata
from netsim.trace.recorder import Handler

_ROWS = 1 << 16
_EVENTS = 1 << 13
"""So many rows or events are kept until they are written."""


class Writer(Protocol):
    """Writes one table to a file."""

    def write(self, table: pa.Table) -> None:
        """Append rows."""
        ...

    def close(self) -> None:
        """No more rows come."""
        ...


Open = Callable[[Path, pa.Schema], Writer]
"""Opens a file for a table with these columns; the name has no ending yet."""


class Tables:
    """Writes the tables of a trace into a folder.

    Args:
        folder: Where to; it exists.
        job: What is exported.
        open_table: How a table is written.

    Raises:
        TraceError: If the trace cannot be read.
    """

    def __init__(self, folder: Path, job: Job, open_table: Open) -> None:
        self._folder = folder
        self._job = job
        self._open_table = open_table
        run = trace_metadata(job.trace)
        self._pages = [_Page(sheet, run, job.selection, self._open) for sheet in SHEETS]

    def handlers(self) -> Mapping[type[Event], Handler]:
        """It reads everything."""
        pages: dict[type[Event], list[_Page]] = {}
        for page in self._pages:
            pages.setdefault(page.sheet.event, []).append(page)
        return {event_type: _adding(here) for event_type, here in pages.items()}

    def close(self) -> None:
        """Write what is left, and the figures of the run."""
        for page in self._pages:
            page.close()
        rows = metric_rows(self._job.trace)
        if rows:
            self._write_metrics(rows)

    def abort(self) -> None:
        """Close the files as they are."""
        for page in self._pages:
            page.abort()

    def _write_metrics(self, rows: Sequence[Row]) -> None:
        schema = _metric_schema()
        arrays = [pa.array(values, field.type) for values, field in zip(zip(*rows, strict=True), schema, strict=True)]
        writer = self._open(NAME, schema)
        writer.write(pa.Table.from_arrays(arrays, schema=schema))
        writer.close()

    def _open(self, name: str, schema: pa.Schema) -> Writer:
        return self._open_table(self._folder / name, schema)


class _Page:
    """One table on its way: events are gathered, and written many at a time."""

    def __init__(
        self, sheet: Sheet, run: Mapping[str, str], selection: Selection, open_table: Callable[[str, pa.Schema], Writer]
    ) -> None:
        self.sheet = sheet
        self._schema = schema_of(sheet, run)
        self._selection = selection
        self._open_table = open_table
        self._writer: Writer | None = None
        self._events: list[Gathered] = []
        self._rows = 0

    def add(self, event: Event, time_ns: int) -> None:
        if not self.sheet.has(event, self._selection):
            return
        found = gathered(self.sheet, event, time_ns)
        self._events.append(found)
        self._rows += rows_of(self.sheet, found[1])
        if self._rows >= _ROWS or len(self._events) >= _EVENTS:
            self._write()

    def close(self) -> None:
        if self._events:
            self._write()
        if self._writer is not None:
            self._writer.close()

    def abort(self) -> None:
        if self._writer is not None:
            self._writer.close()

    def _write(self) -> None:
        table = table_of(self.sheet, self._schema, self._events, self._selection)
        self._events, self._rows = [], 0
        if not table.num_rows:
            return
        if self._writer is None:
            self._writer = self._open_table(self.sheet.name, self._schema)
        self._writer.write(table)


def _adding(pages: list[_Page]) -> Handler:
    def add(event: Event, time_ns: int) -> None:
        for page in pages:
            page.add(event, time_ns)

    return add


def _metric_schema() -> pa.Schema:
    types = (pa.string(), pa.string(), pa.float64(), pa.string())
    fields = [
        pa.field(name, kind, metadata={"meaning": meaning})
        for (name, meaning), kind in zip(COLUMNS.items(), types, strict=True)
    ]
    return pa.schema(fields, metadata={"row": TITLE})
