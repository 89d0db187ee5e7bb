"""Deciding alone and centrally, against the figures that are computed from the instance, and where things get lost."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from netsim.algorithms.central_map import (
    CentralMap,
    CentralMapParameters,
    evidence_operations,
    most_probable,
    solving_operations,
)
from netsim.algorithms.central_reports import decode_decision, decode_report, encode_decision, encode_report, gather
from netsim.algorithms.independent import Independent, IndependentParameters
from netsim.errors import AlgorithmError
from netsim.kernels.assignment import best_assignment, brute_force, hypothesis_table, joint_score
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.problems.association import AssociationParameters, UniformTargets, build
from netsim.rng import Streams
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.testing import ScriptedMedium, run_algorithm
from netsim.testing.media import DROP, rule
from netsim.trace.events import Association, Log, Role

IDEAL = ["medium={type: ideal, delay_s: 0.001}", "mac={type: ideal}", "network={type: one-hop}"]


def problem(seed: int = 1, **chosen) -> AssociationInstance:
    sensors_m = np.array([(5.0 * x, 5.0 * y) for x in range(3) for y in range(3)])
    parameters = AssociationParameters(targets=UniformTargets(count=8), variance="total", **chosen)
    return build(parameters, sensors_m, range(10, 19), Streams(seed)).instance


def simulate(instance, parameters=CentralMapParameters(answer_s=60), medium=None, made=CentralMap):  # noqa: B008
    return run_algorithm(
        lambda: made(parameters),
        nodes=instance.sensor_nodes,
        knowledge=lambda node: instance.knowledge(instance.sensor_nodes.index(node)),
        observe=lambda node: instance.measurements_m[instance.sensor_nodes.index(node)],
        medium=medium,
    )


def decisions(result) -> dict[int, list[int]]:
    return {event.node: list(event.target) for _, event in result.of(Association)}


def alone(instance) -> dict[int, list[int]]:
    return {
        instance.sensor_nodes[vertex.id]: vertex.decide_alone().tolist()
        for vertex in instance_vertices(instance)
        if isinstance(vertex, SensorVertex)
    }


def exact(instance) -> dict[int, list[int]]:
    found = best_assignment(instance).assignment
    return {node: each.tolist() for node, each in zip(instance.sensor_nodes, found, strict=True)}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("algorithm", "metric"),
    [("central-map", "association_error_exact_map"), ("independent", "association_error_independent")],
)
def test_on_ideal_links_the_errors_are_those_computed_from_the_instance(scenarios: Path, algorithm, metric, seed):
    path = scenarios / "chen2006" / "association-csmp.yaml"
    result = run(load(path, [f"seed={seed}", f"algorithm={{type: {algorithm}}}", *IDEAL]))
    assert not result.failures
    figures = result.metrics
    assert figures["sensors_that_decided"] == 25
    assert figures["association_error"] == figures[metric]
    assert (figures["association_differs_from_exact_map"] == 0.0) == (algorithm == "central-map")
    assert (figures["radio_messages"] == 0) == (algorithm == "independent")


@pytest.mark.parametrize("seed", range(6))
def test_the_decisions_are_the_kernels(seed):
    instance = problem(seed)
    assert decisions(simulate(instance).require_success()) == exact(instance)
    parameters = IndependentParameters(until_s=3.0)
    silent = simulate(instance, parameters, made=Independent).require_success()
    assert decisions(silent) == alone(instance)
    assert not any(silent.delivered.values())
    assert silent.end_ns == 3 * 10**9


POLAR = ["range", "bearing", "range_bearing"]
WIDE = {"bearing_sd_rad": 0.4, "range_sd_m": 1.5}
"""Wide likelihoods, whose integrals are quick."""


@pytest.mark.parametrize(
    ("measures", "false_alarms"), [("range", "strict"), ("bearing", "geometric"), ("range_bearing", "strict")]
)
def test_ranges_and_bearings_are_associated_as_exactly(measures, false_alarms):
    instance = problem(3, measures=measures, false_alarms=false_alarms, prior_mean="drawn", **WIDE)
    assert decisions(simulate(instance).require_success()) == exact(instance)


def test_with_ranges_the_error_is_that_computed_from_the_instance(scenarios: Path):
    chosen = ["problem.measures=range", "algorithm={type: central-map}"]
    result = run(load(scenarios / "chen2006" / "association-bearing.yaml", chosen))
    assert not result.failures
    assert result.metrics["sensors_that_decided"] == 25
    assert result.metrics["association_differs_from_exact_map"] == 0.0


@pytest.mark.parametrize("graph", ["target", "sensor"])
def test_the_graphical_model_makes_no_difference(graph):
    instance = problem(4, false_alarms="geometric")
    other = problem(4, false_alarms="geometric", model=graph)
    alike = IndependentParameters()
    assert decisions(simulate(other, alike, made=Independent).require_success()) == alone(instance)
    assert decisions(simulate(other).require_success()) == exact(instance)


@pytest.mark.parametrize("priors", ["once", "every"])
def test_reports_survive_the_air(priors):
    instance = problem(3, prior_mean="drawn")
    sensors = range(9)
    sent = [encode_report(instance.knowledge(s), instance.measurements_m[s], priors, "float64") for s in sensors]
    reports = {instance.sensor_nodes[s]: decode_report(sent[s], "float64") for s in sensors}
    gathered = gather(reports, instance.model)
    assert gathered.instance.coverage == instance.coverage
    assert gathered.numbers == tuple(range(8))
    for name in ("means_m", "covariances_m2"):
        np.testing.assert_array_equal(getattr(gathered.instance, name), getattr(instance, name))
    for got, measured in zip(gathered.instance.measurements_m, instance.measurements_m, strict=True):
        np.testing.assert_array_equal(got, measured)
    assert decode_decision(encode_decision([3, -1, 700])).tolist() == [3, -1, 700]


@pytest.mark.parametrize("priors", ["once", "every"])
@pytest.mark.parametrize("measures", POLAR)
def test_reports_say_where_ranges_and_bearings_are_measured_from(priors, measures):
    """Once each, and only by sensors that cover a target: the place of another plays no part."""
    instance = problem(3, measures=measures, **WIDE)
    places = [place if instance.targets_of[s] else None for s, place in enumerate(instance.sensors_m)]
    assert None in places
    sent = [encode_report(instance.knowledge(s), instance.measurements_m[s], priors, "float64") for s in range(9)]
    numbers = instance.model.numbers
    reports = {instance.sensor_nodes[s]: decode_report(sent[s], "float64", numbers) for s in range(9)}
    assert [report.place_m for report in reports.values()] == places
    gathered = gather(reports, instance.model).instance
    for got, measured in zip(gathered.measurements_m, instance.measurements_m, strict=True):
        np.testing.assert_array_equal(got, measured)
    for target in range(8):
        np.testing.assert_array_equal(hypothesis_table(gathered, target), hypothesis_table(instance, target))


def test_describing_once_is_shorter():
    instance = problem(3)
    lengths = [
        sum(len(encode_report(instance.knowledge(s), instance.measurements_m[s], priors, "float32")) for s in range(9))
        for priors in ("once", "every")
    ]
    assert lengths[0] < lengths[1]


def test_the_centre_is_the_elected_or_the_given_node():
    instance = problem()
    partners = [len(instance.knowledge(sensor).partners) for sensor in range(9)]
    elected = simulate(instance)
    assert [event.node for _, event in elected.of(Role)] == [10 + partners.index(max(partners))]
    given = simulate(instance, CentralMapParameters(answer_s=60, centre=17)).require_success()
    assert [event.node for _, event in given.of(Role)] == [17]
    assert decisions(given) == decisions(elected) == exact(instance)


def test_a_centre_without_a_sensor_is_refused():
    done = run_algorithm(
        lambda: CentralMap(CentralMapParameters(answer_s=60, centre=1)), nodes=[1, 2], knowledge=lambda node: None
    )
    assert isinstance(done.failures[1], AlgorithmError)
    assert "no sensor" in str(done.failures[1])


def test_another_problem_is_refused():
    done = run_algorithm(lambda: Independent(IndependentParameters()), nodes=[1], knowledge=lambda node: 3.0)
    assert isinstance(done.failures[1], AlgorithmError)


@pytest.mark.parametrize(("priors", "measures"), [("once", "position"), ("every", "position"), ("every", "range")])
def test_without_a_report_the_centre_goes_on_and_its_sender_decides_alone(priors, measures):
    """What the others get is the exact answer for the sensors and targets that were reported."""
    instance = problem(2, false_alarms="geometric", measures=measures)
    lost = 18
    medium = ScriptedMedium(
        [rule(DROP, source=lost, kind="report"), rule(DROP, source=14, destination=lost, kind="decision")]
    )
    parameters = CentralMapParameters(answer_s=60, centre=14, priors=priors)
    done = decisions(simulate(instance, parameters, medium).require_success())
    reports = {
        node: decode_report(
            encode_report(instance.knowledge(s), instance.measurements_m[s], priors, "float64"),
            "float64",
            instance.model.numbers,
        )
        for s, node in enumerate(instance.sensor_nodes)
        if node != lost
    }
    gathered = gather(reports, instance.model)
    best = best_assignment(gathered.instance).assignment
    expected = {node: gathered.named(each) for node, each in zip(sorted(reports), best, strict=True)}
    assert done == expected | {lost: alone(instance)[lost]}


def test_strict_false_alarms_give_way_where_reports_are_missing():
    """A sensor with more measurements than targets and one false alarm explain has any number of false alarms."""
    instance = problem(1)
    knowledge = instance.knowledge(4)
    report = decode_report(encode_report(knowledge, instance.measurements_m[4], "every", "float64"), "float64")
    assert len(report.measurements_m) > 1
    gathered = gather({14: replace(report, targets={})}, instance.model)
    answer = most_probable(gathered.instance)
    assert answer is not None
    assert answer.assignment[0].tolist() == [-1] * len(report.measurements_m)
    never = replace(instance.model, false_alarm_probability=0.0)
    assert most_probable(gather({14: replace(report, targets={})}, never).instance) is None


@pytest.mark.parametrize("measures", ["position", "bearing"])
def test_what_arrives_is_what_is_computed_with(measures):
    """With narrow numbers the answer is that of the rounded instance."""
    instance = problem(5, prior_mean="drawn", measures=measures, **WIDE)
    done = simulate(instance, CentralMapParameters(answer_s=60, payload="float16")).require_success()
    sensors = range(9)
    reports = {
        instance.sensor_nodes[s]: decode_report(
            encode_report(instance.knowledge(s), instance.measurements_m[s], "once", "float16"),
            "float16",
            instance.model.numbers,
        )
        for s in sensors
    }
    assert decisions(done) == exact(gather(reports, instance.model).instance)


def test_computing_is_charged_at_the_centre():
    instance = problem(1)
    done = simulate(instance, CentralMapParameters(answer_s=60, centre=14)).require_success()
    variables = best_assignment(instance).variables
    assert done.energy_j[14] > max(joules for node, joules in done.energy_j.items() if node != 14)
    assert solving_operations(instance, variables) > 0


def test_integrals_take_longer_than_sums():
    """Twice as narrow a likelihood means four times the points of the grid."""
    summed = evidence_operations(problem(3), best_assignment(problem(3)).variables)
    wide, narrow = (evidence_operations(problem(3, measures="bearing", bearing_sd_rad=sd), 0) for sd in (0.08, 0.04))
    assert wide > 100 * summed
    assert narrow == pytest.approx(4 * wide, rel=0.05)


def test_the_estimate_grows_with_the_problem():
    instance = problem(1)
    assert solving_operations(instance, 2000) > 1.9 * solving_operations(instance, 1000)
    empty = gather({}, instance.model).instance
    assert solving_operations(empty, 0) == 0
    assert most_probable(empty) is not None


def test_small_problems_by_brute_force():
    sensors_m = np.array([(0.0, 0.0), (4.0, 0.0), (2.0, 3.0)])
    for seed in range(4):
        parameters = AssociationParameters(targets=UniformTargets(count=3), variance="total")
        instance = build(parameters, sensors_m, [1, 2, 3], Streams(seed)).instance
        done = decisions(simulate(instance).require_success())
        best = brute_force(instance)
        told = [np.array(done[node], dtype=np.int64) for node in (1, 2, 3)]
        assert joint_score(instance, told) == pytest.approx(joint_score(instance, best), rel=1e-10)


def test_the_log_tells_why_sensors_decide_alone():
    instance = problem(1)
    hopeless = replace(instance, model=replace(instance.model, false_alarm_probability=0.0, detection_probability=1.0))
    done = simulate(hopeless, CentralMapParameters(answer_s=60, centre=14))
    assert any("decides alone" in event.message for _, event in done.of(Log))
