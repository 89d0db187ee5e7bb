"""A short talk of three nodes, known exactly: received, acknowledged, broadcast, collided, tried again."""

from pathlib import Path

from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    AlgorithmRecord,
    EnergyLedger,
    Event,
    Frame,
    LinkTable,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    NodeTable,
    Role,
)
from netsim.trace.writer import TraceWriter
from netsim.units import NS_PER_MS

A, B, C = 0, 1, 2
NAMES = {A: "ann", B: "bob", C: "cyd"}
TX_W = 0.05

Row = tuple[int, Event]


def ms(time_ms: float) -> int:
    """Milliseconds as nanoseconds."""
    return round(time_ms * NS_PER_MS)


def frame(
    number: int,
    from_ms: float,
    to_ms: float,
    source: int,
    destination: int,
    outcomes: dict[int, str],
    *,
    message: int,
    kind: str = "ask",
    attempt: int = 0,
    is_ack: bool = False,
    is_strobe: bool = False,
    size_byte: int = 40,
) -> Row:
    """A frame on the air and what became of it."""
    listeners = sorted(outcomes)
    event = Frame(
        number, ms(from_ms), ms(to_ms), source, destination, kind, int(is_ack), size_byte, attempt, message, 0.0,
        listeners, [OUTCOME_CODE[outcomes[node]] for node in listeners],
        [-60.0] * len(listeners), [20.0] * len(listeners), int(is_strobe),
    )  # fmt: skip
    return ms(to_ms), event


def sent(
    number: int, at_ms: float, source: int, destination: int, kind: str, causes: list[int], fragments: int = 1
) -> Row:
    """A message handed over."""
    return ms(at_ms), MessageSent(number, source, destination, kind, 24, fragments, causes)


def delivered(number: int, at_ms: float, source: int, node: int, kind: str, latency_ms: float) -> Row:
    """A message that arrived."""
    return ms(at_ms), MessageDelivered(number, source, node, kind, 24, 1, ms(latency_ms))


def tables() -> list[Row]:
    """What is known at time 0: of the broadcast's listeners only links between ann, bob and cyd are good."""
    nodes = NodeTable([A, B, C], list(NAMES.values()), ["all"] * 3, ["sensor"] * 3, [0.0, 5.0, 9.0], [0.0] * 3,
                      ["cc2420"] * 3, ["msp430"] * 3, [3.0] * 3)  # fmt: skip
    pairs = [(a, b) for a in NAMES for b in NAMES if a != b]
    links = LinkTable([a for a, _ in pairs], [b for _, b in pairs], [-60.0] * 6, [1.0] * 6)
    return [(0, nodes), (0, links)]


TALK: list[Row] = [
    *tables(),
    sent(1, 1000, A, B, "ask", []),
    frame(1, 1001, 1003, A, B, {B: "received", C: "overheard"}, message=1),
    delivered(1, 1003, A, B, "ask", 3.0),
    (ms(1003), Role(B, "leader", 1)),
    frame(2, 1003.2, 1003.6, B, A, {A: "received", C: "overheard"}, message=1, is_ack=True, size_byte=5),
    sent(2, 1004, B, BROADCAST, "tell", [1]),
    sent(3, 1004.5, C, B, "ask", []),
    frame(3, 1005, 1007, B, BROADCAST, {A: "received", C: "half_duplex"}, message=2, kind="tell"),
    delivered(2, 1007, B, A, "tell", 3.0),
    frame(4, 1005.5, 1007.5, C, B, {A: "collided", B: "half_duplex"}, message=3),
    frame(5, 3000, 3002, C, B, {A: "overheard", B: "collided"}, message=3, attempt=1),
    (ms(3002.5), AlgorithmRecord(A, "verdict", '{"targets": 2}')),
    (ms(3003), MessageDropped(3, C, B, C, "ask", "no_ack")),
    (ms(3003), Role(B, "leader", 0)),
    (ms(3004), NodeLife(C, "died", "battery")),
    (ms(5000), EnergyLedger([A, B], ["radio"] * 2, ["transmit"] * 2, ["ask", "tell"], [TX_W, TX_W], [1.0, 1.0])),
]


def write(path: Path, rows: list[Row] = TALK) -> Path:
    """A trace of these events."""
    with TraceWriter(path, {"scenario": "talk <&> more", "seed": "1"}) as writer:
        for time_ns, event in rows:
            writer.write(event, time_ns)
    return path
