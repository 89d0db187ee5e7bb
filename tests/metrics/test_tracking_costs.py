"""Table 2's costs, latencies and fusion from streams of events by hand, and beside a run's own bytes."""

import json
from pathlib import Path

import pytest

from netsim.metrics.fusion import Fusion
from netsim.metrics.table2 import Table2
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import AlgorithmRecord, Belief, FieldInfo, Handoff, MessageSent, NodeTable, Problem

SENSORS = [{"node": node, "x_m": 10.0 * node, "y_m": 0.0} for node in range(3)]
PROBLEM = Problem("tracking", json.dumps({"sensors": SENSORS, "reading_s": 0.5}))
FIELD = FieldInfo(20.0, 20.0, 0.0, -10.0)
S = 1_000_000_000


def nodes(*roles: str) -> NodeTable:
    """Nodes in a row, 10 m apart."""
    count = len(roles)
    words = [["n"] * count, ["g"] * count, list(roles)]
    places = [10.0 * node for node in range(count)], [0.0] * count
    return NodeTable(list(range(count)), *words, *places, ["r"] * count, ["c"] * count, [1.0] * count)


def belief(node: int, step: int, cells: int) -> Belief:
    return Belief(node, 0, step, 0.0, 0.0, 5.0, 4, list(range(cells)), [1.0 / cells] * cells)


def figures(reducer, *rows):
    for time_ns, event in rows:
        handler = reducer.handlers().get(type(event))
        if handler is not None:
            handler(event, time_ns)
    return reducer.figures()


def test_handoffs_by_hand():
    """Beliefs of 4 and 6 cells after readings, the second handed over 10 m in 100 bytes among two; centre at (10, 0)."""
    handoff = Handoff(0, 0, 1, 1, [1, 2], [1.0, 0.5], "grid", 100, 0.0)
    rows = [FIELD, nodes("sensor", "sensor", "sensor"), PROBLEM, belief(0, 0, 9), belief(0, 1, 4), handoff]
    found = figures(Table2(), *((0, event) for event in [*rows, belief(1, 2, 6)]))
    assert found == {
        "table2_centralised_operations": 3 * (4 + 6),
        "table2_distributed_operations": 2 * 4,
        "table2_distributed_bit": 800,
        "table2_distributed_j": pytest.approx(10e-12 * 800 * 100),
        "table2_centralised_bit": 2400,
        "table2_centralised_j": pytest.approx(10e-12 * 800 * (100 + 0 + 100)),
    }


def test_readings_by_hand():
    """The sink stands at 30 m: two readings of 6 bytes from 30 m and 10 m, and one to another node."""
    sent = [MessageSent(1, 0, 3, "reading", 6, 1, []), MessageSent(2, 2, 3, "reading", 6, 1, [])]
    astray = MessageSent(3, 2, 1, "reading", 6, 1, [])
    rows = [FIELD, nodes("sensor", "sensor", "sensor", "sink"), PROBLEM, *sent, astray, belief(3, 1, 5)]
    assert figures(Table2(), *((0, event) for event in rows)) == {
        "table2_centralised_operations": 15,
        "table2_readings_bit": 96,
        "table2_readings_j": pytest.approx(10e-12 * 48 * (900 + 100)),
    }


def test_other_problems_and_runs_without_beliefs_have_no_costs():
    assert figures(Table2(), (0, FIELD), (0, nodes("sensor")), (0, PROBLEM)) == {}
    assert figures(Table2(), (0, nodes("sensor")), (0, Problem("none", "{}")), (0, belief(0, 1, 5))) == {}


def test_fusion_is_summed_up():
    told = [AlgorithmRecord(9, "fused", json.dumps({"step": 1, "readings": k, "late": 5 - k})) for k in (5, 3)]
    other = AlgorithmRecord(9, "outlier", "{}")
    assert figures(Fusion(), *((0, event) for event in (told[0], other, told[1]))) == {
        "fused_steps": 2,
        "fused_readings_mean": 4.0,
        "fused_readings_least": 3,
        "readings_late": 2,
    }
    assert figures(Fusion(), (0, other)) == {}


def test_bits_are_those_of_the_payloads_sent(scenarios: Path):
    """On ideal links every hand-off is sent once."""
    found = run(load(scenarios / "liu2002" / "tracking.yaml", ["duration_s=4"])).metrics
    assert found["table2_distributed_bit"] == 8 * found["message_payload_by_kind_byte"]["handoff"]
    assert found["table2_centralised_bit"] == 40 * found["table2_distributed_bit"]
    assert found["energy_from_batteries_j"] == found["energy_j"]
