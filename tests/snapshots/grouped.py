"""A small trace by hand: two targets meet, are tracked jointly, and part; their leaders tell each other who is who."""

import json
from pathlib import Path

from netsim.trace.events import (
    Estimate,
    FieldInfo,
    Identity,
    MessageSent,
    NodeTable,
    Particles,
    Problem,
    Role,
    TruthTargets,
)
from netsim.trace.writer import TraceWriter

S = 1_000_000_000
STEPS = 12
JOINT = range(4, 8)
"""Steps in which node 1 leads both."""


def write_groups(path: Path) -> Path:
    """Step k is at k seconds. Targets 0 and 1 go right and left at 10 m/s, 10 m apart in y, and pass each other.

    Particles are the target's place and one 4 m to its right, three times as heavy; estimates are their mean, 3 m off.
    """
    with TraceWriter(path, {"scenario": "by hand", "seed": "4"}) as writer:
        none, names = [""] * 3, ["a", "b", "c"]
        writer.write(
            NodeTable(range(3), names, none, ["sensor"] * 3, [10.0, 60.0, 110.0], [20.0] * 3, none, none, [1.0] * 3), 0
        )
        writer.write(FieldInfo(120.0, 40.0, 0.0, 0.0), 0)
        content = {"sensors": [], "targets": 2, "sensing_range_m": 30.0, "reading_s": 1.0, "cut_off_m": 50.0}
        writer.write(Problem("energy-tracking", json.dumps(content)), 0)
        for step in range(STEPS):
            _write_step(writer, step)
    return path


def _write_step(writer: TraceWriter, step: int) -> None:
    time_ns, is_joint, is_past = step * S, step in JOINT, step >= JOINT.stop
    leaders = (1, 1) if is_joint else (2, 0) if is_past else (0, 2)
    if step == JOINT.stop + 1:
        writer.write(MessageSent(1, leaders[0], leaders[1], "word", 20, 1, []), time_ns - S // 2)
    places_m = [(5.0 + 10.0 * step, 25.0), (115.0 - 10.0 * step, 15.0)]
    writer.write(TruthTargets([0, 1], [x_m for x_m, _ in places_m], [y_m for _, y_m in places_m]), time_ns)
    if is_joint:
        xs, ys = zip(*[(x_m + right_m, y_m) for x_m, y_m in places_m for right_m in (0.0, 4.0)], strict=True)
        writer.write(Particles(1, step, [0, 1], 2, [0.25, 0.75], xs, ys), time_ns)
    for track, ((x_m, y_m), leader) in enumerate(zip(places_m, leaders, strict=True)):
        if not is_joint:
            writer.write(Particles(leader, step, [track], 2, [0.25, 0.75], [x_m, x_m + 4.0], [y_m, y_m]), time_ns)
        writer.write(Role(leader, f"leader {track}", 1), time_ns)
        writer.write(Estimate(leader, track, x_m + 3.0, y_m, []), time_ns)
        row = [0.5, 0.5] if is_past else [1.0, 0.0] if track == 0 else [0.0, 1.0]
        writer.write(Identity(leader, track, row), time_ns)
