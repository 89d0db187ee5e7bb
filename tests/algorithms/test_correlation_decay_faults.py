"""Correlation decay when messages, owners and readings are missing, positions are rounded, and energy is short: intervals
hold, runs end, and nothing is computed twice.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from decay_rig import (
    WHOLE,
    any_delay,
    any_loss,
    by_kernel,
    holds,
    narrowed_truth,
    parameters,
    problem,
    shipped,
    stated,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.algorithms.correlation_decay_parameters import TargetParameters
from netsim.algorithms.decay_payload import decode_request
from netsim.api import NoEnergyError
from netsim.errors import ScenarioError
from netsim.kernels.correlation_decay import literal_pair, vertex_order
from netsim.kernels.event_association import EventAssociationInstance, EventModel, PredictedEvent
from netsim.kernels.matchings import association_probabilities
from netsim.problems.event_association import EventAssociationProblem
from netsim.scenario.load import load
from netsim.testing import DROP, duplicate, rule
from netsim.trace.events import Log, MessageSent

fast = settings(deadline=None, max_examples=8)
seeds = st.integers(0, 2**32 - 1)
nodes = st.integers(10, 17)
REQUESTS = parameters(WHOLE, estimator="literal", depth=4, factors="requests", vertices="known")
MODES = st.sampled_from([REQUESTS, parameters(2, depth=4), parameters(1, "sensing", depth=5)])
TARGET = TargetParameters(interval_width=0.01)


def count(found, kind):
    return sum(event.kind == kind for _, event in found.run.of(MessageSent))


def is_algorithm_2(scene, found):
    right = by_kernel(
        scene, lambda graph, j, k: literal_pair(graph, j, k, 4, vertex_order(graph, "measurements_first"))
    )
    assert found.probabilities == pytest.approx(right, rel=1e-11)


@settings(deadline=None, max_examples=3)
@given(seeds, MODES, st.sampled_from([None, TARGET]))
def test_with_a_third_of_the_messages_lost_all_pairs_are_told_of_and_intervals_hold(seed, chosen, target):
    in_spite_of_loss(seed, chosen, target)


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(seeds, MODES, st.sampled_from([None, TARGET]))
def test_intervals_hold_in_many_worlds_with_a_third_of_the_messages_lost(seed, chosen, target):
    in_spite_of_loss(seed, chosen, target)


def in_spite_of_loss(seed, chosen, target):
    scene = problem(seed)
    found = stated(scene, replace(chosen, target=target), [any_loss(seed, 0.3), any_delay(seed, 3.0)])
    assert len(found.told) == np.count_nonzero(scene.instance.weights)
    holds(scene, found)


@fast
@given(seeds, MODES, nodes, st.sampled_from([0.0, 0.5, 1.0, 40.0]), st.sampled_from([None, TARGET]))
def test_a_node_cut_off_at_any_time_leaves_intervals_that_hold(seed, chosen, dead, from_s, target):
    scene = problem(seed)
    silence = [rule(DROP, source=dead, from_s=from_s), rule(DROP, destination=dead, from_s=from_s)]
    found = stated(scene, replace(chosen, target=target), silence)
    assert len(found.told) == np.count_nonzero(scene.instance.weights)
    holds(scene, found)


@fast
@given(seeds, nodes, MODES, st.sampled_from([None, TARGET]))
def test_a_sensor_that_had_no_energy_to_measure_does_not_say_that_there_is_nothing(seed, tired, chosen, target):
    scene = problem(seed)

    def observe(node):
        if node == tired:
            message = "the allowance is used up"
            raise NoEnergyError(message)
        return scene.observe(node, 0)

    found = stated(scene, replace(chosen, target=target), observe=observe)
    holds(scene, found)
    unseen = [j for j, owner in enumerate(scene.instance.owners) if owner == tired]
    assert {j for j, _ in found.told}.isdisjoint(unseen)


def owned_elsewhere(scene):
    """A node that owns an event, which others have measurements of."""
    return max((event.owner for event in scene.instance.events), key=lambda node: len(scene.observe(node, 0)) > 0)


def test_a_dead_owner_is_stood_in_for_and_no_more_asked_once_it_was_silent():
    """Who stands in knows what it needs to, so that the answer is the same."""
    scene, asked = problem(3), []
    dead = owned_elsewhere(scene)

    def lose(passage):
        if passage.kind != "factors" or dead not in (passage.source, passage.destination):
            return None
        asked.append((passage.source, decode_request(passage.payload).number, passage.time_ns))
        return DROP

    found = stated(scene, REQUESTS, [lose])
    is_algorithm_2(scene, found)
    given_up_ns = {}
    for time_ns, event in found.run.of(Log):
        if f"node {dead} does not answer" in event.message:
            given_up_ns.setdefault(event.name, time_ns)
    begun_ns = {}
    for source, number, time_ns in asked:
        begun_ns.setdefault((source, number), time_ns)
    others = {key: time_ns for key, time_ns in begun_ns.items() if key[0] != dead}
    assert others
    assert all(time_ns < given_up_ns[f"node {source}"] for (source, _), time_ns in others.items())
    times = Counter((source, number) for source, number, _ in asked if source != dead)
    assert set(times.values()) == {REQUESTS.request_attempts}
    assert found.statistics["factors_stood_in"] > len(others)


def test_more_attempts_bear_more_losses():
    """The first four requests on every way are lost."""
    scene, lost = problem(3), [rule(DROP, kind="factors", counts=range(4))]
    found = stated(scene, replace(REQUESTS, request_attempts=5), lost)
    is_algorithm_2(scene, found)
    assert found.statistics["factors_stood_in"] == 0


@pytest.mark.parametrize(("kind", "lost"), [("product", {0, 2}), ("factors", {0})])
def test_what_is_lost_is_sent_again_and_not_computed_again(kind, lost):
    scene = problem(3)
    whole = stated(scene, REQUESTS)
    found = stated(scene, REQUESTS, [rule(DROP, kind=kind, counts=lost)])
    is_algorithm_2(scene, found)
    assert found.statistics["factors_stood_in"] == 0
    assert found.statistics["factor_requests"] == whole.statistics["factor_requests"]
    assert count(found, "factors") > count(whole, "factors")
    assert found.run.energy_j == pytest.approx(whole.run.energy_j)


def test_duplicates_change_nothing_and_are_not_computed_again():
    scene = problem(3)
    whole = stated(scene, REQUESTS)
    found = stated(scene, REQUESTS, [rule(duplicate(0.3))])
    assert found.told == whole.told
    assert found.statistics["factor_requests"] == whole.statistics["factor_requests"]
    assert found.run.energy_j == pytest.approx(whole.run.energy_j)


@settings(deadline=None, max_examples=12)
@given(seeds, st.sampled_from(["float32", "float16"]), st.sampled_from([0.0, 700.0]), st.integers(0, WHOLE))
def test_with_rounded_positions_intervals_hold_for_the_problem_of_the_rounded(seed, width, away_m, hops):
    """Far from the origin a float16 position is rounded to half a metre; gates and likelihoods move with it."""
    scene = problem(seed, away_m=away_m)
    right = narrowed_truth(scene, width)
    found = stated(scene, parameters(hops, depth=5, payload=width))
    assert set(found.told) == {(j, k) for j, k in np.argwhere(right > 0.0).tolist()}
    for pair, (_, low, high) in found.told.items():
        assert low - 1e-12 <= right[pair] <= high + 1e-12


def test_a_sensor_that_is_out_of_reach_only_by_rounding_is_not_forgotten():
    """In float16 the event at 700.24 m is at 700 m, half a metre beyond reach of sensor 1, whose measurement is in its gate
    all the same; sensor 2 has no report of it.
    """
    model = EventModel((10.03**2, 0.0, 10.03**2), 4.0, 0.8, 1e-3)
    instance = EventAssociationInstance(
        (1, 2), np.array([(720.2, 0.0), (700.0, 0.0)]), (PredictedEvent(0, 2, 700.24, 0.0),), model
    )
    scene = EventAssociationProblem(instance, {1: (730.2, 0.0), 2: (700.0, 0.0)}, 10.0, np.empty((0, 2)))
    right = narrowed_truth(scene, "float16")
    assert (right > 0.0).all()
    _, low, high = stated(scene, parameters(0, depth=4, payload="float16")).told[1, 0]
    assert low <= right[1, 0] <= high


def test_against_measured_positions_rounded_ones_can_miss():
    """What `payload` says of `interval_misses`."""
    misses = 0
    for seed in range(3):
        scene = problem(seed, away_m=700.0)
        exact = association_probabilities(scene.instance.weights)
        found = stated(scene, parameters(WHOLE, depth=12, payload="float16"))
        misses += sum(not low <= exact[pair] <= high for pair, (_, low, high) in found.told.items())
    assert misses > 0


@pytest.mark.parametrize("at_s", [0.4, 5])
def test_who_crashes_and_reboots_gets_everything_again(scenarios, at_s):
    """During the flood, and when all are through it."""
    whole = shipped(scenarios)
    crash = f"faults=[{{type: crash, nodes: [0, 3, 6], at_s: {at_s}, reboot_after_s: 3}}]"
    found = shipped(scenarios, crash)
    assert found["gated_pairs_told_share"] == 1.0
    assert found["interval_misses"] == 0
    assert found["reports_heard_mean"] == whole["reports_heard_mean"]
    assert found["pair_error_linf"] == pytest.approx(whole["pair_error_linf"], rel=1e-9, abs=1e-12)


def test_deep_recursions_have_room_and_deeper_ones_are_refused(scenarios):
    """On a path of 105 events and as many measurements at one sensor, which are 209 levels; the scenario says what is too
    deep.
    """
    count = 105
    places_m = np.array([(float(number), 0.0) for number in range(2 * count)])
    model = EventModel((0.4, 0.0, 0.4), 4.0, 0.8, 0.1)
    events = tuple(PredictedEvent(number, 1, *place) for number, place in enumerate(places_m[::2].tolist()))
    instance = EventAssociationInstance((1,) * count, places_m[1::2], events, model)
    scene = EventAssociationProblem(instance, {1: (count, 0.0)}, 2.0 * count, np.empty((0, 2)))
    assert np.count_nonzero(instance.weights) == 2 * count - 1
    found = stated(scene, parameters(0, depth=200))
    exact = association_probabilities(instance.weights[:, :12])
    assert found.told.keys() == set(map(tuple, np.argwhere(instance.weights > 0.0).tolist()))
    assert found.probabilities[0, 0] == pytest.approx(exact[0, 0], rel=1e-4)
    with pytest.raises(ScenarioError, match="depth"):
        load(scenarios / "oh2010" / "network.yaml", ["algorithm.depth=201"])


def test_a_sensor_that_misreads_is_what_intervals_do_not_cover(scenarios):
    """A dead sensor reports that there is nothing, and nobody can know better: what the metric's text says."""
    dead = "faults=[{type: sensor-dead, nodes: [0, 1, 2, 3, 4, 5]}]"
    found = shipped(scenarios, dead)
    assert found["gated_pairs_told_share"] < 1.0
    assert found["interval_misses"] > 0


CRASH = "faults=[{type: crash, nodes: [0, 3, 6], at_s: 0.5, reboot_after_s: 1}]"


def test_an_allowance_that_is_used_up_leaves_what_holds(scenarios):
    """After a third of a second nothing is passed on, and who reboots cannot measure: nobody takes that for an answer. What
    the others know they compute when there is energy again.
    """
    found = shipped(scenarios, "nodes.0.budget={allowance_j: 0.02, per: 20}", CRASH)
    assert found["interval_misses"] == 0
    assert 0.0 < found["gated_pairs_told_share"] < 1.0
    assert found["events_incomplete_share"] > 0.5


def test_what_there_is_no_energy_to_compute_is_not_stated(scenarios):
    """An allowance that is gone when all reports are there, and never replenished."""
    found = shipped(scenarios, "nodes.0.budget={allowance_j: 0.2}")
    assert found["reports_heard_mean"] == 10.0
    assert found["gated_pairs_told_share"] == 0.0
