"""Runs side by side: each against the first, metric by metric, with what differs between their scenarios and versions."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from netsim.metrics.catalogue import CATALOGUE, DEFAULT_METRICS
from netsim.study.contender import Contender, contender
from netsim.study.gate import Gate, Judgement, difference, is_number, relative
from netsim.study.settings import Setting, differing
from netsim.trace.divergence import Divergence, first_divergence

HEADLINE = (*DEFAULT_METRICS, "rounds", "deaths", "simulated_s")
"""What is told of a comparison unless all of it is asked for."""
_NAMES = ("scenario", "seed")
"""Figures that are none: the settings tell them."""


@dataclass(frozen=True, slots=True)
class Held:
    """A figure of a run held against the first run's.

    Attributes:
        value: The figure; None where the run has none.
        difference: It less the first run's; None where one of them is no number.
        relative: That over the magnitude of the first run's.
    """

    value: Any
    difference: float | None
    relative: float | None


@dataclass(frozen=True, slots=True)
class Row:
    """A metric of all runs.

    Attributes:
        metric: Its name.
        unit: Its unit; empty if it is not known.
        first: The first run's figure; None where it has none.
        others: The other runs' figures.
    """

    metric: str
    unit: str
    first: Any
    others: tuple[Held, ...]

    @property
    def is_equal(self) -> bool:
        """Whether all runs have the same figure."""
        return all(type(held.value) is type(self.first) and held.value == self.first for held in self.others)


@dataclass(frozen=True)
class Comparison:
    """Runs side by side.

    Attributes:
        runs: The runs; the first is the one that the others are held against.
        settings: In what their scenarios differ; None if the scenario of one is not at hand.
        versions: In what versions they differ, of what is known of all.
        rows: Every scalar metric that one of them has, headline ones first.
        lists: Names of list-valued metrics that differ.
        partings: For each other run, where its trace parts from the first one's; None if they are the same.
        traced: For each other run, whether it and the first have traces.
    """

    runs: tuple[Contender, ...]
    settings: list[Setting] | None
    versions: list[Setting]
    rows: list[Row]
    lists: list[str]
    partings: tuple[Divergence | None, ...]
    traced: tuple[bool, ...]

    def judge(self, gates: Sequence[Gate]) -> list[tuple[Contender, Judgement]]:
        """What gates say of every run but the first.

        Raises:
            ScenarioError: See `Gate.judge`.
        """
        first = self.runs[0].figures
        return [(run, gate.judge(run.figures, first)) for run in self.runs[1:] for gate in gates]


def compare(paths: Sequence[Path]) -> Comparison:
    """Put runs side by side.

    Raises:
        ScenarioError: If one of them is no finished run.
        TraceError: If a trace is damaged.
    """
    runs = tuple(map(contender, paths))
    scenarios = [run.scenario for run in runs]
    traces = [(runs[0].trace, run.trace) for run in runs[1:]]
    return Comparison(
        runs,
        None if any(scenario is None for scenario in scenarios) else differing(scenarios),
        _versions(runs),
        rows_of([run.figures for run in runs]),
        _lists(runs),
        tuple(None if a is None or b is None else first_divergence(a, b) for a, b in traces),
        tuple(a is not None and b is not None for a, b in traces),
    )


def rows_of(figures: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Every scalar metric of some runs, headline ones first, then in the order of the catalogue."""
    present = [name for each in figures for name in each if name not in _NAMES]
    return [_row(name, figures) for name in in_order(present)]


def in_order(names: Iterable[str]) -> list[str]:
    """Names of metrics, each once: headline ones first, then in the order of the catalogue."""
    order = {name: place for place, name in enumerate(dict.fromkeys((*HEADLINE, *CATALOGUE)))}
    return sorted(dict.fromkeys(names), key=lambda name: order.get(name, order.get(_stem(name), len(order))))


def unit_of(name: str) -> str:
    """The unit of a metric or of an entry of one; empty if it is not known."""
    metric = CATALOGUE.get(name) or CATALOGUE.get(_stem(name))
    return "" if metric is None else metric.unit


def _row(name: str, figures: Sequence[Mapping[str, Any]]) -> Row:
    first, *others = (each.get(name) for each in figures)
    return Row(name, unit_of(name), first, tuple(_held(value, first) for value in others))


def _held(value: Any, first: Any) -> Held:
    if not (is_number(value) and is_number(first)):
        return Held(value, None, None)
    return Held(value, difference(value, first), relative(value, first))


def _stem(name: str) -> str:
    return name.partition(".")[0]


def _versions(runs: Sequence[Contender]) -> list[Setting]:
    names = [name for name in runs[0].versions if all(name in run.versions for run in runs)]
    return differing([{name: run.versions[name] for name in names} for run in runs])


def _lists(runs: Sequence[Contender]) -> list[str]:
    names = dict.fromkeys(name for run in runs for name in run.lists)
    return [name for name in names if any(run.lists.get(name) != runs[0].lists.get(name) for run in runs)]
