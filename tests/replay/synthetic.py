"""A made-up trace to look at: 25 nodes on a grid that flood observations and exchange beliefs, with losses and a death."""

import math
from pathlib import Path

import numpy as np

from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    Association,
    Estimate,
    Event,
    FieldInfo,
    Frame,
    GraphMessages,
    Identity,
    LinkTable,
    Log,
    MessageDropped,
    MessageSent,
    NodeEnergy,
    NodeLife,
    NodeTable,
    RadioState,
    Role,
    TruthOrigins,
    TruthTargets,
    VariablePlacement,
)
from netsim.trace.writer import Attachment, TraceWriter
from netsim.units import s_to_ns

SIDE = 5
SPACING_M = 5.0
NODES = SIDE * SIDE
DEAD_NODE = 17
DEATH_S = 18.2

Row = tuple[int, Event]


def place(node: int) -> tuple[float, float]:
    """Position of a node in metres."""
    return SPACING_M * (node % SIDE), SPACING_M * (node // SIDE)


def grid_neighbours(node: int, reach_m: float = 7.5) -> list[int]:
    """The nodes at most a diagonal away."""
    return [other for other in range(NODES) if other != node and math.dist(place(node), place(other)) < reach_m]


def prr(a: int, b: int) -> float:
    """Reception ratio of a link, the same each time."""
    return float(np.clip(1.1 - 0.055 * math.dist(place(a), place(b)) - 0.3 * ((a * 7 + b * 3) % 5 == 0), 0.05, 1.0))


def tables(mains: bool) -> list[Row]:
    """What is known at time 0."""
    xs, ys = zip(*map(place, range(NODES)), strict=True)
    pairs = [(a, b) for a in range(NODES) for b in grid_neighbours(a)]
    edges = [(a, b) for a, b in pairs if a < b and (a % SIDE == b % SIDE or a // SIDE == b // SIDE)]
    battery = [math.inf if mains or node == 0 else 3.0 for node in range(NODES)]
    return [
        (0, FieldInfo(24.0, 24.0, -2.0, -2.0)),
        (0, NodeTable(
            list(range(NODES)), [f"n{i:02d}" for i in range(NODES)], ["grid"] * NODES,
            ["sink"] + ["sensor"] * (NODES - 1), xs, ys, ["cc2420"] * NODES, ["msp430"] * NODES, battery,
        )),
        (0, LinkTable([a for a, _ in pairs], [b for _, b in pairs], [-70.0] * len(pairs), [prr(*p) for p in pairs])),
        (0, VariablePlacement(
            list(range(NODES)), [f"x{i}" for i in range(NODES)], list(range(NODES)),
            [a for a, _ in edges], [b for _, b in edges],
        )),
    ]  # fmt: skip


class _Traffic:
    """Frames and messages of all nodes; numbers count up."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.rows: list[Row] = []
        self.frames = 0
        self.messages = 0

    def outcome(self, source: int, listener: int, addressed: bool, time_s: float) -> int:
        """What becomes of a frame at a listener."""
        if listener == DEAD_NODE and time_s > DEATH_S:
            return OUTCOME_CODE["dead"]
        if self.rng.random() < 0.06:
            return OUTCOME_CODE["collided"]
        if self.rng.random() > prr(source, listener):
            return OUTCOME_CODE["weak"]
        return OUTCOME_CODE["received" if addressed else "overheard"]

    def frame(self, time_s: float, source: int, destination: int, kind: str, attempt: int = 0, ack: int = 0) -> int:
        """One transmission of 2 ms; returns the outcome at its destination."""
        listeners = grid_neighbours(source)
        codes = [self.outcome(source, n, destination in (n, BROADCAST), time_s) for n in listeners]
        start_ns = s_to_ns(time_s)
        end_ns = start_ns + (500_000 if ack else 2_000_000)
        rssi = [-70.0] * len(listeners)
        event = Frame(
            self.frames, start_ns, end_ns, source, destination, kind, ack, 5 if ack else 60, attempt, self.messages,
            0.0, listeners, codes, rssi, rssi,
        )  # fmt: skip
        self.frames += 1
        self.rows.append((end_ns, event))
        return OUTCOME_CODE["received"] if destination == BROADCAST else codes[listeners.index(destination)]

    def send(self, time_s: float, source: int, destination: int, kind: str) -> None:
        """A message with up to two retries and its acknowledgements."""
        self.messages += 1
        sent = MessageSent(self.messages, source, destination, kind, 40, 1, [])
        self.rows.append((s_to_ns(time_s), sent))
        if destination == BROADCAST:
            self.frame(time_s, source, destination, kind)
            return
        for attempt in range(3):
            start_s = time_s + 0.01 * attempt
            if self.frame(start_s, source, destination, kind, attempt) == OUTCOME_CODE["received"]:
                self.frame(start_s + 0.0022, destination, source, kind, ack=1)
                return
        dropped = MessageDropped(self.messages, source, destination, source, kind, "no_ack")
        self.rows.append((s_to_ns(time_s + 0.03), dropped))


def traffic(duration_s: float, rng: np.random.Generator) -> list[Row]:
    """Rounds of one second: some nodes broadcast observations, then beliefs go to neighbours, fewer each round."""
    air = _Traffic(rng)
    for second in range(int(duration_s)):
        alive = [n for n in range(NODES) if n != DEAD_NODE or second < DEATH_S]
        for node in rng.choice(alive, 5, replace=False):
            air.send(second + rng.uniform(0, 0.25), int(node), BROADCAST, "observations")
        senders = [n for n in alive if rng.random() < 1.2 * math.exp(-second / 12)]
        for node in senders:
            links = [n for n in grid_neighbours(node, 5.5)]
            for peer in links:
                air.send(second + rng.uniform(0.3, 0.95), node, peer, "belief")
            changed = GraphMessages(node, second, [node] * len(links), links, [1] * len(links), len(links), 0.1, 1, 0)
            air.rows.append((s_to_ns(second + 0.96), changed))
    return air.rows


def knowledge(duration_s: float, rng: np.random.Generator) -> list[Row]:
    """Targets that circle, estimates that approach them, decisions that get better."""
    rows: list[Row] = []
    for tick in range(int(duration_s * 10)):
        time_s = tick / 10
        xs = [10 + 6 * math.cos(time_s / 6 + phase) for phase in (0.0, 3.0)]
        ys = [10 + 6 * math.sin(time_s / 6 + phase) for phase in (0.0, 3.0)]
        rows.append((s_to_ns(time_s), TruthTargets([0, 1], xs, ys)))
        if tick % 5 == 4:
            sigma = 0.4 + 2.0 * math.exp(-time_s / 5)
            for target in (0, 1):
                x, y = xs[target] + sigma * rng.normal() / 2, ys[target] + sigma * rng.normal() / 2
                where = Estimate(6 + target, target, x, y, [sigma**2, 0.2 * sigma**2, 0.6 * sigma**2])
                rows.append((s_to_ns(time_s), where))
    for node in range(NODES):
        rows.append((0, TruthOrigins(node, [0.0, 1.0, 2.0], [0.0, 1.0, 2.0], [0, 1, -1])))
        for second in range(1, int(duration_s), 4):
            right = rng.random(3) < 1 - 0.6 * math.exp(-second / 8)
            decided = [t if ok else -1 if t >= 0 else 0 for t, ok in zip((0, 1, -1), right, strict=True)]
            rows.append((s_to_ns(second + 0.97), Association(node, decided, second)))
    return rows


def devices(duration_s: float, mains: bool) -> list[Row]:
    """Energy once a second, starts, a death, some sleep, a role and a line of log."""
    rows: list[Row] = [(0, NodeLife(node, "started", "")) for node in range(NODES)]
    power_w = np.array([0.05 + 0.004 * ((n * 7) % 13) for n in range(NODES)])
    power_w[DEAD_NODE] = 3.0 / DEATH_S
    for second in range(int(duration_s) + 1):
        used = np.minimum(power_w * second, 3.0)
        left = np.where(mains | (np.arange(NODES) == 0), np.inf, 3.0 - used)
        rows.append((s_to_ns(second), NodeEnergy(np.arange(NODES, dtype=np.uint32), used, left)))
        rows.append((s_to_ns(second + 0.26), RadioState(3, 1)))
        rows.append((s_to_ns(second + 0.29), RadioState(3, 2)))
    rows.append((s_to_ns(DEATH_S), NodeLife(DEAD_NODE, "died", "battery empty")))
    rows.append((s_to_ns(DEATH_S), RadioState(DEAD_NODE, 6)))
    rows.append((s_to_ns(4.0), Role(6, "leader", 1)))
    rows += [(s_to_ns(4.0 + number), Identity(6, 0, belief)) for number, belief in enumerate(([0.7, 0.3], [0.9, 0.1]))]
    rows.append((s_to_ns(6.0), Identity(6, 0, [0.25, 0.75])))
    rows.append((s_to_ns(5.0), Log(5, 0, 2, "hand-off to n07", "n06", "", 0)))
    return rows


def write_synthetic(path: Path, duration_s: float = 30.0, mains: bool = False) -> int:
    """Write the trace; returns how many events it has."""
    rng = np.random.default_rng(5)
    rows = devices(duration_s, mains) + traffic(duration_s, rng) + knowledge(duration_s, rng)
    rows = [row for row in rows if row[0] <= s_to_ns(duration_s)]
    rows.sort(key=lambda row: row[0])
    metadata = {"seed": "5", "scenario": "grid"}
    with TraceWriter(path, metadata, [Attachment("scenario.yaml", "application/yaml", b"kind: scenario\n")]) as writer:
        for time_ns, event in tables(mains) + rows:
            writer.write(event, time_ns)
    return len(rows)
