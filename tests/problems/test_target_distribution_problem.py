"""Drawing target-distribution problems: what the truth is, who knows what, and what must not tell."""

from dataclasses import replace

import numpy as np
import pytest

from netsim.errors import ScenarioError
from netsim.problems.coverage import CellCoverage, DiscCoverage
from netsim.problems.target_distribution import DistributionParameters, build
from netsim.rng import Streams
from netsim.trace.events import TruthCounts, TruthTargets

FIELD = (0.0, 0.0, 100.0, 100.0)
DISCS = DistributionParameters(coverage=DiscCoverage(radius_m=15.0))
CELLS = DistributionParameters(coverage=CellCoverage())


def drawn(parameters=CELLS, sensors=30, seed=1, nodes=None):
    positions_m = np.random.default_rng(7).uniform(0.0, 100.0, (sensors, 2))
    return build(parameters, positions_m, nodes or list(range(sensors)), FIELD, Streams(seed))


@pytest.mark.parametrize("parameters", [DISCS, CELLS, replace(CELLS, coverage=CellCoverage(merge_cells=True))])
class TestEveryCoverage:
    def test_counts_are_of_the_targets_inside(self, parameters):
        """All covered targets are counted once, and each window holds its count."""
        problem = drawn(parameters)
        targets, counts = problem.truth_events()
        assert isinstance(targets, TruthTargets)
        assert isinstance(counts, TruthCounts)
        assert 0 < sum(counts.count) <= len(targets.target)
        for subregion, count in zip(problem.instance.subregions, counts.count, strict=True):
            assert count in subregion.counts

    def test_mean_count_is_density_times_area(self, parameters):
        """Over 50 problems, within four standard errors of a Poisson number."""
        made = [drawn(parameters, seed=seed) for seed in range(50)]
        area_m2 = sum(subregion.area_m2 for subregion in made[0].instance.subregions)
        expected = 50 * parameters.target_density_per_m2 * area_m2
        assert abs(sum(sum(problem.counts) for problem in made) - expected) < 4.0 * np.sqrt(expected)

    def test_mean_reading_is_what_the_model_says(self, parameters):
        """Over 50 problems: detected targets and false detections of everything a sensor covers."""
        made = [drawn(parameters, seed=seed) for seed in range(50)]
        density = 0.8 * parameters.target_density_per_m2 + parameters.false_alarm_density_per_m2
        covered_m2 = [sum(s.area_m2 for s in mine) for mine in made[0].instance.subregions_of]
        readings = np.array([problem.instance.readings for problem in made])
        deviation = np.sqrt((density * np.array(covered_m2) + 1.0) / 50)
        assert (np.abs(readings.mean(axis=0) - density * np.array(covered_m2)) < 5.0 * deviation).all()

    def test_hosts_cover_what_they_host(self, parameters):
        problem = drawn(parameters, nodes=[3 * n + 1 for n in range(30)])
        nodes = problem.instance.sensor_nodes
        for subregion in problem.instance.subregions:
            assert subregion.host in [nodes[sensor] for sensor in subregion.sensors]
        hosted = [s.vertex for node in nodes for s in problem.knowledge(node).hosted]
        assert sorted(hosted) == [s.vertex for s in problem.instance.subregions]

    def test_a_node_knows_where_to_send(self, parameters):
        problem = drawn(parameters)
        for node in problem.instance.sensor_nodes:
            knowledge = problem.knowledge(node)
            met = {s.vertex for s in knowledge.subregions} | {n for s in knowledge.hosted for n in s.sensors}
            assert met <= knowledge.hosts.keys()


def test_window_is_centred_or_drawn():
    centred, shifted = drawn(), drawn(replace(CELLS, window_placement="drawn"))
    assert shifted.counts == centred.counts
    assert shifted.instance.readings.tolist() == centred.instance.readings.tolist()
    for subregion, count in zip(centred.instance.subregions, centred.counts, strict=True):
        assert subregion.counts == tuple(range(max(0, count - 2), count + 3))
    tops = [s.counts[-1] - count for s, count in zip(shifted.instance.subregions, shifted.counts, strict=True)]
    assert set(tops) == {0, 1, 2, 3, 4}


def test_more_sensors_leave_the_targets_where_they_are():
    few, many = drawn(sensors=20), drawn(sensors=40)
    assert few.targets_m.tolist() == many.targets_m.tolist()


def test_node_without_sensor_has_no_part():
    problem = drawn()
    assert problem.knowledge(99) is None
    with pytest.raises(ScenarioError, match="node 99 has no sensor"):
        problem.observe(99, 0)


def test_nothing_covered_is_refused():
    with pytest.raises(ScenarioError, match="no sensor covers any of the field"):
        build(DISCS, np.array([[500.0, 500.0]]), [0], FIELD, Streams(1))
