"""The adaptive tolerance: what counts as a change, when it falls, when messages are repeated, and its limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import rel_entr

from netsim.errors import ScenarioError
from netsim.kernels.adaptive_tolerance import AdaptiveTolerance, LossSuspicion
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.communication import CommunicationRule, EdgeMemory, View
from netsim.kernels.semiring import Semiring, log_normalise, uniform
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.problems.association import AssociationParameters, UniformTargets, build
from netsim.rng import Streams

LOGS = st.lists(st.floats(-20.0, 0.0), min_size=4, max_size=4).map(np.array)
RULE = AdaptiveTolerance()
SEND_ALL_CHANGES = AdaptiveTolerance(settled=0.0, first=1.0, unchanged=1.0)


def vertices_of(seed, targets=12):
    grid_m = np.array([(5.0 * x, 5.0 * y) for y in range(3) for x in range(3)])
    parameters = AssociationParameters(targets=UniformTargets(count=targets), prior_mean="drawn", variance="total")
    return instance_vertices(build(parameters, grid_m, range(9), Streams(seed)).instance)


@given(LOGS, LOGS, LOGS)
def test_change_is_the_divergence_of_the_receivers_belief(new, old, elsewhere):
    beliefs = [np.exp(log_normalise(message + elsewhere)) for message in (new, old)]
    expected = rel_entr(*beliefs).sum()
    plain = replace(RULE, unchanged=1.0).change(new, old, elsewhere)
    assert plain == pytest.approx(expected, rel=1e-9, abs=1e-9)
    found = RULE.change(new, old, elsewhere)
    assert found in (plain, plain / RULE.unchanged)


def test_a_change_that_leaves_the_best_state_counts_a_fraction():
    old, surer, other = np.log([0.6, 0.4]), np.log([0.9, 0.1]), np.log([0.4, 0.6])
    nothing, plain = np.zeros(2), replace(RULE, unchanged=1.0)
    assert RULE.change(surer, old, nothing) == plain.change(surer, old, nothing) / RULE.unchanged
    assert RULE.change(other, old, nothing) == plain.change(other, old, nothing)
    assert RULE.change(surer, uniform(2), nothing) == plain.change(surer, uniform(2), nothing)  # from a tie it decides
    tied, clear = np.log([0.4, 0.4, 0.2]), np.log([0.5, 0.3, 0.2])
    assert RULE.change(tied, clear, np.zeros(3)) == plain.change(tied, clear, np.zeros(3))  # a decision is taken back


def test_states_that_the_receiver_excludes_do_not_count():
    new, old = np.log([0.5, 0.25, 0.25]), np.log([0.5, 0.25, 0.01])
    assert RULE.change(new, old, np.array([0.0, 0.0, -np.inf])) == pytest.approx(0.0, abs=1e-12)
    assert RULE.change(np.array([0.0, -np.inf]), np.array([-np.inf, 0.0]), np.zeros(2)) == np.inf


def test_the_tolerance_falls_and_stays():
    rule = AdaptiveTolerance(settled=0.1, first=4.0, decay=0.5)
    assert [rule.in_round(number) for number in (1, 2, 3, 4)] == pytest.approx([0.4, 0.2, 0.1, 0.1])
    assert rule.rounds_until_settled == 3
    assert AdaptiveTolerance(first=1.0).rounds_until_settled == 1


@given(st.floats(0.001, 0.95), st.floats(0.01, 0.5))
def test_repeats_are_just_enough(loss, share):
    rule = AdaptiveTolerance(lost_share=share, most_repeats=10**6)
    repeats = rule.repeats(loss)
    assert loss ** (1 + repeats) <= share * (1 + 1e-6)
    assert repeats == 0 or loss**repeats > share * (1 - 1e-6)
    assert AdaptiveTolerance(most_repeats=0).repeats(loss) == rule.repeats(0.0) == 0


def test_a_missing_start_message_and_a_repeat_are_signs_of_loss():
    message = uniform(3)
    calm = LossSuspicion(RULE, (1, 2))
    calm.listen({1: message, 2: message})
    calm.listen({1: message, 2: np.log([0.2, 0.3, 0.5])})
    again = message.copy()
    calm.listen({1: again, 2: message})
    assert calm.repeats == 0  # a first computed message may be equal to the start message
    calm.listen({1: again.copy(), 2: message})
    assert calm.loss == RULE.rumoured_loss
    missed = LossSuspicion(RULE, (1, 2))
    missed.listen({1: message})
    assert missed.loss == 0.5
    assert missed.repeats > calm.repeats > 0


def test_who_is_never_heard_counts_as_dead_and_not_as_loss():
    message = uniform(3)
    suspicion = LossSuspicion(RULE, (1, 2, 3, 4))
    for _ in range(RULE.rounds_until_settled):
        suspicion.listen({1: message, 2: message, 3: message})
        assert suspicion.loss == pytest.approx(2.0 / 6.0)
    suspicion.listen({1: message, 2: message, 3: message})
    assert suspicion.repeats == 0
    suspicion.listen({1: message, 2: message, 3: message, 4: message})  # alive after all
    assert suspicion.loss == pytest.approx(2.0 / 6.0)


def test_the_last_message_is_repeated_and_no_more_often_than_asked():
    memory = EdgeMemory(CommunicationRule(adaptive=AdaptiveTolerance(first=1.0)), np.ones(2))
    message = np.log([0.9, 0.1])
    decisions = [memory.decide(message, View(number, repeats=2)) for number in range(1, 6)]
    assert [(each.send, each.repeat) for each in decisions] == [(True, False), (True, True), (True, True)] + [
        (False, False)
    ] * 2
    assert all(np.array_equal(each.message, message) and each.message is not message for each in decisions[1:3])


@given(st.integers(0, 10_000))
@settings(max_examples=8, deadline=None)
def test_without_its_tolerances_it_is_max_product(seed):
    """With the constants at zero every change of a belief is sent: the same messages where a receiver can notice."""
    vertices = vertices_of(seed)
    rule = CommunicationRule(adaptive=SEND_ALL_CHANGES)
    plain = run_synchronous(vertices, Semiring.MAX, 12, stop_when_converged=False)
    adaptive = run_synchronous(vertices, Semiring.MAX, 12, rule, stop_when_converged=False)
    assert adaptive.messages_sent < plain.messages_sent
    if plain.converged_round is None:
        return
    for vertex in vertices:
        if isinstance(vertex, SensorVertex):
            decisions = [vertex.decide(result.incoming[vertex.id]) for result in (plain, adaptive)]
            np.testing.assert_array_equal(*decisions)


def test_a_huge_tolerance_leaves_the_start_round():
    rule = CommunicationRule(adaptive=AdaptiveTolerance(settled=1e9))
    result = run_synchronous(vertices_of(1), Semiring.MAX, 8, rule)
    assert [bool(count.sent) for count in result.rounds] == [True] + [False] * (len(result.rounds) - 1)
    assert result.converged_round == rule.first_quiet_round


@pytest.mark.parametrize("first", ["init", "both"])
def test_no_message_is_repeated_where_none_is_lost_and_some_are_where_some_are(first):
    rule = CommunicationRule(adaptive=RULE, first_round=first)
    vertices, rng = vertices_of(2), np.random.default_rng(1)
    chances = rng.random((20, 40, 40))
    calm = run_synchronous(vertices, Semiring.MAX, 10, rule, stop_when_converged=False)
    never = run_synchronous(vertices, Semiring.MAX, 10, rule, stop_when_converged=False, lost=lambda *_: False)
    lossy = run_synchronous(
        vertices, Semiring.MAX, 10, rule, stop_when_converged=False, lost=lambda n, s, t: bool(chances[n, s, t] < 0.3)
    )
    assert calm.rounds == never.rounds
    no_repeats = CommunicationRule(adaptive=replace(RULE, most_repeats=0), first_round=first)
    bare = run_synchronous(vertices, Semiring.MAX, 10, no_repeats, stop_when_converged=False)
    assert calm.rounds == bare.rounds
    assert lossy.messages_sent > calm.messages_sent


@pytest.mark.parametrize(
    "wrong", [{"settled": -1.0}, {"unchanged": 0.5}, {"first": 0.0}, {"decay": 1.0}, {"lost_share": 0.0}]
)
def test_wrong_constants_are_refused(wrong):
    with pytest.raises(ScenarioError, match="adaptive tolerance"):
        AdaptiveTolerance(**wrong)


def test_a_limit_of_messages_needs_what_was_last_sent():
    with pytest.raises(ScenarioError, match="last_sent"):
        CommunicationRule(tolerance=0.1, messages_per_round=1, compare_with="previous_generated")
    with pytest.raises(ScenarioError, match="1 or more"):
        CommunicationRule(messages_per_round=0)
