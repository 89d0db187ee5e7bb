"""A made-up trace of 10 s: three nodes in a line, one frame that arrives, one that collides, one that is lost."""

import math
from pathlib import Path

from netsim.trace.events import (
    OUTCOME_CODE,
    Belief,
    Estimate,
    Event,
    FieldInfo,
    Frame,
    LinkTable,
    MessageSent,
    NodeEnergy,
    NodeLife,
    NodeTable,
    Role,
    TruthTargets,
)
from netsim.trace.writer import TraceWriter
from netsim.units import s_to_ns

PLACES_M = [(2.0, 5.0), (10.0, 5.0), (18.0, 5.0)]
ARRIVES_S, COLLIDES_S, LOST_S = 2.0, 4.0, 6.0
DEATH_S = 8.0
END_S = 10.0
BATTERY_J = 2.0

Row = tuple[int, Event]


def frame(start_s: float, source: int, destination: int, outcome: str, kind: str = "belief") -> Row:
    """A frame of 2 ms to one listener."""
    start_ns = s_to_ns(start_s)
    code = [OUTCOME_CODE[outcome]]
    event = Frame(
        0, start_ns, start_ns + 2_000_000, source, destination, kind, 0, 60, 0, 1, 0.0, [destination], code, [-70.0], [9.0]
    )  # fmt: skip
    return start_ns + 2_000_000, event


def sent(time_s: float, source: int, destination: int, kind: str = "belief") -> Row:
    """A message handed to the network."""
    return s_to_ns(time_s), MessageSent(1, source, destination, kind, 40, 1, [])


def tables() -> list[Row]:
    """What is known at time 0."""
    xs, ys = zip(*PLACES_M, strict=True)
    pairs = [(0, 1), (1, 0), (1, 2), (2, 1)]
    nodes = NodeTable(
        [0, 1, 2], ["n0", "n1", "n2"], ["line"] * 3, ["sink", "sensor", "sensor"], xs, ys, ["cc2420"] * 3, ["msp430"] * 3,
        [math.inf, BATTERY_J, BATTERY_J],
    )  # fmt: skip
    links = LinkTable([a for a, _ in pairs], [b for _, b in pairs], [-70.0] * 4, [1.0] * 4)
    return [(0, FieldInfo(20.0, 10.0, 0.0, 0.0)), (0, nodes), (0, links)]


def happenings() -> list[Row]:
    """What happens, in order."""
    rows = [
        sent(ARRIVES_S, 1, 0),
        frame(ARRIVES_S, 1, 0, "received"),
        frame(COLLIDES_S, 1, 2, "collided"),
        frame(LOST_S, 1, 0, "weak", "query"),
        (s_to_ns(1.0), TruthTargets([0], [6.0], [8.0])),
        (s_to_ns(1.5), Estimate(1, 0, 6.5, 8.0, [0.25, 0.0, 0.25])),
        (s_to_ns(1.5), Belief(1, 0, 0, 4.0, 7.0, 1.0, 20, [0, 1, 20, 21], [0.1, 0.2, 0.3, 0.4])),
        (s_to_ns(3.0), Role(1, "leader", 1)),
        (s_to_ns(5.0), NodeEnergy([0, 1, 2], [0.1, 1.0, 2.0], [math.inf, 1.0, 0.0])),
        (s_to_ns(DEATH_S), NodeLife(2, "died", "battery")),
        (s_to_ns(END_S), NodeEnergy([0, 1, 2], [0.1, 1.0, 2.0], [math.inf, 1.0, 0.0])),
    ]
    return sorted(rows, key=lambda row: row[0])


def write_trace(path: Path, rows: list[Row] | None = None) -> Path:
    """Write the trace, or one with other happenings."""
    with TraceWriter(path, {"scenario": "three in a line", "seed": "1"}) as writer:
        for time_ns, event in tables() + (happenings() if rows is None else rows):
            writer.write(event, time_ns)
    return path
