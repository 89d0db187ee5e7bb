"""What a tracker's settings need of the tracking problem, as findings before anything runs."""

from collections.abc import Iterator
from typing import Any

from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.algorithms.idsq_payload import MOST_CELLS
from netsim.errors import Finding
from netsim.kernels.grid_belief import grid_over
from netsim.problems.tracking_parameters import TrackingParameters
from netsim.reading import Document
from netsim.reading import Path as ValuePath
from netsim.scenario.schema import Scenario


def tracking_findings(scenario: Scenario, document: Document) -> Iterator[Finding]:
    """Watchdogs that somebody heeds, beliefs that fit into a hand-off."""
    problem = scenario.problem
    if not isinstance(problem, TrackingParameters):
        return
    trackers = [record for _, record in algorithms(scenario) if isinstance(record, IdsqParameters)]
    if trackers:
        yield from _watchdogs(problem, trackers, document)
        yield from _cells(scenario, problem, document)


def algorithms(scenario: Scenario) -> Iterator[tuple[ValuePath, Any]]:
    """The parameters of every algorithm that some group of nodes runs, and where they stand."""
    if any(group.algorithm is None for group in scenario.nodes):
        yield ("algorithm",), scenario.algorithm
    for index, group in enumerate(scenario.nodes):
        if group.algorithm is not None:
            yield ("nodes", index, "algorithm"), group.algorithm


def _watchdogs(problem: TrackingParameters, trackers: list[IdsqParameters], document: Document) -> Iterator[Finding]:
    if problem.watchdogs != "none" and not all(record.robust for record in trackers):
        yield document.finding(
            ("problem", "watchdogs"),
            "none, or a tracker whose leaders claim their tracks, so that watchdogs know when to be quiet",
            f"{problem.watchdogs} with robust: false",
            "set `algorithm.robust: true`",
        )


def _cells(scenario: Scenario, problem: TrackingParameters, document: Document) -> Iterator[Finding]:
    (low_x, low_y), field = scenario.field.origin_m, scenario.field
    grid = grid_over((low_x, low_y, low_x + field.width_m, low_y + field.height_m), problem.cell_m)
    if grid.size > MOST_CELLS:
        yield document.finding(
            ("problem", "cell_m"),
            f"cells so large that at most {MOST_CELLS:,} cover the field, for a hand-off tells no more",
            f"{problem.cell_m:g} m, {grid.columns:,} by {grid.rows:,} cells",
            "take larger cells",
        )
