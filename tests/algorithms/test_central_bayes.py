"""Centralised tracking: equal to the pure reference on ideal links, and on the radio to the reference fed with what came."""

import json
import math
import struct
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from idsq_rig import SAMPLE_NS, Run, S

from netsim.algorithms.tracking_readings import decode_reading, encode_reading
from netsim.errors import ScenarioError
from netsim.kernels.fusion import centralised
from netsim.kernels.grid_belief import uniform
from netsim.kernels.idsq import Filter
from netsim.scenario.load import load
from netsim.trace.events import AlgorithmRecord, Belief, EnergyLedger, MessageDelivered, MessageSent

IDEAL = ["medium={type: ideal}", "mac={type: ideal}", "network={type: one-hop}"]
STEP_NS = S // 2
SINK = 40


@pytest.fixture
def central(scenarios: Path):
    """Runs of the shipped scenario, shortened and changed."""
    return lambda *changes, duration_s=5.0: Run(
        load(scenarios / "liu2002" / "central.yaml", [f"duration_s={duration_s}", *changes])
    )


def told(run, width):
    """What every sensor reads at a step, as it arrives."""
    cast = np.dtype(width).type
    return lambda node, step: float(cast(run.problem.observe(node, step * STEP_NS + SAMPLE_NS)[0]))


def reference(run, came, width="float32"):
    """The beliefs of a centre that is told some readings: nodes by step."""
    reading = told(run, width)
    readings = ({node: reading(node, step) for node in nodes} for step, nodes in came)
    return centralised(run.problem.grid, run.problem.sensors, readings, Filter(7.5, 2e-5))


def assert_beliefs(run, came, width="float32"):
    beliefs = [event for _, event in run.of(Belief)]
    start = uniform(run.problem.grid)
    assert (beliefs[0].step, list(beliefs[0].cell)) == (0, list(start.cells))
    for event, expected in zip(beliefs[1:], reference(run, came, width), strict=True):
        assert event.node == SINK
        np.testing.assert_array_equal(event.cell, expected.cells)
        np.testing.assert_array_equal(event.probability, expected.probability)


@pytest.mark.parametrize("width", ["float64", "float32", "float16"])
def test_on_ideal_links_it_is_the_reference_bit_for_bit(central, width):
    run = central(*IDEAL, f"algorithm.payload={width}", duration_s=3.0)
    everybody = [(step, sorted(run.problem.sensors)) for step in range(1, 6)]
    assert len(everybody[0][1]) == 40
    assert_beliefs(run, everybody, width)


def test_on_the_radio_it_loses_what_the_radio_loses(central):
    """The belief is that of the readings that reached the sink by the deadline, and of no others."""
    run = central(duration_s=8.0)
    sent_ns = {event.message_id: time_ns for time_ns, event in run.of(MessageSent)}
    came = defaultdict(list)
    for time_ns, event in run.of(MessageDelivered):
        step = sent_ns[event.message_id] // STEP_NS
        if event.node == SINK and time_ns < step * STEP_NS + 4 * S // 10:
            came[step].append(event.source)
    steps = [event.step for _, event in run.of(Belief)][1:]
    assert_beliefs(run, [(step, came[step]) for step in steps])
    counts = [len(came[step]) for step in steps]
    assert min(counts) < 40
    figures = run.figures()
    assert figures["fused_readings_mean"] == pytest.approx(np.mean(counts))
    assert (figures["fused_steps"], figures["fused_readings_least"]) == (len(steps), min(counts))
    assert 0.26 < figures["belief_age_mean_s"] <= figures["belief_age_max_s"] < 0.5


def test_what_comes_too_late_is_counted_and_left_out(central):
    """On links of 0.2 s readings that are sent within 0.25 s of an instant come after 0.2 to 0.45 s; 0.3 s is too late."""
    run = central(*IDEAL, "medium.delay_s=0.2", "algorithm.deadline_s=0.3", duration_s=6.0)
    sent_ns = {event.message_id: time_ns for time_ns, event in run.of(MessageSent)}
    came = defaultdict(list)
    for time_ns, event in run.of(MessageDelivered):
        sent_step = sent_ns[event.message_id] // STEP_NS
        if time_ns - sent_step * STEP_NS < 3 * S // 10:
            came[sent_step].append(event.source)
    steps = range(1, 12)
    assert_beliefs(run, [(step, came[step]) for step in steps])
    figures = run.figures()
    assert figures["fused_readings_mean"] == pytest.approx(np.mean([len(came[step]) for step in steps]))
    late = sum(40 - len(came[step]) for step in steps[:-1])  # those of the last step come after the last fusion
    assert figures["readings_late"] == late > 100


def test_a_silent_sensor_holds_the_others_up_until_the_deadline(central):
    """Node 3 crashes, the sensor of node 5 gives nothing: 38 are fused."""
    faults = "faults=[{type: crash, nodes: [3], at_s: 1.2}, {type: sensor-dead, nodes: [5], from_s: 1.2}]"
    run = central(*IDEAL, faults, duration_s=3.49)
    present = sorted(set(run.problem.sensors) - {3, 5})
    assert_beliefs(run, [(step, sorted(run.problem.sensors) if step < 3 else present) for step in range(1, 7)])
    latencies_s = [time_ns / S - event.step / 2 for time_ns, event in run.of(Belief)][1:]
    assert max(latencies_s[:2]) < 0.4 <= min(latencies_s[2:])


def test_scheduled_radios_sleep_and_are_there_when_needed(central):
    runs = {sleep: central(f"algorithm.sleep={sleep}", duration_s=4.0) for sleep in ("none", "scheduled")}
    asleep_s = {sleep: _asleep_s(run) for sleep, run in runs.items()}
    assert asleep_s["none"] == 0.0
    assert asleep_s["scheduled"] == pytest.approx(
        40 * 8 * 0.09, rel=0.1
    )  # .1 s less the guard times of every half second
    awake, scheduled = (runs[sleep].figures() for sleep in ("none", "scheduled"))
    assert scheduled["energy_from_batteries_j"] < awake["energy_from_batteries_j"]
    assert scheduled["fused_readings_mean"] > 0.9 * awake["fused_readings_mean"]


def _asleep_s(run) -> float:
    (_, ledger), *_ = run.of(EnergyLedger)
    rows = zip(ledger.node, ledger.device, ledger.state, ledger.time_s, strict=True)
    return sum(time_s for node, device, state, time_s in rows if (device, state) == ("radio", "sleep") and node != SINK)


def test_every_reading_is_sent_though_it_waits_longer_than_to_the_next_one(central):
    run = central(*IDEAL, "algorithm.spread_s=0.8", "algorithm.deadline_s=0.95", duration_s=6.0)
    figures = run.figures()
    assert figures["fused_readings_least"] == len(run.problem.sensors)
    assert figures["readings_late"] == 0


def test_nodes_stop_when_they_are_told_to(central):
    run = central(*IDEAL, "algorithm.until_s=2", duration_s=9.0)
    assert run.built.simulation.now_ns < 3 * S
    fused = [json.loads(event.fields_json) for _, event in run.of(AlgorithmRecord) if event.kind == "fused"]
    assert [(each["step"], each["readings"]) for each in fused] == [(step, SINK) for step in (1, 2, 3, 4)]


@pytest.mark.parametrize("step", [0, 3, 65_535, 65_539])
def test_a_reading_survives_the_air(step):
    assert decode_reading(encode_reading(step, 1.25, "float16"), "float16") == (step % 65_536, 1.25)


NAN, INFINITE = (encode_reading(1, number, "float32") for number in (math.nan, math.inf))


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x01\x00", b"\x01\x00\x00", b"\x01\x00" + bytes(8), NAN, INFINITE])
def test_what_is_no_reading_is_refused(data):
    with pytest.raises((ValueError, struct.error)):
        decode_reading(data, "float32")


def test_a_deadline_that_cannot_be_met_is_refused(scenarios):
    with pytest.raises(ScenarioError, match="spread_s below deadline_s"):
        load(scenarios / "liu2002" / "central.yaml", ["algorithm.spread_s=0.5"])
