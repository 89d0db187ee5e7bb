"""A made-up trace of a bad day: a jammer, an outage, crashes, a death, two nodes on their way, clocks that drift."""

import math
from pathlib import Path

import numpy as np

from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    EnergyBudget,
    Event,
    Fault,
    FieldInfo,
    Frame,
    LinkTable,
    Log,
    MessageDropped,
    MessageSent,
    NodeClocks,
    NodeEnergy,
    NodeLife,
    NodePositions,
    NodeTable,
    RadioState,
    RouteChange,
)
from netsim.trace.writer import TraceWriter
from netsim.units import s_to_ns

COLUMNS, ROWS, SPACING_M = 5, 4, 10.0
NODES = COLUMNS * ROWS + 2
SINK = 0
WALKERS = (NODES - 2, NODES - 1)
JAMMER_M = (33.0, 12.0)
JAMMED_S = (8.0, 12.0)
JAMMED = (3, 4, 8, 9, 13)
OUTAGE_S = (6.0, 14.0)
CUT = (10, 15)
CRASHED, CRASH_S, REBOOT_S = 12, 7.0, 15.0
DEAD, DEATH_S = 19, 9.0
DURATION_S = 20.0

Row = tuple[int, Event]


def place(node: int, time_s: float) -> tuple[float, float]:
    """Position of a node: a grid, and two that walk along it and across it."""
    if node == WALKERS[0]:
        return min(40.0, 2.0 * time_s + 2.0), 16.0
    if node == WALKERS[1]:
        return 24.0, 34.0 - 1.5 * time_s
    return SPACING_M * (node % COLUMNS), SPACING_M * (node // COLUMNS)


def reach(node: int, time_s: float) -> list[int]:
    """Who hears a node."""
    here = place(node, time_s)
    return [other for other in range(NODES) if other != node and math.dist(here, place(other, time_s)) < 15.0]


def tables() -> list[Row]:
    """What is known at time 0."""
    xs, ys = zip(*(place(node, 0.0) for node in range(NODES)), strict=True)
    names = [f"n{node:02d}" for node in range(NODES - 2)] + ["walker1", "walker2"]
    pairs = [(a, b) for a in range(NODES) for b in reach(a, 0.0)]
    prr = [1.0 if math.dist(place(a, 0.0), place(b, 0.0)) < 11 else 0.7 for a, b in pairs]
    none = [""] * NODES
    battery = [math.inf] + [2.0] * (NODES - 1)
    roles = ["sink"] + ["sensor"] * (NODES - 1)
    return [
        (0, FieldInfo(46.0, 40.0, -3.0, -4.0)),
        (0, NodeTable(range(NODES), names, none, roles, xs, ys, none, none, battery)),
        (0, LinkTable([a for a, _ in pairs], [b for _, b in pairs], [-70.0] * len(pairs), prr)),
    ]


def is_down(node: int, time_s: float) -> bool:
    """Whether a node is dead or crashed."""
    return (node == DEAD and time_s >= DEATH_S) or (node == CRASHED and CRASH_S <= time_s < REBOOT_S)


def outcome(source: int, listener: int, time_s: float, chance: float) -> str:
    """What becomes of a frame at the node it is sent to."""
    if is_down(listener, time_s):
        return "dead"
    if listener in JAMMED and JAMMED_S[0] <= time_s < JAMMED_S[1]:
        return "jammed"
    if {source, listener} == set(CUT) and OUTAGE_S[0] <= time_s < OUTAGE_S[1]:
        return "outage"
    losses = ("captured", "corrupted", "collided", "weak", "busy")
    return losses[int(chance * 40)] if chance < len(losses) / 40 else "received"


def traffic(rng: np.random.Generator) -> list[Row]:
    """Reports to neighbours, and broadcasts now and then."""
    rows: list[Row] = []
    for number in range(int(DURATION_S * 22)):
        time_s = number / 22
        source = int(rng.integers(NODES))
        listeners = reach(source, time_s)
        if is_down(source, time_s) or not listeners:
            continue
        is_broadcast = rng.random() < 0.2
        destination = BROADCAST if is_broadcast else int(rng.choice(listeners))
        kind = "beacon" if is_broadcast else "report"
        names = [outcome(source, node, time_s, float(rng.random())) for node in listeners]
        names = [
            "overheard" if name == "received" and destination not in (node, BROADCAST) else name
            for node, name in zip(listeners, names, strict=True)
        ]
        start_ns, end_ns = s_to_ns(time_s), s_to_ns(time_s) + 3_000_000
        ears = [-70.0] * len(listeners)
        codes = [OUTCOME_CODE[name] for name in names]
        rows.append((start_ns, MessageSent(number, source, destination, kind, 40, 1, [])))
        rows.append((end_ns, Frame(
            number, start_ns, end_ns, source, destination, kind, 0, 60, 0, number, 0.0, listeners, codes, ears, ears,
        )))  # fmt: skip
        if not is_broadcast and names[listeners.index(destination)] != "received":
            rows.append((end_ns, MessageDropped(number, source, destination, source, kind, "no_ack")))
    return rows


def incidents() -> list[Row]:
    """What befalls the nodes."""
    at = "at ({:g}, {:g}) m, 10 dBm".format(*JAMMER_M)
    listed: list[tuple[float, Event]] = [
        (OUTAGE_S[0], Fault(0, "outage", "begins", list(CUT), "both directions")),
        (OUTAGE_S[1], Fault(0, "outage", "ends", list(CUT), "")),
        (JAMMED_S[0], Fault(1, "jammer", "begins", list(JAMMED), at)),
        (JAMMED_S[1], Fault(1, "jammer", "ends", list(JAMMED), at)),
        (CRASH_S, Fault(2, "crash", "strikes", [CRASHED], "back after 8 s")),
        (CRASH_S, Log(7, 0, 3, "crash strikes: back after 8 s", "faults[2]", "", 0)),
        (CRASH_S, NodeLife(CRASHED, "crashed", "rule 2")),
        (CRASH_S, RadioState(CRASHED, 0)),
        (REBOOT_S, NodeLife(CRASHED, "rebooted", "Reporting")),
        (DEATH_S, NodeLife(DEAD, "died", "battery empty")),
        (DEATH_S, RadioState(DEAD, 6)),
        (0.5, RouteChange(11, SINK, 6, 2.1)),
        (0.5, RouteChange(17, SINK, 12, 3.2)),
        (7.4, RouteChange(17, SINK, 16, 3.6)),
        (8.5, RouteChange(4, SINK, BROADCAST, 0.0)),
        (9.5, EnergyBudget(6, "short", "", 0.1001, 0.1, "warn")),
        (9.7, EnergyBudget(6, "refused", "track", 0.02, 0.02, "send")),
        (12.0, EnergyBudget(6, "replenished", "", 0.0, 0.1, "")),
    ]
    return [(s_to_ns(time_s), event) for time_s, event in listed]


def samples(rng: np.random.Generator) -> list[Row]:
    """Energy and clocks once a second, positions twice."""
    rows: list[Row] = [(0, NodeLife(node, "started", "Reporting")) for node in range(NODES)]
    drift_ppm = rng.normal(0.0, 30.0, NODES)
    for second in range(int(DURATION_S) + 1):
        used = np.minimum(np.linspace(0.03, 0.07, NODES) * second, 2.0)
        used[DEAD] = min(2.0, 2.0 * second / DEATH_S)
        left = np.where(np.arange(NODES) == SINK, np.inf, 2.0 - used)
        rows.append((s_to_ns(second), NodeEnergy(range(NODES), used, left)))
        rows.append((s_to_ns(second), NodeClocks(range(NODES), drift_ppm * 1e-6 * second)))
    for half in range(1, int(2 * DURATION_S)):
        xs, ys = zip(*(place(node, half / 2) for node in WALKERS), strict=True)
        rows.append((s_to_ns(half / 2), NodePositions(list(WALKERS), xs, ys)))
    return rows


def write_incidents(path: Path) -> None:
    """Write the trace."""
    rng = np.random.default_rng(3)
    rows = sorted(samples(rng) + traffic(rng) + incidents(), key=lambda row: row[0])
    with TraceWriter(path, {"seed": "3", "scenario": "incidents"}) as writer:
        for time_ns, event in tables() + rows:
            if time_ns <= s_to_ns(DURATION_S):
                writer.write(event, time_ns)
