"""Tables: each row and type of a hand-made trace, in CSV and in Parquet; what filters leave; a row for every event."""

import csv
import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.export import Job, Selection, export
from netsim.export.arrow import gathered, schema_of, table_of, type_of
from netsim.export.sheet_document import markdown_tables
from netsim.export.sheet_list import SHEETS
from netsim.trace import events as e
from netsim.trace.cdr import wire_types
from netsim.trace.events import BROADCAST, EVENT_TYPES, OUTCOME_CODE, Event
from netsim.trace.writer import Attachment, TraceWriter

DOCUMENT = Path(__file__).parents[2] / "docs" / "export.md"
NS = 1_000_000_001
RECEIVED, COLLIDED = OUTCOME_CODE["received"], OUTCOME_CODE["collided"]
ROWS: list[tuple[int, Event]] = [
    (0, e.NodeTable([1, 2], ["a", "b, c"], ["g", "g"], ["sink", "sensor"], [0.0, 3.5], [1.0, 2.0], ["r", "r"],
                    ["p", "p"], [math.inf, 12.5])),
    (5, e.MessageSent(7, 1, BROADCAST, "map", 40, 2, [3, 5])),
    (6, e.MessageSent(8, 2, 1, "say \"hi\"", 0, 1, [])),
    (NS, e.Frame(1, 10, NS, 1, BROADCAST, "map", 0, 60, 0, 7, -3.0, [2, 4], [RECEIVED, COLLIDED], [-60.5, -80.25],
                 [10.0, math.inf])),
    (NS, e.Frame(2, 20, NS, 2, 1, "say", 1, 5, 1, 8, 0.0, [], [], [], [])),
    (NS, e.NodeEnergy([1, 2], [0.5, 0.25], [math.inf, 12.25])),
    (NS, e.GraphMessages(2, 3, [4], [5], [1], 9, 0.125, 1, 0)),
    (NS, e.GraphMessages(1, 3, [], [], [], 2, 0.0, 1, 0)),
    (2 * NS, e.Estimate(2, 0, 1.5, 2.5, [1.0, 0.5, 2.0])),
    (2 * NS, e.Estimate(1, 0, 1.0, 2.0, [], 1)),
    (2 * NS, e.Particles(1, 4, [0, 9], 100, [0.25, 0.75], [1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0])),
    (3 * NS, e.Association(2, [3, -1], 6)),
    (3 * NS, e.RadioState(2, 1)),
    (3 * NS, e.Log(3, 3, 3, "careful", "b", "", 0)),
]  # fmt: skip
METRICS = {"scenario": "t", "frames": 2, "frames_by_kind": {"map": 1}, "senders_by_round": [4, 5], "error": None}


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    attached = Attachment("metrics.json", "application/json", json.dumps(METRICS).encode())
    with TraceWriter(tmp_path / "t.mcap", {"seed": "3"}, [attached]) as writer:
        for time_ns, event in ROWS:
            writer.write(event, time_ns)
    return tmp_path / "t.mcap"


def columns(trace: Path, **selection: Any) -> dict[str, dict[str, list[Any]]]:
    """The tables of an export in Parquet, by name and column."""
    out = trace.with_suffix(".tables")
    export(Job(trace=trace, selection=Selection(**selection)), {"parquet": out}, force=True)
    return {path.stem: pq.read_table(path).to_pydict() for path in sorted(out.iterdir())}


def test_every_row_is_there_with_its_values(trace: Path) -> None:
    got = columns(trace)
    assert set(got) == {
        "nodes", "messages_sent", "message_causes", "frames", "receptions", "node_energy", "graph_rounds",
        "graph_messages", "estimates", "particles", "associations", "radio_states", "log", "metrics",
    }  # fmt: skip
    at, later, last = 1.000000001, 2.000000002, 3.000000003
    assert got["frames"] == {
        "time_s": [at, at], "frame_id": [1, 2], "t_start_ns": [10, 20], "t_end_ns": [NS, NS], "source": [1, 2],
        "destination": [BROADCAST, 1], "kind": ["map", "say"], "is_ack": [False, True], "size_byte": [60, 5],
        "attempt": [0, 1], "message_id": [7, 8], "tx_power_dbm": [-3.0, 0.0], "is_strobe": [False, False],
    }  # fmt: skip
    assert got["receptions"] == {
        "time_s": [at, at], "frame_id": [1, 1], "node": [2, 4], "outcome": ["received", "collided"],
        "rssi_dbm": [-60.5, -80.25], "sinr_db": [10.0, math.inf],
    }  # fmt: skip
    assert got["message_causes"] == {"time_s": [5e-9, 5e-9], "message_id": [7, 7], "cause": [3, 5]}
    assert got["nodes"]["name"] == ["a", "b, c"]
    assert got["nodes"]["battery_j"] == [math.inf, 12.5]
    assert got["node_energy"] == {
        "time_s": [at, at], "node": [1, 2], "consumed_j": [0.5, 0.25], "left_j": [math.inf, 12.25]
    }  # fmt: skip
    assert got["graph_rounds"]["computed"] == [9, 2]
    assert got["graph_messages"] == {
        "time_s": [at], "node": [2], "round": [3], "source_variable": [4], "destination_variable": [5], "over_air": [True]
    }  # fmt: skip
    assert got["estimates"] == {
        "time_s": [later, later], "node": [2, 1], "track": [0, 0], "thread": [0, 1], "x_m": [1.5, 1.0], "y_m": [2.5, 2.0],
        "covariance_xx_m2": [1.0, None], "covariance_xy_m2": [0.5, None], "covariance_yy_m2": [2.0, None],
    }  # fmt: skip
    assert got["particles"] == {
        "time_s": [later] * 4, "node": [1] * 4, "step": [4] * 4, "track": [0, 0, 9, 9], "particle": [0, 1, 0, 1],
        "weight": [0.25, 0.75, 0.25, 0.75], "x_m": [1.0, 2.0, 3.0, 4.0], "y_m": [5.0, 6.0, 7.0, 8.0],
    }  # fmt: skip
    assert got["associations"]["measurement"] == [0, 1]
    assert got["associations"]["target"] == [3, -1]
    assert got["radio_states"] == {"time_s": [last], "node": [2], "state": ["sleep"]}
    assert got["log"] == {"time_s": [last], "level": ["warning"], "name": ["b"], "message": ["careful"]}
    assert list(zip(*got["metrics"].values(), strict=True)) == [
        ("scenario", "", None, "t"), ("frames", "", 2.0, None), ("frames_by_kind", "map", 1.0, None),
        ("senders_by_round", "0", 4.0, None), ("senders_by_round", "1", 5.0, None), ("error", "", None, None),
    ]  # fmt: skip


def test_csv_says_the_same(trace: Path, tmp_path: Path) -> None:
    export(Job(trace=trace), {"csv": tmp_path / "c", "parquet": tmp_path / "p"})
    assert {path.stem for path in (tmp_path / "c").iterdir()} == {path.stem for path in (tmp_path / "p").iterdir()}
    for path in (tmp_path / "c").iterdir():
        with path.open(encoding="utf-8", newline="") as stream:
            names, *lines = csv.reader(stream)
        table = pq.read_table(tmp_path / "p" / f"{path.stem}.parquet").to_pydict()
        assert names == list(table)
        rows = list(zip(*table.values(), strict=True))
        assert len(lines) == len(rows)
        for line, row in zip(lines, rows, strict=True):
            assert [typed(text, value) for text, value in zip(line, row, strict=True)] == list(row)


def typed(text: str, like: Any) -> Any:
    """A value of a CSV file, read as a value like another one."""
    if like is None:
        return None if text == "" else text
    if isinstance(like, bool):
        return {"true": True, "false": False}[text]
    return type(like)(text)


def test_filters(trace: Path) -> None:
    got = columns(trace, nodes={2}, start_ns=6)
    assert got["nodes"]["node"] == [1, 2]  # whoever takes part is told whatever is chosen
    assert got["frames"]["frame_id"] == [1, 2]  # the first one is a broadcast that it received
    assert got["messages_sent"]["message_id"] == [8]
    assert got["node_energy"]["node"] == [2]
    assert got["graph_rounds"]["node"] == [2]
    assert "particles" not in got
    assert columns(trace, kinds={"map"})["frames"]["frame_id"] == [1]
    assert set(columns(trace, start_ns=3 * NS)) == {"nodes", "associations", "radio_states", "log", "metrics"}
    assert set(columns(trace, end_ns=6)) == {"nodes", "messages_sent", "message_causes", "metrics"}


def test_every_column_says_what_it_means(trace: Path, tmp_path: Path) -> None:
    export(Job(trace=trace), {"parquet": tmp_path / "p"})
    schema = pq.read_schema(tmp_path / "p" / "receptions.parquet")
    assert schema.metadata[b"seed"] == b"3"
    assert schema.field("rssi_dbm").metadata == {b"meaning": b"Received power in dBm"}
    for sheet in SHEETS:
        assert all(len(column.meaning) > 3 for column in sheet.columns), sheet.name
        assert sheet.title
        names = [column.name for column in sheet.columns]
        assert len({"time_s", *names}) == len(names) + 1, sheet.name


def example(event_type: type[Event], count: int) -> Event:
    """An event whose sequences have so many elements."""
    made: dict[str, Any] = {}
    for name, wire in wire_types(event_type).items():
        is_text = wire.startswith("string")
        made[name] = (["x"] if is_text else [1]) * count if wire.endswith("[]") else "x" if is_text else 1
    if event_type is e.Particles:
        made |= {"target": [1], "weight": [1.0] * count, "x_m": [1.0] * count, "y_m": [1.0] * count}
    if event_type is e.Estimate:
        made["covariance_m2"] = [1.0, 0.0, 1.0] if count else []
    return event_type(**made)


@settings(max_examples=20)
@given(st.lists(st.integers(0, 3), min_size=1, max_size=4))
def test_an_event_is_as_many_rows_as_it_holds(counts: list[int]) -> None:
    for sheet in SHEETS:
        events = [gathered(sheet, example(sheet.event, count), 7) for count in counts]
        table = table_of(sheet, schema_of(sheet, {}), events, Selection())
        assert table.num_rows == (len(counts) if sheet.measure is None else sum(counts)), sheet.name
        table.validate(full=True)


def test_no_field_of_any_event_is_left_out() -> None:
    """But for the place in the source of a line of log, its time, and a count that the particles are a choice of."""
    left_out = {e.Log: {"sec", "nanosec", "file", "line"}, e.Particles: {"count"}}
    for event_type in EVENT_TYPES:
        seen: set[str] = set()
        for sheet in SHEETS:
            if sheet.event is event_type:
                spy = _Spy(example(event_type, 1))
                for column in sheet.columns:
                    column.value(spy)
                seen |= spy.read
        assert {field.name for field in fields(event_type)} - seen == left_out.get(event_type, set()), event_type


class _Spy:
    """An event that notes which of its fields are read."""

    def __init__(self, event: Event) -> None:
        self._event = event
        self.read: set[str] = set()

    def __getattr__(self, name: str) -> Any:
        self.read.add(name)
        return getattr(self._event, name)


def test_wire_types_become_arrow_types() -> None:
    assert [str(type_of(wire)) for wire in ("uint32", "float64", "bool", "string")] == [
        "uint32",
        "double",
        "bool",
        "string",
    ]
    assert np.dtype("uint32").itemsize == 4


def test_the_document_lists_all_tables() -> None:
    assert markdown_tables() in DOCUMENT.read_text(encoding="utf-8"), "write it anew: python tools/document_export.py"
