"""The tracker at odds: clocks that are wrong, energy that is used up, hand-offs that come twice, sensors that are dead."""

import math
from types import SimpleNamespace

import pytest
from idsq_rig import RADIO, Run, S, world

from netsim.algorithms.idsq import Idsq
from netsim.algorithms.idsq_messages import (
    ALIVE,
    HANDOFF,
    LEAD,
    TAKEN,
    Claim,
    Held,
    Thread,
    Turn,
    decode_handoff,
    encode_claim,
    encode_taken,
    turn_of,
)
from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.algorithms.idsq_payload import BeliefCoder, BeliefForms
from netsim.algorithms.idsq_station import Station
from netsim.errors import ScenarioError
from netsim.kernels.acoustics import AmplitudeModel, SensorSpec
from netsim.kernels.grid_belief import Grid, uniform
from netsim.kernels.tracking_model import TrackingKnowledge
from netsim.testing import run_algorithm
from netsim.trace.events import AlgorithmRecord, Belief, EnergyBudget, Log, NodeLife, Role

CSMA = "{type: csma}"
GRID = Grid((0.0, 0.0), 5.0, 10, 10)
SPECS = {node: SensorSpec((10.0 * node, 20.0), AmplitudeModel()) for node in (1, 2, 3)}


def knowledge(node):
    """Nodes 1 to 3 track; node 0 is nobody's neighbour."""
    others = {other: spec for other, spec in SPECS.items() if other != node}
    return TrackingKnowledge(SPECS.get(node), others, 40.0, 1, GRID, 0.5, 15.0)


def failures(run):
    return [event.reason for _, event in run.of(NodeLife) if event.event == "failed"]


@pytest.mark.parametrize("seed", [5, 6])
def test_a_first_leader_whose_clock_is_behind_leads(tmp_path, seed):
    run = Run(world(tmp_path, "", seed=seed, duration_s=3, node="clock: {offset_sd_s: 0.05}"))
    first = run.built.simulation.nodes[run.problem.first_leader]
    assert first.parts.clock.at(0) < 0
    assert run.of(Role)[0] == (0, Role(first.identity.id, "leader", 1))
    assert len(run.of(Belief)) >= 6


def test_a_first_leader_whose_clock_is_past_the_first_reading_says_that_it_does_not_lead(tmp_path):
    run = Run(world(tmp_path, "", seed=1, duration_s=1, node="clock: {offset_sd_s: 5}"))
    ((time_ns, log),) = run.of(Log)
    assert (time_ns, log.name) == (0, f"node {run.problem.first_leader}")
    assert "told to lead first" in log.message
    assert not run.of(Role)


@pytest.mark.parametrize("algorithm", ["robust: false", "robust: true, selection: all"])
def test_who_may_draw_no_more_falls_silent_and_does_not_fail(tmp_path, algorithm):
    """Nodes may draw .25 J in 3 s, which lasts for 2.5 s or so."""
    run = Run(world(tmp_path, algorithm, medium=RADIO, mac=CSMA, node="budget: {allowance_j: 0.25, per: 3}"))
    assert {event.event for _, event in run.of(EnergyBudget)} >= {"short", "refused", "replenished"}
    assert failures(run) == []
    assert any("leads no more" in log.message for _, log in run.of(Log))
    assert sum(1 if event.holds else -1 for _, event in run.of(Role) if event.role == "leader") == 0


def test_watchdogs_find_the_target_again_when_allowances_are_replenished(tmp_path):
    more = {"node": "budget: {allowance_j: 0.25, per: 3}", "problem": "watchdogs: all"}
    run = Run(world(tmp_path, "robust: true", medium=RADIO, mac=CSMA, duration_s=12, **more))
    assert failures(run) == []
    periods = {int(time_ns // (3 * S)) for time_ns, _ in run.of(Belief)}
    assert periods == {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("left_j", "left_of_allowance_j", "allowance_j", "share"),
    [(50.0, 3.0, 4.0, 0.5), (50.0, 1.0, 4.0, 0.25), (50.0, math.inf, math.inf, 0.5), (math.inf, 1.0, 4.0, 0.25)],
)
def test_the_share_of_energy_that_a_node_tells_is_the_shorter_of_battery_and_allowance(
    left_j, left_of_allowance_j, allowance_j, share
):
    budget = SimpleNamespace(left_j=left_of_allowance_j, allowance_j=allowance_j)
    node = SimpleNamespace(energy_left_j=2.0 * left_j, budget=budget)
    station = Station(node, knowledge(1), SPECS[1], IdsqParameters())
    node.energy_left_j = left_j
    assert station.own_energy_share == share


@pytest.mark.parametrize("payload", ["float64", "float32", "float16", "uint8"])
def test_a_tracker_that_drops_no_cell_tracks_in_every_precision(tmp_path, payload):
    run = Run(world(tmp_path, f"least_probability: 0, payload: {payload}", duration_s=6))
    assert failures(run) == []
    assert len(run.of(Belief)) == 12
    assert min(min(event.probability) for _, event in run.of(Belief)) > 0.0


def test_the_first_update_of_a_new_track_takes_its_time(tmp_path):
    """Ten ms to sense, 150 to elect, and then what the processor needs for a square of 100 m."""
    run = Run(world(tmp_path, "robust: true", problem="watchdogs: all\n  first_leader: none", duration_s=2))
    time_ns, _ = next((time_ns, event) for time_ns, event in run.of(Role) if event.role == "leader")
    assert 160_000_000 < time_ns % (S // 2) < 163_000_000


GARBLED = (
    "faults: [{type: corruption, share: 0.2, undetected_share: 1}, {type: duplication, share: 0.3, mean_delay_s: 0.3}]"
)


@pytest.mark.parametrize("seed", [4, 9])
def test_messages_of_garbage_are_survived(tmp_path, seed):
    """Such as queries that end too early, readings beyond all bounds, and messages of nodes that do not exist."""
    run = Run(
        world(tmp_path, "robust: true, selection: all", seed=seed, medium=RADIO, mac=CSMA, duration_s=3.5, more=GARBLED)
    )
    assert failures(run) == []


@pytest.mark.parametrize("algorithm", ["watch: {false_alarm: 0.5}", "watch: {false_alarm: 0}", "threads: 256"])
def test_settings_without_a_meaning_are_refused(tmp_path, algorithm):
    """A threshold at or below no sound, one that nothing reaches, threads whose number no byte holds."""
    with pytest.raises(ScenarioError, match="expected a"):
        world(tmp_path, f"robust: true, {algorithm}")


# --- hand-offs by hand --------------------------------------------------------------------------------------------------


class HandsOver:
    """Node 0 sends node 1 the same belief at some instants; the others run the tracker."""

    def __init__(self, times_s, quiet, parameters):
        self._times_s = times_s
        self._quiet = quiet
        self._parameters = parameters

    def run(self, node):
        if node.id != 0:
            yield from Idsq(self._parameters).run(node)
            return
        held = Held(Thread(0), Turn(0, 0), uniform(GRID), quiet=self._quiet)
        laid = BeliefCoder(GRID, "float32", self._parameters.belief).encode(held.belief)
        for time_s in self._times_s:
            yield from node.pause_until(round(time_s * S))
            node.send(1, HANDOFF, held.header + laid.data)


def handed(times_s, observation=(2.0,), quiet=0, until_s=1.4, **settings):
    algorithm = HandsOver(times_s, quiet, IdsqParameters(until_s=until_s, **settings))
    return run_algorithm(algorithm, 4, knowledge=knowledge, observe=lambda _: observation)


@pytest.mark.parametrize("robust", [False, True])
def test_a_hand_off_that_comes_again_after_the_node_has_handed_on_is_not_led_again(robust):
    run = handed([0.1, 0.9], robust=robust).require_success()
    led = [(event.node, event.holds) for _, event in run.of(Role) if event.role == "leader"]
    assert led.count((1, 1)) == 1
    assert len({node for node, _ in led}) > 1


def claims(node, time_s, leader):
    """Node 0 says who leads what it has handed over."""
    yield from node.pause_until(round(time_s * S))
    node.send(1, LEAD, encode_claim(Claim(Thread(0), Turn(0, 0), leader, (0.0, 0.0)), GRID.origin_m))


class HandsOverAndClaims(HandsOver):
    """What node 0 says as it hands the belief on comes after the belief."""

    def run(self, node):
        yield from super().run(node)
        if node.id == 0:
            yield from claims(node, 0.2, leader=0)


def test_what_the_leader_before_said_as_it_handed_the_belief_on_makes_nobody_step_down():
    parameters = IdsqParameters(until_s=1.4, robust=True)
    algorithm = HandsOverAndClaims([0.1], 0, parameters)
    run = run_algorithm(algorithm, 4, knowledge=knowledge, observe=lambda _: [2.0]).require_success()
    assert [event.kind for _, event in run.of(AlgorithmRecord)] == []
    assert next((event.node, event.step) for _, event in run.of(Belief)) == (1, 1)


class Forgets(HandsOver):
    """Nodes 2 and 3 take a belief, and answer that whoever gave it leads."""

    def run(self, node):
        if node.id not in (2, 3):
            yield from super().run(node)
            return
        while True:
            message = yield from node.receive(kinds={HANDOFF, ALIVE}, timeout_ns=2 * S)
            if message is None:
                return
            if message.kind == HANDOFF:
                held = decode_handoff(message.payload, message.source, BeliefCoder(GRID).decode)
                node.send(message.source, TAKEN, encode_taken(held, 1.0))
            else:
                claim = Claim(*turn_of(message.payload), message.source, (0.0, 0.0))
                node.send(message.source, LEAD, encode_claim(claim, GRID.origin_m))


def test_a_guard_that_is_told_to_lead_takes_the_track_back():
    parameters = IdsqParameters(until_s=2.4, robust=True)
    run = run_algorithm(Forgets([0.1], 0, parameters), 4, knowledge=knowledge, observe=lambda _: [2.0])
    kinds = [(event.node, event.kind) for _, event in run.require_success().of(AlgorithmRecord)]
    assert len(kinds) >= 2  # the one that it hands on to then forgets it too
    assert set(kinds) == {(1, "taken-back")}


@pytest.mark.parametrize(("form", "operations"), [("grid", 100 * 24), ("gaussian", 100 * 35)])
def test_the_receiver_pays_for_reading_a_belief_by_its_form(form, operations):
    """Of 100 cells, before it senses: the bench's processor makes a million operations a second at 1 mW."""
    belief = BeliefForms(forms=("grid", form), most_divergence_bit=100.0)
    run = handed([0.1], belief=belief, until_s=0.4).require_success()
    assert run.energy_j[1] == pytest.approx(operations * 1e-9)
    assert run.energy_j[2] == 0.0


@pytest.mark.parametrize(("observation", "quiet"), [([], 2), ([0.0], 3), ([2.0], 0)])
def test_no_reading_does_not_tell_that_there_is_a_target(observation, quiet):
    run = handed([0.1], observation, quiet=2, until_s=0.9).require_success()
    (message,) = [each for node in (2, 3) for each in run.delivered[node] if each.kind == HANDOFF]
    assert decode_handoff(message.payload, 1, BeliefCoder(GRID).decode).quiet == quiet
