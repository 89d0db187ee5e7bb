"""Nodes that crash and come back without memory, under real faults: variables keep exactly one host, and decisions agree."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import AlgorithmRecord, Association, Event, GraphMessages, Log, Role

PATH = Path("scenarios/chen2006/association-csmp.yaml")
ROUNDS = 20
FIRST = 9  # vertices below are the sensors'
LINKS = ["medium={type: ideal}", "network={type: one-hop}"]  # and a MAC that acknowledges
COMMON = [*LINKS, "duration_s=60", "nodes.0.placement={type: grid, rows: 3, columns: 3, spacing_m: 4}"]
PROBLEM = [*COMMON, "problem.targets.count=7", "problem.variance=total"]
RULE = f"rounds: {ROUNDS}, round_s: 2, spread_s: 1.5, setup_s: 6, rehost: true, suspect_after: 2"
MAX_PRODUCT = f"algorithm={{type: max-product, {RULE}}}"
CSMP = f"algorithm={{type: csmp, tolerance: 0.01, silence: notice, {RULE}}}"


class Keep:
    """Keeps the events of interest."""

    def __init__(self) -> None:
        self.events: list[Any] = []

    def handlers(self) -> Mapping[type[Event], Any]:
        return dict.fromkeys(
            (AlgorithmRecord, Association, GraphMessages, Log, Role), lambda event, _: self.events.append(event)
        )

    def of(self, kind: type[Event]) -> list[Any]:
        return [event for event in self.events if type(event) is kind]


@dataclass(frozen=True)
class Outcome:
    """What became of a run: notes as (node, kind), each vertex's hosts in the last round, the last decisions, the log."""

    moves: list[tuple[int, str]]
    hosts: dict[int, set[int]]
    decisions: dict[int, list[int]]
    logs: list[str]
    centres: list[tuple[int, str]]


@cache
def simulate(algorithm: str, *faults: str, seed: int = 1) -> Outcome:
    keep = Keep()
    result = run(load(PATH, [*PROBLEM, f"seed={seed}", algorithm, f"faults=[{', '.join(faults)}]"]), observers=[keep])
    assert not result.failures
    hosts: dict[int, set[int]] = {}
    for event in keep.of(GraphMessages):
        for vertex in list(event.source) if event.round == ROUNDS else []:
            hosts.setdefault(vertex, set()).add(event.node)
    decisions = {each.node: list(each.target) for each in keep.of(Association) if each.round in (0, ROUNDS)}
    moves = [(each.node, each.kind) for each in keep.of(AlgorithmRecord)]
    centres = [(each.node, each.role) for each in keep.of(Role)]
    return Outcome(moves, hosts, decisions, [each.message for each in keep.of(Log)], centres)


def crash(node: int, at_s: float, reboot_after_s: float | None = None) -> str:
    back = "" if reboot_after_s is None else f", reboot_after_s: {reboot_after_s}"
    return f"{{type: crash, nodes: [{node}], at_s: {at_s}{back}}}"


def shared_variables(outcome: Outcome) -> dict[int, set[int]]:
    return {vertex: hosts for vertex, hosts in outcome.hosts.items() if vertex >= FIRST}


def dead_host(algorithm: str, seed: int) -> tuple[str, int]:
    """The crash of a target's host, and who takes the target over."""
    calm = simulate(algorithm, seed=seed)
    host = min(min(hosts) for hosts in shared_variables(calm).values())
    death = crash(host, 12.1)
    successor = next(node for node, kind in simulate(algorithm, death, seed=seed).moves if kind == "rehosted")
    return death, successor


@pytest.mark.parametrize("seed", [2, 4])
def test_a_successor_that_reboots_hosts_what_it_took_over(seed: int) -> None:
    """It has forgotten the takeover, hears of it, asks for measurements and messages, and all decide as without a reboot."""
    death, successor = dead_host(MAX_PRODUCT, seed)
    once = simulate(MAX_PRODUCT, death, seed=seed)
    again = simulate(MAX_PRODUCT, death, crash(successor, 26.3, 1.0), seed=seed)
    assert shared_variables(again) == shared_variables(once)
    assert again.decisions == once.decisions


@pytest.mark.parametrize("algorithm", [MAX_PRODUCT, CSMP])
def test_a_node_that_was_down_shortly_makes_its_vertices_of_all_measurements(algorithm: str) -> None:
    """They were exchanged before: it asks for them, so that its messages are as long as those of before, and fit."""
    host = min(min(hosts) for hosts in shared_variables(simulate(MAX_PRODUCT)).values())
    for node in (1, host):
        again = simulate(algorithm, crash(node, 14.3, 1.0))
        assert not [line for line in again.logs if "does not fit" in line]
        assert again.decisions == simulate(algorithm).decisions
        assert all(len(hosts) == 1 for hosts in again.hosts.values())


@pytest.mark.parametrize("at_s", [0.5, 5.0])
def test_a_sensor_that_was_down_during_the_election_makes_no_second_centre(at_s: float) -> None:
    """Down at 5 s it has reported, forgets it, and hears the decision about what it reported."""
    central = "algorithm={type: central-map, answer_s: 30}"
    calm = simulate(central, seed=3)
    (centre,) = (node for node, _ in calm.centres)
    other = max(node for node, decision in calm.decisions.items() if len(decision) > 2 and node != centre)
    again = simulate(central, crash(other, at_s, 2.5), seed=3)
    assert again.centres == calm.centres
    assert at_s < 2.0 or again.decisions == calm.decisions
