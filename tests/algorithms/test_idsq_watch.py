"""Watchdogs begin tracks and end them; several tracks, several threads; outliers; sleep."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from idsq_rig import RADIO, Run, S, world

from netsim.algorithms.idsq import Idsq
from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.errors import AlgorithmError
from netsim.kernels.acoustics import AmplitudeModel
from netsim.kernels.gating import detection_threshold
from netsim.kernels.grid_belief import Grid
from netsim.kernels.tracking_model import TrackingKnowledge
from netsim.scenario.load import load
from netsim.trace.events import EnergyLedger, Estimate, Handoff, MessageSent

CSMA = "{type: csma}"
WATCHED = "first_leader: none\n  watchdogs: border"
ALL_WATCH = "first_leader: none\n  watchdogs: all"
WATCHING = "robust: true, watch: {detection_amplitude: 1}"


def watched(folder, algorithm=WATCHING, *, problem=WATCHED, **more):
    return Run(world(folder, algorithm, medium=RADIO, mac=CSMA, problem=problem, **more))


def tracks(run, kind="track-begun"):
    return [(time_ns / S, event.node, json.loads(event.fields_json)) for time_ns, event in run.records(kind)]


def test_the_threshold_is_the_quantile_of_the_noise():
    model, rng = AmplitudeModel(sd=0.1), np.random.default_rng(5)
    noise = 0.1 * rng.standard_normal(400_000)
    threshold = detection_threshold(model, 0.001)
    assert threshold == pytest.approx(0.309023, abs=1e-6)
    alarms = int((noise > threshold).sum())
    assert abs(alarms - 400) < 5 * 20


def test_a_target_is_found_tracked_and_let_go_and_then_the_network_is_quiet(tmp_path):
    run = watched(tmp_path, enters_s=3, duration_s=28)
    ((begun_s, node, fields),) = tracks(run)
    assert 3.0 < begun_s < 4.0
    assert fields["track"] >> 16 == node + 1
    leaves_s = 3 + 120 / 7
    ((ended_s, _, ended),) = tracks(run, "track-ended")
    assert ended["track"] == fields["track"]
    assert leaves_s < ended_s < leaves_s + 4.5
    assert np.mean(run.errors_m(from_s=begun_s + 1)) < 12.0
    sent_s = [time_ns / S for time_ns, _ in run.of(MessageSent)]
    assert min(sent_s) > 3.0
    assert max(sent_s) < ended_s + 0.6


def test_the_loudest_of_those_in_reach_begins(tmp_path):
    run = watched(tmp_path, problem=ALL_WATCH)
    ((begun_s, node, _),) = tracks(run)
    loudness = {
        other: run.problem.loudness(other, round((begun_s - 0.15) * S))
        for other, spec in run.problem.sensors.items()
        if not spec.measures_bearing
    }
    assert node == max(loudness, key=loudness.__getitem__)


def test_nobody_raises_an_alarm_about_noise(tmp_path):
    run = watched(tmp_path, "robust: true", problem=ALL_WATCH, enters_s=30, duration_s=20)
    assert not run.of(MessageSent)


def test_leader_and_guard_both_lost_and_the_watchdogs_begin_anew(tmp_path):
    rules = "\n".join(f"  - {{type: role-crash, role: {role}, at_s: 6.3}}" for role in ("leader", "guard"))
    run = watched(tmp_path, problem=ALL_WATCH, more=f"faults:\n{rules}")
    assert len({node for _, node in run.crashes()}) >= 2
    begun = tracks(run)
    assert len(begun) == 2
    assert 6.3 < begun[1][0] < 6.3 + 4 * 0.5 + 0.5
    assert np.mean(run.errors_m(from_s=begun[1][0] + 1)) < 15.0


def test_two_targets_have_two_tracks(tmp_path):
    second = "- track: {type: straight, from_m: [10, 110], to_m: [110, 110], speed_m_per_s: 7}"
    run = watched(tmp_path, problem=ALL_WATCH, targets=second, duration_s=8)
    begun = {fields["track"]: time_s for time_s, _, fields in tracks(run)}
    assert len(begun) == 2
    errors = {track: [] for track in begun}
    for time_ns, event in run.of(Estimate):
        if time_ns > 3 * S:
            places = [way.at(time_ns) for way in run.problem.tracks]
            errors[event.target].append([np.hypot(event.x_m - x, event.y_m - y) for x, y in places])
    nearest = {track: np.mean(distances, axis=0) for track, distances in errors.items()}
    assert sorted(int(np.argmin(means)) for means in nearest.values()) == [0, 1]
    assert all(means.min() < 12.0 for means in nearest.values())


def test_of_two_tracks_of_one_target_the_younger_ends(tmp_path):
    """Half of the field hears nothing of the other half until 2.2 s, so that both begin a track."""
    parts = "{type: partition, groups: [[0, 1, 2, 6, 7, 8, 12, 13, 14, 18, 19, 20, 24, 25, 26, 30, 31, 32]], to_s: 2.2}"
    run = watched(tmp_path, problem=ALL_WATCH, more=f"faults: [{parts}]")
    assert len({fields["track"] for _, _, fields in tracks(run)}) == 2
    gone = tracks(run, "duplicate")
    assert gone
    assert gone[-1][0] < 2.2 + 4 * 0.5
    left = {event.target for time_ns, event in run.of(Estimate) if time_ns > 5 * S}
    assert left == {tracks(run)[0][2]["track"]}


def test_watchdogs_need_claims():
    """Scenarios without are refused when they are loaded; a node that is given such knowledge otherwise says so."""
    grid = Grid((0.0, 0.0), 5.0, 10, 10)
    knowledge = TrackingKnowledge(None, {}, 40.0, 2, grid, reading_s=0.5, max_speed_m_per_s=15.0, is_watchdog=True)
    with pytest.raises(AlgorithmError, match="`robust: true`"):
        next(Idsq(IdsqParameters()).run(SimpleNamespace(knowledge=knowledge)))


LINE = """
kind: scenario
schema_version: 1
name: line
duration_s: 10
field: {{width_m: 120, height_m: 120}}
nodes:
  - {{name: sensors, placement: {{type: listed, positions_m: [{places}]}}, radio: cc2420, cpu: sh4_7751}}
medium: {{type: unit-disk, radius_m: 45}}
mac: {{type: csma}}
problem:
  type: tracking
  targets: [{{track: {{type: straight, from_m: [60, 20], to_m: [60, 30], speed_m_per_s: 1}}, amplitude: 40}}]
  bearing_share: 0
  neighbourhood_m: 1
  least_neighbours: 0
  watchdogs: all
algorithm: {{type: idsq, robust: true}}
"""
LEADER, FAR, BETWEEN = "[60, 20]", "[60, 95]", "[57, 57], [63, 57]"


def test_who_hears_the_target_but_not_the_leader_is_told_of_the_track_by_those_between(tmp_path):
    """The far node is 75 m from the leader, who hands on to nobody, and hears the target at 65 m and more."""

    def run(*places):
        path = tmp_path / "line.yaml"
        path.write_text(LINE.format(places=", ".join(places)))
        return Run(load(path))

    assert {node for _, node, _ in tracks(run(LEADER, FAR))} == {1}
    told = run(LEADER, FAR, BETWEEN)
    assert not tracks(told)
    sent = [(event.kind, event.source) for time_ns, event in told.of(MessageSent) if time_ns > S]
    alarms = [node for kind, node in sent if kind == "detect"]
    repeated = [node for kind, node in sent if kind == "lead" and node != 0]
    assert set(alarms) == {1}
    assert set(repeated) == {2, 3}
    assert len(alarms) <= len(repeated) < 2 * len(alarms)  # one is quiet where it hears the other in time


@pytest.mark.parametrize("repetition", [11, 15, 93])
def test_a_leader_that_answers_an_alarm_does_not_outdo_its_hand_off(repetition):
    """In these worlds the next leader raises an alarm while the belief is on its way to it."""
    watching = ["algorithm.robust=true", "problem.watchdogs=all", "algorithm.watch={detection_amplitude: 1}"]
    path = Path(__file__).parents[2] / "scenarios/liu2002/radio.yaml"
    run = Run(load(path, [*watching, f"repetition={repetition}", "duration_s=1.4"]))
    sent = [event for time_ns, event in run.of(MessageSent) if time_ns < S]
    (handoff,) = [event for event in sent if event.kind == "handoff"]
    assert any(event.kind == "detect" and event.source == handoff.destination for event in sent)
    assert any(event.kind == "lead" and event.destination == handoff.destination for event in sent)
    assert not run.records("stepped-down")
    assert any(event.node == handoff.destination and time_ns > S for time_ns, event in run.of(Handoff))


# --- threads and outliers ---------------------------------------------------------------------------------------------


def test_threads_have_leaders_of_their_own(tmp_path):
    run = Run(world(tmp_path, "robust: true, threads: 3", medium=RADIO, mac=CSMA, duration_s=10))
    steps = {}
    for _, event in run.of(Handoff):
        steps.setdefault(event.step, []).append(event.node)
    later = {step: nodes for step, nodes in steps.items() if step >= 3}
    assert {len(nodes) for nodes in later.values()} == {3}
    apart = [len(set(nodes)) == 3 for nodes in later.values()]
    assert np.mean(apart) > 0.8
    assert {event.target for _, event in run.of(Estimate)} == {0}


def test_a_second_thread_goes_on_where_a_leader_dies(tmp_path):
    crash = "faults: [{type: crash, nodes: [%d], at_s: 5.25}]"
    algorithm = "robust: false, threads: 2"
    healthy = Run(world(tmp_path, algorithm, duration_s=10))
    victim = next(event.destination for _, event in healthy.of(Handoff) if event.step == 10)
    run = Run(world(tmp_path, algorithm, duration_s=10, more=crash % victim))
    assert run.estimate_gap_s(from_s=2.0, to_s=9.5) < 0.6
    killed = "faults: [{type: role-crash, role: leader, at_s: 5.25}]"
    alone = Run(world(tmp_path, "robust: false", duration_s=10, more=killed))
    assert alone.estimate_gap_s(to_s=9.5) > 4.0


BROKEN = "faults: [{type: sensor-bias, nodes: [%s], bias: 40}]"


def test_outliers_are_counted_and_left_out(tmp_path):
    """Some amplitude sensors that would lead read 40 too much: as if the target were 2 m away or nearer."""
    healthy = Run(world(tmp_path, ""))
    leaders = dict.fromkeys(event.destination for _, event in healthy.of(Handoff))
    loud = [node for node in leaders if not healthy.problem.sensors[node].measures_bearing]
    broken = BROKEN % ", ".join(str(node) for node in loud[1::3])
    errors, counts = {}, {}
    for gate in (0, 0.001):
        run = Run(world(tmp_path, f"gate: {gate}", more=broken))
        errors[gate], counts[gate] = np.mean(run.errors_m(from_s=2.0)), len(run.records("outlier"))
    assert counts[0] == 0
    assert counts[0.001] >= 2
    assert errors[0.001] < errors[0]
    assert len(Run(world(tmp_path, "gate: 0.001")).records("outlier")) <= 3


# --- sleep ------------------------------------------------------------------------------------------------------------


def radio_use(run):
    """Energy in J and time in s of each node's radio by state."""
    ((_, ledger),) = run.of(EnergyLedger)
    use = {}
    rows = zip(ledger.node, ledger.device, ledger.state, ledger.energy_j, ledger.time_s, strict=True)
    for node, device, state, energy_j, time_s in rows:
        if device == "radio":
            before = use.setdefault(node, {}).get(state, (0.0, 0.0))
            use[node][state] = before[0] + energy_j, before[1] + time_s
    return use


def test_a_sleeping_node_spends_sleep_power(tmp_path):
    awake = radio_use(Run(world(tmp_path, "robust: true", medium=RADIO, mac=CSMA, duration_s=10)))
    run = Run(world(tmp_path, "robust: true, sleep: {}", medium=RADIO, mac=CSMA, duration_s=10))
    use = radio_use(run)
    for states in use.values():
        energy_j, time_s = states["sleep"]
        assert energy_j / time_s == pytest.approx(SLEEP_W, rel=1e-3)
    far = use[30]  # at the corner of the field that the target has not reached
    assert far["sleep"][1] > 8.5
    assert far["listen"][1] < 1.5
    assert all("sleep" not in states for states in awake.values())
    total_j = lambda nodes: sum(energy_j for states in nodes.values() for energy_j, _ in states.values())  # noqa: E731
    assert total_j(use) < 0.5 * total_j(awake)
    assert np.mean(run.errors_m(from_s=2.0)) < 12.0


SLEEP_W = 60e-6


@pytest.mark.parametrize(
    ("algorithm", "more"),
    [
        ("robust: true, sleep: {}", {"mac": CSMA}),
        ("robust: true, sleep: {}", {"mac": CSMA, "node": "clock: {drift_sd_ppm: 30, offset_sd_s: 0.001}"}),
        ("sleep: {window_s: 0.3}", {"mac": CSMA}),
        ("", {"mac": "{type: lpl}"}),
        ("robust: true, answer_s: 0.25", {"mac": "{type: lpl}", "problem": "reading_s: 1.0"}),
    ],
)
def test_real_radios_that_sleep_track(tmp_path, algorithm, more):
    run = Run(world(tmp_path, algorithm, medium=RADIO, duration_s=15, **more))
    errors_m = run.errors_m(from_s=3.0)
    assert len(errors_m) > 10
    assert np.mean(errors_m) < 15.0
    assert run.estimate_gap_s(to_s=14.0) < 2.1
