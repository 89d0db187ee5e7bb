"""The IDSQ tracker on links that lose nothing: Table 1 to the bit, and the laws of the hand-off."""

import numpy as np
import pytest
from idsq_rig import Run, S, reference, world

from netsim.trace.events import Belief, EnergyLedger, Estimate, Handoff, MessageDelivered, MessageSent

STEPS = 31


@pytest.mark.parametrize("selection", ["mutual_information", "nearest", "random"])
@pytest.mark.parametrize("robust", ["false", "true"])
def test_a_network_does_what_table_1_says_to_the_bit(tmp_path, selection, robust):
    run = Run(world(tmp_path, f"selection: {selection}, payload: float64, robust: {robust}"))
    expected = reference(run, STEPS, rule=selection)
    beliefs = [event for _, event in run.of(Belief)][1:]  # without the uniform one of step 0
    assert [(event.step, event.node) for event in beliefs] == [(turn.step, turn.leader) for turn in expected]
    for event, turn in zip(beliefs, expected, strict=True):
        assert list(event.cell) == turn.belief.cells.tolist()
        assert list(event.probability) == turn.belief.probability.tolist()
    estimates = [(event.x_m, event.y_m) for _, event in run.of(Estimate)][1:]
    assert estimates == [tuple(turn.belief.mean_m.tolist()) for turn in expected]
    handoffs = [event for _, event in run.of(Handoff)]
    assert [event.destination for event in handoffs] == [turn.successor for turn in expected]
    assert [dict(zip(event.candidate, event.utility, strict=True)) for event in handoffs] == [
        turn.utility for turn in expected
    ]


@pytest.fixture(scope="module", params=["false", "true"])
def run(request, tmp_path_factory):
    return Run(world(tmp_path_factory.mktemp("world"), f"robust: {request.param}"))


def test_there_is_one_hand_off_a_step_from_leader_to_next_leader(run):
    handoffs = [event for _, event in run.of(Handoff)]
    assert [event.step for event in handoffs] == list(range(1, STEPS + 1))
    assert [event.node for event in handoffs[1:]] == [event.destination for event in handoffs[:-1]]


def test_leadership_never_goes_back_and_forth(run):
    leaders = [event.node for _, event in run.of(Handoff)]
    assert all(first != third for first, third in zip(leaders, leaders[2:], strict=False))


def test_only_leader_and_next_leader_exchange_beliefs(run):
    pairs = {(event.node, event.destination) for _, event in run.of(Handoff)}
    sent = [event for _, event in run.of(MessageSent) if event.kind == "handoff"]
    received = [event for _, event in run.of(MessageDelivered) if event.kind == "handoff"]
    assert {(event.source, event.destination) for event in sent} == pairs
    assert {(event.source, event.node) for event in received} == pairs
    assert len(sent) == len(received) == STEPS


def test_there_is_one_leader_but_for_the_time_of_a_hand_off(run):
    times = run.led()
    assert set(times) <= {0, 1, 2}
    assert run.longest(2) < 0.01 * S
    assert run.longest(1) > 15.4 * S if 0 not in times else times[0] < 0.1 * S


def test_beliefs_sum_to_one_and_follow_the_target(run):
    for _, event in run.of(Belief):
        assert sum(event.probability) == pytest.approx(1.0, abs=1e-12)
    errors_m = run.errors_m(from_s=4.0)
    assert np.mean(errors_m) < 12.0


def test_computing_costs_time_and_energy(run):
    ((_, ledger),) = run.of(EnergyLedger)
    rows = zip(ledger.device, ledger.state, ledger.energy_j, strict=True)
    assert sum(energy_j for device, state, energy_j in rows if (device, state) == ("cpu", "active")) > 0.0
