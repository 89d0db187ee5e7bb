"""Nodes that crash and come back without memory, under real faults: variables keep exactly one host, and decisions agree."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import AlgorithmRecord, Association, Event, GraphMessages, Log

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
            (AlgorithmRecord, Association, GraphMessages, Log), lambda event, _: self.events.append(event)
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


@cache
def simulate(algorithm: str, *faults: str, seed: int = 1) -> Outcome:
    keep = Keep()
    result = run(load(PATH, [*PROBLEM, f"seed={seed}", algorithm, f"faults=[{', '.join(faults)}]"]), observers=[keep])
    assert not result.failures
    hosts: dict[int, set[int]] = {}
    for event in keep.of(GraphMessages):
        for vertex in list(event.source) if event.round == ROUNDS else []:
            hosts.setdefault(vertex, set()).add(event.node)
    decisions = {each.node: list(each.target) for each in keep.of(Association) if each.round == ROUNDS}
    moves = [(each.node, each.kind) for each in keep.of(AlgorithmRecord)]
    return Outcome(moves, hosts, decisions, [each.message for each in keep.of(Log)])


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
