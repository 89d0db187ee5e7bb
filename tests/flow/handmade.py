"""A small trace by hand: three sensors and a target, in which a sensor falls silent and wakes."""

from collections.abc import Sequence
from pathlib import Path

from netsim.trace.events import AlgorithmRecord, GraphMessages, NodeTable, TruthTargets, VariablePlacement
from netsim.trace.writer import TraceWriter

S = 1_000_000_000
ROUNDS = [[(0, 3), (1, 3), (2, 3), (3, 0), (3, 1), (3, 2)], [(3, 0), (1, 3)], [(0, 3)], []]


def write_flow(
    path: Path,
    *,
    shared: bool = True,
    rounds: list[list[tuple[int, int]]] = ROUNDS,
    notes: Sequence[tuple[str, str]] = (),
) -> Path:
    """Round `k` is recorded at `k + 1` seconds, then the notes, kind and fields; all of it by node 0."""
    none = [""] * 3
    with TraceWriter(path, {"scenario": "by hand", "seed": "4"}) as writer:
        table = NodeTable(
            range(3), ["a", "b", "c"], none, ["sensor"] * 3, [0, 10, 0], [0, 0, 10], none, none, [1.0] * 3
        )
        writer.write(table, 0)
        writer.write(TruthTargets([0, 1], [6.0, 1.0], [6.0, 1.0]), 0)
        names = ["sensor 0", "sensor 1", "sensor 2", "target 0"]
        writer.write(VariablePlacement(range(4), names, [0, 1, 2, 1], [0, 1, 2], [3, 3, 3]), 0)
        for number, edges in enumerate(rounds):
            source, to = [a for a, _ in edges], [b for _, b in edges]
            event = GraphMessages(0, number, source, to, [1] * len(edges), 6, 0.5, int(shared), 0)
            writer.write(event, (number + 1) * S)
        for kind, fields in notes:
            writer.write(AlgorithmRecord(0, kind, fields), (len(rounds) + 1) * S)
    return path
