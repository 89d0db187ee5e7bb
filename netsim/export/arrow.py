"""Events to Arrow tables."""

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
import pyarrow as pa

from netsim.export.selection import Selection
from netsim.export.sheets import Column, Sheet
from netsim.units import NS_PER_S

TIME = "time_s"
TIME_MEANING = (
    "Simulated time at which it was recorded, in seconds; times 1e9 and rounded these are the trace's nanoseconds"
)
_TYPES = {"string": pa.string(), "bool": pa.bool_()}

Gathered = tuple[int, tuple[Any, ...]]
"""An event's time in nanoseconds, and the values of a table's columns in it."""


def schema_of(sheet: Sheet, run: Mapping[str, str]) -> pa.Schema:
    """The columns of a table with what they mean.

    Args:
        sheet: The table.
        run: What was run; goes with the table.
    """
    fields = [pa.field(TIME, pa.float64(), nullable=False, metadata={"meaning": TIME_MEANING})]
    for column in sheet.columns:
        notes = {"meaning": column.meaning}
        fields.append(pa.field(column.name, type_of(column.wire), nullable=column.nullable, metadata=notes))
    return pa.schema(fields, metadata={**run, "row": sheet.title})


def type_of(wire: str) -> pa.DataType:
    """The Arrow type of a wire type."""
    return _TYPES.get(wire) or pa.from_numpy_dtype(np.dtype(wire))


def gathered(sheet: Sheet, event: Any, time_ns: int) -> Gathered:
    """What a table needs of an event."""
    return time_ns, tuple([column.value(event) for column in sheet.columns])


def rows_of(sheet: Sheet, values: Sequence[Any]) -> int:
    """How many rows an event is, from the values of the columns in it."""
    return 1 if sheet.measure is None else len(values[sheet.measure])


def table_of(sheet: Sheet, schema: pa.Schema, events: Sequence[Gathered], selection: Selection) -> pa.Table:
    """The rows that some events are in a table."""
    times_s = np.array([time_ns for time_ns, _ in events], np.int64) / NS_PER_S
    by_column = list(zip(*(values for _, values in events), strict=True))
    if sheet.measure is None:
        columns = [_array(column, values) for column, values in zip(sheet.columns, by_column, strict=True)]
        return pa.Table.from_arrays([pa.array(times_s), *columns], schema=schema)
    event_of = np.repeat(np.arange(len(events)), [rows_of(sheet, values) for _, values in events])
    columns = [
        _joined(column, values) if column.by_row else _array(column, values).take(pa.array(event_of))
        for column, values in zip(sheet.columns, by_column, strict=True)
    ]
    table = pa.Table.from_arrays([pa.array(times_s[event_of]), *columns], schema=schema)
    if sheet.subject != "row" or selection.nodes is None:
        return table
    return table.filter(pa.array(np.isin(table["node"].to_numpy(), list(selection.nodes))))


def _joined(column: Column, parts: Sequence[Any]) -> pa.Array:
    """The rows of all events, one after the other."""
    if column.wire == "string" and not column.codes:
        return pa.array(list(chain.from_iterable(parts)), pa.string())
    return _array(column, np.concatenate([np.asarray(part) for part in parts]))


def _array(column: Column, values: Any) -> pa.Array:
    if column.codes:
        return pa.array(column.codes, pa.string()).take(pa.array(np.asarray(values, np.int64)))
    if column.wire == "bool":
        return pa.array(np.asarray(values) != 0)
    if column.wire == "string" or column.nullable:
        return pa.array(values, type_of(column.wire))
    return pa.array(np.asarray(values, column.wire))
