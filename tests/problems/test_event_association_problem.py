"""Drawing measurement-to-event association: who owns what, what nodes know before they measure, and what must not tell."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.event_association import EventAssociationInstance
from netsim.problems.event_association import (
    DrawnEvents,
    EventAssociationParameters,
    GeneratedMeasurements,
    ListedEvents,
    UniformMeasurements,
    build,
)
from netsim.rng import Streams
from netsim.trace.events import TruthTargets

fast = settings(deadline=None, max_examples=8)
FIELD_M = (-20.0, 30.0, 80.0, 90.0)
PAPER = EventAssociationParameters()
seeds = st.integers(0, 2**32 - 1)
OWNERSHIPS = st.builds(
    replace,
    st.just(PAPER),
    ownership=st.sampled_from(["nearest", "random"]),
    event_ownership=st.sampled_from(["nearest", "random"]),
    measurements=st.sampled_from([UniformMeasurements(), GeneratedMeasurements()]),
)


def places(seed=1, sensors=40):
    drawn_m = np.random.default_rng(seed).uniform(FIELD_M[:2], FIELD_M[2:], (sensors, 2))
    return {3 * number: tuple(place) for number, place in enumerate(drawn_m.tolist())}


def drawn(parameters=PAPER, seed=1, sensors=40):
    return build(parameters, places(seed, sensors), FIELD_M, Streams(seed))


def distance_m(one, other):
    return float(np.hypot(one[0] - other[0], one[1] - other[1]))


@fast
@given(seeds, OWNERSHIPS)
def test_owners_see_what_they_own_and_nearest_means_nearest(seed, parameters):
    problem = drawn(parameters, seed)
    instance = problem.instance
    assert list(instance.owners) == sorted(instance.owners)
    for owner, point_m in zip(instance.owners, instance.measurements_m, strict=True):
        reach = {node: distance_m(place, point_m) for node, place in problem.sensors_m.items()}
        assert reach[owner] <= parameters.sensing_radius_m
        assert parameters.ownership == "random" or reach[owner] == min(reach.values())
    for event in instance.events:
        reach = {node: distance_m(place, (event.x_m, event.y_m)) for node, place in problem.sensors_m.items()}
        is_nearest = reach[event.owner] == min(reach.values())
        assert is_nearest or parameters.event_ownership == "random"
        assert is_nearest or reach[event.owner] < parameters.sensing_radius_m + parameters.model.reach_m


def test_random_owners_are_any_of_those_that_may_be():
    owners = {drawn(replace(PAPER, event_ownership="random"), 1).instance.events[0].owner}
    places_m = places()
    for seed in range(40):
        parameters = replace(PAPER, event_ownership="random", events=ListedEvents(positions_m=((30.0, 60.0),)))
        owners.add(build(parameters, places_m, FIELD_M, Streams(seed)).instance.events[0].owner)
    reach_m = PAPER.sensing_radius_m + PAPER.model.reach_m
    may = {node for node, place in places_m.items() if distance_m(place, (30.0, 60.0)) < reach_m}
    assert 3 < len(owners & may) <= len(may)


@fast
@given(seeds, OWNERSHIPS)
def test_measurements_are_shared_out_among_the_sensors(seed, parameters):
    """Each is read by its owner, in the order of their numbers."""
    problem = drawn(parameters, seed)
    read = [problem.observe(node, 0) for node in sorted(problem.sensors_m)]
    np.testing.assert_array_equal(np.concatenate(read), problem.instance.measurements_m)
    for node in problem.sensors_m:
        first, mine = problem.knowledge(node).first_variable, problem.observe(node, 7)
        np.testing.assert_array_equal(problem.instance.measurements_m[first : first + len(mine)], mine)


@fast
@given(seeds, OWNERSHIPS, st.integers(0, 60))
def test_what_a_node_knows_does_not_depend_on_anybodys_measurements(seed, parameters, count):
    """But for the label under which its first measurement is told of in the trace."""
    problem = drawn(parameters, seed)
    others = drawn(replace(parameters, measurements=UniformMeasurements(count=count)), seed)
    for node in problem.sensors_m:
        known = replace(problem.knowledge(node), first_variable=0)
        assert known == replace(others.knowledge(node), first_variable=0)


@fast
@given(seeds, OWNERSHIPS)
def test_nobody_can_measure_what_is_not_in_its_knowledge(seed, parameters):
    """Events that a node's measurements may be of are among those it knows, it is one of their observers, and two who may
    measure the same event are neighbours in the overlay, and both know it.
    """
    problem = drawn(parameters, seed)
    knowledge = {node: problem.knowledge(node) for node in problem.sensors_m}
    for j, k in np.argwhere(problem.instance.weights > 0.0).tolist():
        assert problem.instance.events[k] in knowledge[problem.instance.owners[j]].events
    for event in problem.instance.events:
        observers = tuple(node for node, known in knowledge.items() if event in known.events)
        assert all(known.observers(event) == observers for known in knowledge.values())
        assert set(observers) <= set(knowledge[0].observers(event, 1.0))
    for node, known in knowledge.items():
        sharing = {other for event in known.events for other in known.observers(event)} - {node}
        assert known.overlay_neighbours == tuple(sorted(sharing))
        near = [
            other for other, place in problem.sensors_m.items() if distance_m(place, problem.sensors_m[node]) < 16.0
        ]
        assert known.sensing_neighbours == tuple(other for other in near if other != node)


def test_what_a_thousand_nodes_know_is_found_in_a_moment():
    """Tens of milliseconds of processor where distances are computed once, many seconds where for every node."""
    field_m, rng = (0.0, 0.0, 320.0, 320.0), np.random.default_rng(1)
    sensors_m = {number: tuple(place) for number, place in enumerate(rng.uniform(0.0, 320.0, (1000, 2)).tolist())}
    problem = build(replace(PAPER, events=DrawnEvents(count=100)), sensors_m, field_m, Streams(1))
    begin_s = time.process_time()
    knowledge = [problem.knowledge(node) for node in sensors_m]
    assert time.process_time() - begin_s < 1.0
    assert any(known.events for known in knowledge)


def test_nodes_without_sensor_know_nothing_and_measure_nothing():
    problem = drawn()
    assert problem.knowledge(1) is None
    with pytest.raises(ScenarioError, match="node 1 has no sensor to observe with"):
        problem.observe(1, 0)
    with pytest.raises(ScenarioError, match="no node has a sensor"):
        build(PAPER, {}, FIELD_M, Streams(1))


def test_uniform_measurements_have_their_number_and_the_paper_has_no_truth():
    problem = drawn(replace(PAPER, measurements=UniformMeasurements(count=41)))
    assert len(problem.instance.owners) == 41
    assert problem.truth_events() == []
    with pytest.raises(ScenarioError, match="the sensors cover almost nothing of the field"):
        drawn(replace(PAPER, sensing_radius_m=1e-9, measurements=UniformMeasurements(count=1)), sensors=1)


def test_generated_measurements_are_the_models():
    """3,000 events under one sensor that sees everything: within four standard errors of what was asked for."""
    parameters = replace(
        PAPER,
        events=DrawnEvents(count=3000),
        measurements=GeneratedMeasurements(noise_share=0.3),
        sensing_radius_m=1e4,
        covariance_m2=(4.0, 1.5, 2.0),
        false_alarm_density_per_m2=0.5,
        gate=1e-6,
    )
    places_m = {0: (30.0, 60.0)}
    problem = build(parameters, places_m, FIELD_M, Streams(5))
    (truth,) = problem.truth_events()
    assert isinstance(truth, TruthTargets)
    drift_m = np.array([truth.x_m, truth.y_m]).T - problem.instance.predicted_m
    right = 0.7 * parameters.model.covariance
    assert np.cov(drift_m.T) == pytest.approx(right, abs=4.0 * 1.5 * 4.0 / np.sqrt(3000))
    area_m2, detected = 100.0 * 60.0, 0.8 * 3000
    expected = detected + 0.5 * area_m2
    assert abs(len(problem.instance.owners) - expected) < 4.0 * np.sqrt(0.2 * detected + 0.5 * area_m2)
    without_noise = replace(parameters, measurements=GeneratedMeasurements(noise_share=0.0))
    still = build(without_noise, places_m, FIELD_M, Streams(5))
    seen = {tuple(point) for point in still.instance.measurements_m.tolist()}
    (truth,) = still.truth_events()
    hits = sum(point in seen for point in zip(truth.x_m, truth.y_m, strict=True))
    assert abs(hits - detected) < 4.0 * np.sqrt(0.2 * detected)


@fast
@given(seeds, OWNERSHIPS)
def test_the_instance_is_read_as_it_was_written(seed, parameters):
    instance = drawn(parameters, seed).instance
    again = EventAssociationInstance.from_json(instance.to_json())
    assert (again.owners, again.events, again.model) == (instance.owners, instance.events, instance.model)
    np.testing.assert_array_equal(again.weights, instance.weights)


def test_the_graph_in_the_trace_has_an_edge_for_every_gated_pair():
    problem = drawn()
    event, gated = problem.placement_event(), np.argwhere(problem.instance.weights > 0.0)
    count = len(problem.instance.owners)
    hosts = dict(zip(event.variable, event.host, strict=True))
    assert [hosts[number] for number in range(count)] == list(problem.instance.owners)
    assert [hosts[count + each.event] for each in problem.instance.events] == [
        each.owner for each in problem.instance.events
    ]
    edges = set(zip(event.edge_a, event.edge_b, strict=True))
    assert edges == {(j, count + k) for j, k in gated.tolist()}


def test_the_same_seed_draws_the_same_and_another_another():
    one, same, other = (drawn(seed=1), drawn(seed=1), build(PAPER, places(1), FIELD_M, Streams(2)))
    assert one.instance.to_json() == same.instance.to_json()
    assert not np.any(one.instance.predicted_m == other.instance.predicted_m)


@pytest.mark.parametrize("covariance", [(0.0, 0.0, 1.0), (1.0, 2.0, 1.0), (1.0, 0.0, -1.0)])
def test_what_is_no_covariance_is_refused(covariance):
    with pytest.raises(ValueError, match="covariance_m2 positive definite"):
        EventAssociationParameters(covariance_m2=covariance)
