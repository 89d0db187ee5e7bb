"""A hand-made trace of three nodes that obeys every law, and what it takes to break one."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    RADIO_STATE_CODE,
    Belief,
    EnergyHarvest,
    EnergyLedger,
    Event,
    FieldInfo,
    Frame,
    LinkTable,
    Log,
    Marginals,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeEnergy,
    NodeLife,
    NodeTable,
    PairProbabilities,
    RadioState,
)
from netsim.trace.writer import Attachment, TraceWriter

MS = 1_000_000
MAINS_J = float("inf")
Row = tuple[int, Event]
SCENARIO = b"""kind: scenario
name: hand-made
seed: 7
repetition: 0
duration_s: 1.0
nodes:
  - {name: field, battery: {type: capacity, energy_j: 10.0}}
  - {name: wall, battery: {type: mains}}
medium: {type: log-distance, fading: null, noise: {type: constant}}
trace: {detail: full}
"""
METADATA = {"scenario": "hand-made", "seed": "7", "repetition": "0", "horizon_s": "1.0", "detail": "full"}
FILES = {"scenario.yaml": SCENARIO, "metrics.json": b'{"nodes": 3}'}


def state(node: int, name: str) -> RadioState:
    """A node's radio entered a state."""
    return RadioState(node, RADIO_STATE_CODE[name])


def air(
    frame_id: int, start_ms: int, end_ms: int, ends: tuple[int, int], message: int, *rows: tuple[int, str]
) -> Frame:
    """A frame of some message between its two ends, and what became of it at its listeners."""
    nodes, outcomes = [node for node, _ in rows], [OUTCOME_CODE[name] for _, name in rows]
    levels = [-70.0] * len(rows)
    kind = "answer" if message == 2 else "hello"
    return Frame(
        frame_id, start_ms * MS, end_ms * MS, *ends, kind, 0, 30, 0, message, 0.0, nodes, outcomes, levels, levels
    )  # fmt: skip


def good_rows() -> list[Row]:
    """Node 1 tells 2, which tells all; a message to 3, which crashes and comes back, is dropped."""
    pairs = [(a, b) for a in (1, 2, 3) for b in (1, 2, 3) if a != b]
    table = NodeTable(
        [1, 2, 3], ["a", "b", "c"], ["field", "field", "wall"], ["sensor", "sensor", "sink"], [0.0, 5.0, 9.0],
        [0.0, 0.0, 0.0], ["cc2420"] * 3, ["msp430"] * 3, [10.0, 10.0, MAINS_J],
    )  # fmt: skip
    ledger = EnergyLedger(
        [1, 1, 2, 2, 3], ["radio"] * 5, ["listen", "transmit", "listen", "transmit", "listen"],
        ["", "hello", "", "answer", ""],
        [0.375, 0.125, 0.125, 0.125, 0.1], [0.019, 0.001, 0.018, 0.002, 0.02],
    )  # fmt: skip
    return [
        (0, table),
        (0, LinkTable([a for a, _ in pairs], [b for _, b in pairs], [-70.0] * 6, [0.9] * 6)),
        (0, FieldInfo(10.0, 10.0, 0.0, 0.0)),
        (0, NodeEnergy([1, 2, 3], [0.0] * 3, [10.0, 10.0, MAINS_J])),
        *[(0, state(node, "listen")) for node in (1, 2, 3)],
        *[(0, NodeLife(node, "started", "Talk")) for node in (1, 2, 3)],
        (1 * MS, MessageSent(1, 1, 2, "hello", 10, 1, [])),
        (1 * MS, state(1, "transmit")),
        (2 * MS, air(1, 1, 2, (1, 2), 1, (2, "received"), (3, "overheard"))),
        (2 * MS, state(1, "listen")),
        (2 * MS, MessageDelivered(1, 1, 2, "hello", 10, 1, 1 * MS)),
        (3 * MS, MessageSent(2, 2, BROADCAST, "answer", 20, 1, [1])),
        (3 * MS, state(2, "transmit")),
        (5 * MS, air(2, 3, 5, (2, BROADCAST), 2, (1, "received"), (3, "weak"))),
        (5 * MS, state(2, "listen")),
        (5 * MS, MessageDelivered(2, 2, 1, "answer", 20, 1, 2 * MS)),
        (6 * MS, MessageSent(3, 1, 3, "hello", 10, 1, [2])),
        (7 * MS, MessageDropped(3, 1, 3, 1, "hello", "channel_busy")),
        (8 * MS, NodeLife(3, "crashed", "a fault")),
        (8 * MS, state(3, "off")),
        (9 * MS, NodeLife(3, "rebooted", "Talk")),
        (9 * MS, state(3, "listen")),
        (10 * MS, Marginals(1, 0, [0.25, 0.75], 0, 0)),
        (10 * MS, Belief(1, 0, 0, 0.0, 0.0, 1.0, 10, [3, 4], [0.5, 0.5])),
        (10 * MS, PairProbabilities(1, 0, [0], [0.5], [0.25], [0.75], 2)),
        (11 * MS, Log(0, 11 * MS, 2, "a line", "node 1", "", 0)),
        (20 * MS, NodeEnergy([1, 2, 3], [0.5, 0.25, 0.1], [9.5, 10.0, MAINS_J])),
        (20 * MS, EnergyHarvest([2], [0.5], [0.25])),
        (20 * MS, ledger),
    ]


def write_rows(
    path: Path,
    rows: Sequence[Row],
    metadata: dict[str, str] | None = None,
    files: dict[str, bytes] | None = None,
) -> Path:
    """Write events into a trace."""
    attached = [Attachment(name, "text/plain", data) for name, data in (FILES if files is None else files).items()]
    with TraceWriter(path, METADATA if metadata is None else metadata, attached) as writer:
        for time_ns, event in rows:
            writer.write(event, time_ns)
    return path


def changed(event_type: type[Any], number: int = 0, **fields: Any) -> Callable[[list[Row]], list[Row]]:
    """The rows with other fields in the event of some class with that number."""

    def change(rows: list[Row]) -> list[Row]:
        at = [index for index, (_, event) in enumerate(rows) if type(event) is event_type][number]
        time_ns, event = rows[at]
        return [*rows[:at], (time_ns, replace(event, **fields)), *rows[at + 1 :]]

    return change


def without(event_type: type[Any], number: int = 0) -> Callable[[list[Row]], list[Row]]:
    """The rows without the event of some class with that number."""

    def drop(rows: list[Row]) -> list[Row]:
        at = [index for index, (_, event) in enumerate(rows) if type(event) is event_type][number]
        return [*rows[:at], *rows[at + 1 :]]

    return drop


def with_event(time_ms: int, event: Event) -> Callable[[list[Row]], list[Row]]:
    """The rows with one event more, the last of its instant."""

    def add(rows: list[Row]) -> list[Row]:
        at = next((index for index, (time_ns, _) in enumerate(rows) if time_ns > time_ms * MS), len(rows))
        return [*rows[:at], (time_ms * MS, event), *rows[at:]]

    return add
