"""Hand-offs that survive: leaders that die at any phase, answers that are lost, links that lose a third, two leaders."""

import json

import numpy as np
import pytest
from idsq_rig import IDEAL, RADIO, Run, S, world

from netsim.trace.events import Estimate, Handoff, MessageDelivered, MessageDropped, MessageSent, Role

CSMA = "{type: csma}"
STEP_S = 0.5
KILLED = 10
"""The step whose leader is killed."""


def robust(folder, *faults, algorithm="robust: true", medium=RADIO, mac=CSMA, duration_s=10, **more):
    rules = "\n".join(f"  - {rule}" for rule in faults)
    text = f"faults:\n{rules}" if faults else ""
    return Run(world(folder, algorithm, medium=medium, mac=mac, duration_s=duration_s, more=text, **more))


def first(events, from_s=0.0, **wanted):
    """Time in s of the first event at or after a time with these fields."""
    return next(
        time_ns / S
        for time_ns, event in events
        if time_ns / S >= from_s and all(getattr(event, name) == value for name, value in wanted.items())
    )


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    return robust(tmp_path_factory.mktemp("healthy"))


def phases(run, step):
    """Instants, in s, of what a leader goes through in a step."""
    begin_s = step * STEP_S
    handoff = next(event for _, event in run.of(Handoff) if event.step == step)
    chosen_s = first(run.of(Handoff), step=step)
    arrived_s = first(run.of(MessageDelivered), chosen_s, kind="handoff", node=handoff.destination)
    taken_s = first(run.of(MessageDelivered), chosen_s, kind="taken", node=handoff.node)
    claimed_s = first(run.of(MessageDelivered), taken_s, kind="lead", source=handoff.node)
    return {
        "as it wakes": begin_s,
        "sensing": begin_s + 0.005,
        "computing": begin_s + 0.012,
        "as it hands on": chosen_s + 1e-4,
        "belief on the air": (chosen_s + arrived_s) / 2.0,
        "as the other takes it": arrived_s + 1e-5,
        "before the claim": taken_s + 1e-5,
        "after the claim": claimed_s + 1e-4,
        "half-way": begin_s + 0.25,
    }


@pytest.mark.parametrize(
    "phase",
    [
        "as it wakes",
        "sensing",
        "computing",
        "as it hands on",
        "belief on the air",
        "as the other takes it",
        "before the claim",
        "after the claim",
        "half-way",
    ],
)
def test_a_track_survives_its_leader_at_any_phase(tmp_path, healthy, phase):
    at_s = phases(healthy, KILLED)[phase]
    run = robust(tmp_path, f"{{type: role-crash, role: leader, at_s: {at_s:.9f}}}")
    assert run.crashes()
    assert run.estimate_gap_s(from_s=at_s, to_s=9.5) < 2.5 * STEP_S
    assert np.mean(run.errors_m(from_s=at_s + 1.5)) < 15.0
    assert run.longest(2) <= STEP_S * S


def test_the_guard_says_whom_it_lost(tmp_path, healthy):
    at_s = phases(healthy, KILLED)["half-way"]
    run = robust(tmp_path, f"{{type: role-crash, role: leader, at_s: {at_s}}}")
    ((_, record),) = run.records("taken-back")
    ((_, lost),) = run.crashes()
    assert json.loads(record.fields_json)["lost"] == lost
    handoff = next(event for _, event in run.of(Handoff) if event.step == KILLED)
    assert handoff.destination == lost
    assert record.node == handoff.node


def link_down(run, step, duration_s):
    """A rule that cuts the way back from who takes the belief of a step, as the answer comes."""
    handoff = next(event for _, event in run.of(Handoff) if event.step == step)
    sent_s = first(run.of(MessageSent), step * STEP_S, kind="taken", source=handoff.destination)
    links = f"links: [[{handoff.destination}, {handoff.node}]], both_directions: false"
    return f"{{type: outage, {links}, from_s: {sent_s - 1e-5:.9f}, to_s: {sent_s + duration_s:.9f}}}"


@pytest.fixture(scope="module")
def on_ideal_links(tmp_path_factory):
    return robust(tmp_path_factory.mktemp("ideal"), medium=IDEAL, mac=IDEAL)


def test_a_lost_answer_changes_nothing_but_a_repetition(tmp_path, on_ideal_links):
    run = robust(tmp_path, link_down(on_ideal_links, KILLED, 0.01), medium=IDEAL, mac=IDEAL)
    leaders = lambda run: [(event.step, event.node, event.destination) for _, event in run.of(Handoff)]  # noqa: E731
    assert leaders(run) == leaders(on_ideal_links)
    count = lambda run, kind: sum(event.kind == kind for _, event in run.of(MessageSent))  # noqa: E731
    assert count(run, "taken") == count(on_ideal_links, "taken") + 1
    assert count(run, "handoff") == count(on_ideal_links, "handoff") + 1


def test_of_two_that_took_a_belief_one_steps_down(tmp_path, on_ideal_links):
    """Every answer is lost: the belief goes to a second node too, in a later epoch, whose claim the first one heeds."""
    run = robust(tmp_path, link_down(on_ideal_links, KILLED, 0.3), medium=IDEAL, mac=IDEAL)
    ((_, record),) = run.records("stepped-down")
    assert record.node == next(event for _, event in on_ideal_links.of(Handoff) if event.step == KILLED).destination
    assert 0.1 * S < run.longest(2) < STEP_S * S
    assert run.estimate_gap_s(to_s=9.5) < 1.5 * STEP_S


def test_a_leader_that_was_cut_off_steps_down_when_it_hears_of_its_successor(tmp_path, healthy):
    handoff = next(event for _, event in healthy.of(Handoff) if event.step == KILLED)
    cut = f"{{type: outage, nodes: [{handoff.destination}], from_s: 5.3, to_s: 6.7}}"
    run = robust(tmp_path, cut)
    assert [event.node for _, event in run.records("taken-back")] == [handoff.node]
    assert handoff.destination in [event.node for _, event in run.records("stepped-down")]
    together_ns = run.longest(2)
    assert 0.3 * S < together_ns < (6.7 - 5.3 + 2 * STEP_S) * S
    assert np.mean(run.errors_m(from_s=7.5)) < 15.0


def test_a_third_of_all_frames_lost(tmp_path):
    run = robust(tmp_path, medium="{type: ideal, loss_probability: 0.3}", duration_s=15)
    assert sum(1 for _, event in run.of(Estimate)) >= 28
    assert run.estimate_gap_s(to_s=14.5) < 2.5 * STEP_S
    assert np.mean(run.errors_m(from_s=2.0)) < 15.0
    assert run.longest(2) < 2 * STEP_S * S


@pytest.mark.slow
def test_a_third_of_all_frames_lost_in_many_runs(tmp_path):
    longest = []
    for seed in range(1, 21):
        kill = "{type: role-crash, role: leader, at_s: 4, spread_s: 3}"
        run = robust(tmp_path, kill, medium="{type: ideal, loss_probability: 0.3}", duration_s=14, seed=seed)
        ((time_ns, _),) = run.crashes()
        assert run.estimate_gap_s(from_s=time_ns / S, to_s=13.0) < 4 * STEP_S
        longest.append(run.longest(2))
    assert max(longest) < 3 * STEP_S * S


def test_guards_are_relieved_by_the_next_hand_off(healthy):
    times = healthy.led("guard")
    assert max(times) <= 3
    assert sum(ns for count, ns in times.items() if count in (1, 2)) > 0.9 * sum(times.values())


def test_a_leader_that_reboots_does_not_begin_anew(tmp_path):
    run = robust(tmp_path, "{type: role-crash, role: leader, at_s: 0.3, reboot_after_s: 0.4}", duration_s=3)
    ((_, node),) = run.crashes()
    assert [event.node for _, event in run.of(Role) if event.role == "leader"] == [node, node]
    assert not [event for _, event in run.of(MessageDropped) if event.kind == "handoff"]
