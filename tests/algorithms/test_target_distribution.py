"""Target distribution by messages between nodes: what the central kernel finds, with an energy that pays for it."""

from pathlib import Path

import numpy as np
import pytest

from netsim.algorithms.message_passing_parameters import rule_of
from netsim.kernels.central import run_synchronous
from netsim.kernels.counting_model import instance_vertices
from netsim.kernels.semiring import Semiring
from netsim.kernels.target_distribution import DistributionInstance
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import Event, GraphMessages, Marginals, Problem

SEMIRING = {"max-product": Semiring.MAX, "csmp": Semiring.MAX, "sum-product": Semiring.SUM, "cssp": Semiring.SUM}
IDEAL = ["medium={type: ideal, delay_s: 0.001}", "mac={type: ideal}", "network={type: one-hop}"]
COVERAGES = {"discs": "problem.coverage={type: discs, radius_m: 14}", "cells": "problem.coverage={type: cells}"}


class Keep:
    """Keeps problem, marginals and messages."""

    def __init__(self) -> None:
        self.events: list[Event] = []

    def handlers(self):
        return dict.fromkeys((Problem, Marginals, GraphMessages), lambda event, _: self.events.append(event))

    def of(self, kind):
        return [event for event in self.events if type(event) is kind]


def simulate(scenarios: Path, *overrides: str):
    keep = Keep()
    loaded = load(scenarios / "chen2006" / "target-distribution.yaml", ["nodes.0.placement.count=20", *overrides])
    result = run(loaded, observers=[keep])
    assert not result.failures
    return loaded.scenario.algorithm, keep, result


@pytest.mark.parametrize("coverage", COVERAGES)
@pytest.mark.parametrize("algorithm", SEMIRING)
def test_ideal_rounds_find_what_the_central_kernel_finds(scenarios: Path, algorithm: str, coverage: str) -> None:
    chosen = f"algorithm={{type: {algorithm}, rounds: 5}}"
    parameters, keep, result = simulate(scenarios, chosen, COVERAGES[coverage], "fidelity=null", *IDEAL)
    instance = DistributionInstance.from_json(keep.of(Problem)[0].content_json)
    right = run_synchronous(
        instance_vertices(instance), SEMIRING[algorithm], 5, rule_of(parameters), stop_when_converged=False
    )
    last = {event.variable: event.probability for event in keep.of(Marginals) if event.round == 5}
    assert last.keys() == right.beliefs.keys()
    for vertex, belief in right.beliefs.items():
        np.testing.assert_array_equal(last[vertex], np.exp(belief))
    assert sum(len(event.source) for event in keep.of(GraphMessages)) == right.messages_sent
    assert result.metrics["count_error"] is not None


def test_lost_messages_leave_an_answer(scenarios: Path) -> None:
    _, _, result = simulate(scenarios, "fidelity=csma", "algorithm.rounds=3")
    assert 0.0 < result.metrics["count_error"] < 1.0
    assert result.metrics["energy_j"] > 0.0


def test_a_dead_sensor_tells_nothing_and_the_others_go_on(scenarios: Path) -> None:
    fault = "faults=[{type: sensor-dead, nodes: [0]}]"
    _, keep, result = simulate(scenarios, fault, "algorithm.rounds=3")
    assert result.metrics["count_error"] is not None
    assert {event.node for event in keep.of(Marginals)} == set(range(20))
