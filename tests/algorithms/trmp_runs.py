"""Runs of distributed tree-reweighted max-product for tests, and what they record."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from netsim.metrics.collect import Metrics
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import AlgorithmRecord, Association, Event, Marginals, Problem

ASSOCIATION = Path("scenarios/chen2006/association-csmp.yaml")
GRAPH = Path("scenarios/graphs/grid-sum-product.yaml")
COMMON = ["duration_s=2000", "algorithm={type: trmp}", "problem.variance=total", "problem.targets.count=17"]
IDEAL = ["fidelity=ideal"]


class Keep:
    """Keeps the events of some kinds."""

    def __init__(self, *kinds: type[Event]) -> None:
        self.kinds = kinds
        self.events: list[Any] = []

    def handlers(self) -> Mapping[type[Event], Any]:
        return dict.fromkeys(self.kinds, lambda event, _: self.events.append(event))

    def of(self, kind: type[Event]) -> list[Any]:
        return [event for event in self.events if type(event) is kind]

    def notes(self, kind: str) -> list[dict[str, Any]]:
        return [json.loads(e.fields_json) for e in self.of(AlgorithmRecord) if e.kind == kind]


def simulate(path: Path, overrides: list[str]) -> tuple[Keep, dict[str, Any]]:
    keep, metrics = Keep(Problem, Association, AlgorithmRecord, Marginals), Metrics()
    result = run(load(path, overrides), observers=[keep, *metrics.observers])
    assert not result.failures, result.failures
    return keep, metrics.figures()
