"""Drawing data-association problems."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from netsim.errors import ScenarioError
from netsim.kernels.association_model import AssociationInstance
from netsim.problems.association import AssociationParameters, ListedTargets, UniformTargets, build
from netsim.rng import Streams
from netsim.trace.events import TruthOrigins, TruthTargets

GRID_M = np.array([[5.0 * x, 5.0 * y] for x in range(5) for y in range(5)])
NODES = list(range(100, 125))


def drawn(seed=1, **chosen):
    return build(AssociationParameters(**chosen), GRID_M, NODES, Streams(seed))


def test_targets_lie_within_range_of_a_sensor():
    problem = drawn(targets=UniformTargets(count=200))
    distance_m = np.linalg.norm(problem.targets_m[:, None] - GRID_M[None], axis=2)
    assert distance_m.min(axis=1).max() <= 5.0
    for target, covering in enumerate(problem.instance.coverage):
        assert list(covering) == np.flatnonzero(distance_m[target] <= 5.0).tolist()


def test_density_of_the_papers_setting():
    """33 targets on the 5 by 5 grid: three a sensor, about four directed graph messages a round and sensor."""
    covered, edges = [], []
    for seed in range(40):
        problem = drawn(seed)
        covered.append(np.mean([len(targets) for targets in problem.instance.targets_of]))
        edges.append(2 * len(problem.placement_event().edge_a) / 25)
    assert np.mean(covered) == pytest.approx(3.0, abs=0.15)
    assert np.mean(edges) == pytest.approx(4.1, abs=0.2)


def test_detections_and_false_alarms_have_their_rates():
    origins = [drawn(seed).origins for seed in range(40)]
    sensors = [origin for each in origins for origin in each]
    false_alarms = [int(np.sum(origin < 0)) for origin in sensors]
    detected = sum(int(np.sum(origin >= 0)) for origin in sensors)
    covered = sum(len(targets) for seed in range(40) for targets in drawn(seed).instance.targets_of)
    assert max(false_alarms) == 1
    assert np.mean(false_alarms) == pytest.approx(0.15, abs=4 * np.sqrt(0.15 * 0.85 / len(sensors)))
    assert detected / covered == pytest.approx(0.8, abs=4 * np.sqrt(0.16 / covered))


@pytest.mark.parametrize(("variance", "noise_m2", "prior_m2"), [("per_coordinate", 5.0, 5.0), ("total", 2.5, 2.5)])
def test_variances_mean_what_they_say(variance, noise_m2, prior_m2):
    errors, deviations = [], []
    for seed in range(40):
        problem = drawn(seed, variance=variance, prior_mean="drawn")
        deviations.append(problem.instance.means_m - problem.targets_m)
        for points, origin in zip(problem.instance.measurements_m, problem.origins, strict=True):
            errors.append(points[origin >= 0] - problem.targets_m[origin[origin >= 0]])
        assert problem.instance.model.noise_m2 == ((noise_m2, 0.0), (0.0, noise_m2))
        assert problem.instance.covariances_m2[0].tolist() == [[prior_m2, 0.0], [0.0, prior_m2]]
    for sample, expected in ((np.vstack(errors), noise_m2), (np.vstack(deviations), prior_m2)):
        assert sample.var() == pytest.approx(expected, rel=4 * np.sqrt(2.0 / sample.size))
        assert abs(sample.mean()) < 4 * np.sqrt(expected / sample.size)


def test_order_of_measurements_tells_nothing():
    """Among the pairs of detections of a sensor the lower target comes first half the time."""
    first = []
    for seed in range(40):
        for origin in drawn(seed).origins:
            named = origin[origin >= 0]
            first += [named[i] < named[j] for i in range(len(named)) for j in range(i + 1, len(named))]
    assert np.mean(first) == pytest.approx(0.5, abs=0.06)


def test_priors_at_the_truth():
    problem = drawn(prior_mean="truth")
    np.testing.assert_array_equal(problem.instance.means_m, problem.targets_m)


def test_streams_are_apart():
    """The detection probability moves no noise, a sensor more moves no other sensor, the model of alarms nothing."""
    sharp, base, loose = (drawn(detection_probability=p) for p in (1.0, 0.8, 0.3))
    for a, b in zip(base.instance.measurements_m, sharp.instance.measurements_m, strict=True):
        assert set(map(tuple, a)) <= set(map(tuple, b))
    for a, b in zip(loose.instance.measurements_m, base.instance.measurements_m, strict=True):
        assert set(map(tuple, a)) <= set(map(tuple, b))
    assert drawn(false_alarms="geometric").observe(105, 0).tobytes() == base.observe(105, 0).tobytes()
    places = ListedTargets(positions_m=((1.0, 1.0), (7.0, 3.0)))
    few = build(AssociationParameters(targets=places), GRID_M[:3], NODES[:3], Streams(1))
    more = build(AssociationParameters(targets=places), GRID_M[:9], NODES[:9], Streams(1))
    assert few.observe(101, 0).tobytes() == more.observe(101, 0).tobytes()


def test_seeds_decide():
    assert drawn(3).instance_json() == drawn(3).instance_json()
    assert drawn(3).instance_json() != drawn(4).instance_json()


def test_order_of_nodes_does_not_matter():
    turned = build(AssociationParameters(), GRID_M[::-1], NODES[::-1], Streams(1))
    assert turned.instance_json() == drawn(1).instance_json()


def test_coverage_by_none_one_two_and_three():
    places = ListedTargets(positions_m=((50.0, 50.0), (-3.0, 0.0), (4.0, -2.0), (4.0, 2.9)))
    sensors_m = np.array([[0.0, 0.0], [8.0, 0.0], [4.0, 6.0], [100.0, 100.0]])
    problem = build(AssociationParameters(targets=places), sensors_m, [7, 2, 9, 4], Streams(5))
    assert problem.instance.sensor_nodes == (2, 4, 7, 9)
    assert problem.instance.coverage == ((), (2,), (0, 2), (0, 2, 3))
    placement = problem.placement_event()
    assert list(placement.variable) == [0, 1, 2, 3, 7]
    assert list(placement.name) == ["sensor 2", "sensor 4", "sensor 7", "sensor 9", "target 3"]
    assert list(placement.host) == [2, 4, 7, 9, 9]
    assert list(zip(placement.edge_a, placement.edge_b, strict=True)) == [(0, 2), (0, 7), (2, 7), (3, 7)]
    assert problem.knowledge(9).hosted[0].target == 3
    assert problem.knowledge(2).partners == (2, 3)
    assert problem.knowledge(2).hosts == {0: 2, 2: 7, 3: 9, 7: 9}
    assert problem.knowledge(2).covered == {0: 2, 2: 3, 3: 1}
    assert problem.knowledge(4).targets == ()


def test_equally_near_hosts_go_to_the_lower_node():
    places = ListedTargets(positions_m=((2.0, 2.0),))
    sensors_m = np.array([[0.0, 2.0], [4.0, 2.0], [2.0, 0.0]])
    assert build(AssociationParameters(targets=places), sensors_m, [8, 6, 7], Streams(5)).instance.hosts == (6,)


def test_nodes_without_a_sensor():
    problem = drawn()
    assert problem.knowledge(3) is None
    with pytest.raises(ScenarioError, match="no sensor"):
        problem.observe(3, 0)


def test_no_sensor_no_targets():
    empty = build(AssociationParameters(targets=UniformTargets(count=0)), np.zeros((0, 2)), [], Streams(1))
    assert AssociationInstance.from_json(empty.instance_json()).to_json() == empty.instance_json()
    with pytest.raises(ScenarioError, match="no node has a sensor"):
        build(AssociationParameters(), np.zeros((0, 2)), [], Streams(1))


def test_truth_is_in_the_events_and_not_in_the_knowledge():
    problem = drawn(prior_mean="drawn")
    events = problem.truth_events()
    assert isinstance(events[0], TruthTargets)
    origins = [event for event in events if isinstance(event, TruthOrigins)]
    assert [event.node for event in origins] == NODES
    for event, origin in zip(origins, problem.origins, strict=True):
        assert event.target == origin.tolist()
        np.testing.assert_array_equal(np.column_stack([event.x_m, event.y_m]), problem.observe(event.node, 0))
    told = repr([problem.knowledge(node) for node in NODES]) + problem.instance_json()
    for x_m, y_m in problem.targets_m.tolist():
        assert repr(x_m) not in told
        assert repr(y_m) not in told


def test_observations_are_copies():
    problem = drawn()
    before = problem.observe(106, 0).copy()
    problem.observe(106, 0)[:] = 0.0
    np.testing.assert_array_equal(problem.observe(106, 0), before)


def test_parameters_are_checked_by_the_schema():
    schema = TypeAdapter(AssociationParameters)
    made = schema.validate_python({"targets": {"type": "listed", "positions_m": [[1.0, 2.0]]}, "variance": "total"})
    assert made == replace(AssociationParameters(variance="total"), targets=ListedTargets(positions_m=((1.0, 2.0),)))
    for wrong in ({"detection_probability": 1.5}, {"false_alarms": "many"}, {"targets": {"type": "uniform", "n": 3}}):
        with pytest.raises(ValidationError):
            schema.validate_python(wrong)
