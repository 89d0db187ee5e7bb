"""Small traces by hand: a belief that wanders from sensor to sensor, and one that a sink holds."""

import json
from pathlib import Path

from netsim.trace.events import (
    Belief,
    Estimate,
    FieldInfo,
    Handoff,
    NodeLife,
    NodeTable,
    Problem,
    Role,
    TruthTargets,
)
from netsim.trace.writer import TraceWriter

HALF_S = 500_000_000
STEPS = 8
_KINDS = ["amplitude", "bearing", "amplitude", "amplitude"]


def write_track(path: Path, *, central: bool = False, beliefs: bool = True, refused: bool = False) -> Path:
    """A target goes north at 10 m/s through four sensors and a sink; step k is at k / 2 s.

    The belief of step 0 is uniform; that of a later one is in the cell of the target and, a third as probable, the one to
    its east. The leader of step k is sensor k modulo 4, it chooses among the two that follow; sensor 3 crashes at 3.25 s.
    With `refused` the first choice does not answer in step 2, so that the second one is tried, and at 1.75 s, one belief
    later, the leader of step 2 takes the track back and tries the first again.
    """
    with TraceWriter(path, {"scenario": "by hand", "seed": "4"}) as writer:
        none, names = [""] * 5, ["a", "b", "c", "d", "centre"]
        places = [10.0, 30.0, 10.0, 30.0, 20.0], [10.0, 20.0, 30.0, 40.0, 5.0]
        roles = ["sensor"] * 4 + ["sink"]
        writer.write(NodeTable(range(5), names, none, roles, *places, none, none, [1.0] * 5), 0)
        writer.write(FieldInfo(40.0, 50.0, 0.0, 0.0), 0)
        sensors = [{"node": node, "measures": what} for node, what in enumerate(_KINDS)]
        writer.write(Problem("tracking", json.dumps({"sensors": sensors, "cut_off_m": 20.0})), 0)
        for step in range(STEPS):
            _write_step(writer, step, central, beliefs)
            if refused and step in (2, 3):
                to = 0 if step == 2 else 3
                writer.write(Handoff(2, 0, 2, to, [to], [0.25], "grid", 14, 0.0), step * HALF_S + HALF_S // 2)
    return path


def _write_step(writer: TraceWriter, step: int, central: bool, beliefs: bool) -> None:
    time_ns, node = step * HALF_S, 4 if central else step % 4
    if step == 7:
        writer.write(NodeLife(3, "crashed", "rule 0"), time_ns - HALF_S // 2)
    writer.write(TruthTargets([0], [22.5], [2.5 + 5.0 * step]), time_ns)
    if not beliefs:
        return
    cells = [8 * step + 4, 8 * step + 5] if step else list(range(80))
    chances = [0.75, 0.25] if step else [1.0 / 80] * 80
    writer.write(Estimate(node, 0, 23.75 if step else 20.0, 2.5 + 5.0 * step, []), time_ns)
    writer.write(Belief(node, 0, step, 0.0, 0.0, 5.0, 8, cells, chances), time_ns)
    if not central:
        writer.write(Role(node, "leader", 1), time_ns)
        others = [(node + 1) % 4, (node + 2) % 4]
        writer.write(Handoff(node, 0, step, others[0], others, [0.5, 0.25], "grid", 14, 0.0), time_ns)
