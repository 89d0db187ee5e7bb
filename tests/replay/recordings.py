"""Small traces by hand, and what a recording of a trace holds."""

from pathlib import Path
from typing import Any

import pyarrow as pa
from rerun.chunk import RrdReader

from netsim import replay
from netsim.replay import ReplayOptions
from netsim.trace.events import BROADCAST, OUTCOME_CODE, Frame, LinkTable, NodeTable
from netsim.trace.writer import TraceWriter

MS = 1_000_000
Table = dict[str, list[dict[str, Any]]]


def write_three_frames(path: Path) -> None:
    """Nodes at (0, 0), (10, 0) and (0, 10): a broadcast, a collision and an acknowledgement."""
    got, hit, ears = OUTCOME_CODE["received"], OUTCOME_CODE["collided"], ([-60.0] * 2, [9.0] * 2)
    frames = [
        Frame(0, 100 * MS, 102 * MS, 0, BROADCAST, "hello", 0, 20, 0, 1, 0.0, [1, 2], [got, got], *ears),
        Frame(1, 100 * MS, 103 * MS, 1, 0, "data", 0, 20, 0, 2, 0.0, [0, 2], [hit, hit], *ears),
        Frame(2, 400 * MS, 401 * MS, 0, 1, "data", 1, 5, 0, 2, 0.0, [1, 2], [got, OUTCOME_CODE["overheard"]], *ears),
    ]
    with TraceWriter(path, {}) as writer:
        names, three = ["a", "b", "c"], [""] * 3
        table = NodeTable([0, 1, 2], names, three, ["sensor"] * 3, [0, 10, 0], [0, 0, 10], three, three, [1.0] * 3)
        writer.write(table, 0)
        writer.write(LinkTable([0, 1], [1, 0], [-60.0] * 2, [1.0, 0.9]), 0)
        for frame in frames:
            writer.write(frame, frame.t_end_ns)


def named_nodes(*names: str, battery_j: float | list[float] = 1.0, spacing_m: float = 10.0) -> NodeTable:
    """Sensors in a row."""
    count, none = len(names), [""] * len(names)
    xs = [spacing_m * number for number in range(count)]
    full = battery_j if isinstance(battery_j, list) else [battery_j] * count
    return NodeTable(range(count), names, none, ["sensor"] * count, xs, [0] * count, none, none, full)


def recording(trace: Path, folder: Path, **options: Any) -> Table:
    """The rows of a converted trace by entity; static rows have no `simulated_time`."""
    replay.save(trace, folder / "out.rrd", ReplayOptions(**options))
    rows: Table = {}
    for chunk in RrdReader(folder / "out.rrd").stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if pa.types.is_duration(batch.schema.field(name).type):
                index = batch.schema.get_field_index(name)
                batch = batch.set_column(index, name, batch.column(index).cast(pa.int64()))
        rows.setdefault(str(chunk.entity_path), []).extend(batch.to_pylist())
    return rows


def timed(rows: list[dict[str, Any]], component: str) -> dict[int, Any]:
    """Instant -> value of a component, for the rows that have both."""
    return {
        row["simulated_time"]: row[component]
        for row in rows
        if "simulated_time" in row and row.get(component) is not None
    }


def log_of(rows: Table) -> list[tuple[int, str, str]]:
    """Instant, level and text of every line of the log, in the order of time, then of the alphabet."""
    lines = [row for path, part in rows.items() if path.startswith("/log/") for row in part]
    told = [(row["simulated_time"], row["TextLog:level"][0], row["TextLog:text"][0]) for row in lines]
    return sorted(told)
