"""Correlation decay on a bench: a drawn problem, a medium with rules, and what the sensors stated."""

import json
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from netsim.algorithms.correlation_decay import CorrelationDecay
from netsim.algorithms.correlation_decay_parameters import CorrelationDecayParameters, FloodParameters
from netsim.algorithms.decay_payload import narrowed
from netsim.kernels.correlation_decay import DecayGraph, vertex_order
from netsim.kernels.matchings import association_probabilities
from netsim.problems.event_association import (
    DrawnEvents,
    EventAssociationParameters,
    EventAssociationProblem,
    UniformMeasurements,
    build,
)
from netsim.rng import Streams
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.testing import DROP, ScriptedMedium, delay, duplicate, run_algorithm
from netsim.trace.events import AlgorithmRecord, PairProbabilities

LENGTH_M, WIDTH_M = 100.0, 20.0
SENSORS = 8
WHOLE = 7
"""Hops that reach everybody there is a way to."""
PROBLEM = EventAssociationParameters(
    events=DrawnEvents(count=6),
    measurements=UniformMeasurements(count=14),
    sensing_radius_m=10.0,
    covariance_m2=(40.0, 8.0, 25.0),
    false_alarm_density_per_m2=0.01,
)


def problem(seed, parameters=PROBLEM, away_m=0.0):
    """A problem of eight sensors in a long field, whose corner is `away_m` from the origin along both axes."""
    field_m = (away_m, away_m, away_m + LENGTH_M, away_m + WIDTH_M)
    places_m = np.random.default_rng(seed).uniform(field_m[:2], field_m[2:], (SENSORS, 2))
    sensors_m = {10 + number: tuple(place) for number, place in enumerate(places_m.tolist())}
    return build(parameters, sensors_m, field_m, Streams(seed))


def parameters(hops=WHOLE, graph="overlay", **chosen):
    flood = FloodParameters(hops=hops, graph=graph, round_s=chosen.pop("round_s", 30.0))
    return CorrelationDecayParameters(**{"flood": flood, "until_s": 600.0, **chosen})


@dataclass
class Stated:
    """What came of a run.

    Attributes:
        told: Probability, low and high, by measurement's number among all and event.
        depth: Levels used, by node.
        statistics: Sums over the nodes, and the most open requests.
        run: The run.
    """

    told: dict = field(default_factory=dict)
    depth: dict = field(default_factory=dict)
    statistics: dict = field(default_factory=dict)
    run: Any = None

    @property
    def probabilities(self):
        return {pair: p for pair, (p, _, _) in self.told.items()}


def stated(scene, chosen, rules=(), observe=None, **more):
    run = run_algorithm(
        more.pop("algorithm", CorrelationDecay),
        nodes=list(scene.sensors_m),
        knowledge=more.pop("knowledge", scene.knowledge),
        observe=observe or (lambda node: scene.observe(node, 0)),
        medium=ScriptedMedium(rules),
        parameters=chosen,
        duration_s=1000.0,
        **more,
    ).require_success()
    found = Stated(run=run)
    for _, event in run.of(PairProbabilities):
        found.depth[event.node] = event.depth
        for number, *numbers in zip(event.event, event.probability, event.low, event.high, strict=True):
            assert (event.variable, number) not in found.told
            found.told[event.variable, number] = tuple(numbers)
    for _, event in run.of(AlgorithmRecord):
        for name, number in json.loads(event.fields_json).items():
            found.statistics[name] = found.statistics.get(name, 0) + number
    return found


def by_kernel(scene, pair_function):
    """A kernel's probability of every pair, on the whole graph."""
    graph = DecayGraph(scene.instance.weights)
    return {(j, k): pair_function(graph, j, k) for j, k in np.argwhere(graph.weights > 0.0).tolist()}


def own_list(scene, graph, measurement, order):
    """The list of a measurement's owner: its own gated measurements and their events."""
    rows = [row for row, owner in enumerate(scene.instance.owners) if owner == scene.instance.owners[measurement]]
    mine = {row for row in rows if graph.neighbours(row)} | {vertex for row in rows for vertex in graph.neighbours(row)}
    return [vertex for vertex in vertex_order(graph, order) if vertex in mine]


def any_delay(seed, most_s, kinds=None):
    """Each message has a delay of its own; some arrive twice."""

    def decide(passage):
        if kinds is not None and passage.kind not in kinds:
            return None
        name = f"{passage.source}/{passage.destination}/{passage.kind}/{passage.count}"
        choice, share = Streams(seed).generator(name).random(2)
        return delay(most_s * share) if choice < 0.7 else duplicate(most_s * share)

    return decide


def any_loss(seed, share):
    """Each message is lost with the same chance."""

    def decide(passage):
        name = f"{passage.source}/{passage.destination}/{passage.kind}/{passage.count}"
        return DROP if Streams(seed).generator(name).random() < share else None

    return decide


def narrowed_truth(scene, width):
    """Exact probabilities where positions are rounded, and a sensor counts the events it knows to be in its reach."""
    instance = scene.instance
    weights = instance.model.weights(narrowed(instance.measurements_m, width), narrowed(instance.predicted_m, width))
    for row, owner in enumerate(instance.owners):
        seen = {event.event for event in scene.knowledge(owner).events}
        weights[row, [k for k in range(len(instance.events)) if k not in seen]] = 0.0
    return association_probabilities(weights)


def holds(scene, found):
    """Every stated interval has the exact probability of the whole problem in it."""
    exact = association_probabilities(scene.instance.weights)
    for pair, (_, low, high) in found.told.items():
        assert low - 1e-12 <= exact[pair] <= high + 1e-12


def relabelled(scene: EventAssociationProblem):
    """Knowledge whose labels for the trace are other ones."""
    return lambda node: replace(scene.knowledge(node), first_variable=1000 * node)


REAL = [
    "duration_s=70",
    "field={width_m: 60, height_m: 40}",
    "nodes.0.placement.count=10",
    "medium={type: ideal, delay_s: 0.001}",
    "mac={type: ideal}",
    "network={type: one-hop}",
    "fidelity=null",
    "problem.events.count=5",
    "problem.measurements.count=12",
    "algorithm.depth=8",
]


def shipped(scenarios, *overrides):
    """Metrics of the shipped scenario, made small, with all its layers."""
    result = run(load(scenarios / "oh2010" / "network.yaml", [*REAL, *overrides]))
    assert not result.failures
    return result.metrics
