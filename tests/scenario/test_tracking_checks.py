"""Tracking problems and trackers that do not go together are refused when the scenario is loaded."""

from pathlib import Path

import pytest

from netsim.errors import ScenarioError
from netsim.scenario.load import load

TRACKING = Path("scenarios/liu2002/tracking.yaml")
CENTRAL = Path("scenarios/liu2002/central.yaml")


@pytest.mark.parametrize(
    ("overrides", "path", "got"),
    [
        (["problem.watchdogs=border"], "problem.watchdogs", "border with robust: false"),
        (["problem.watchdogs=all"], "problem.watchdogs", "all with robust: false"),
        (["problem.cell_m=0.5"], "problem.cell_m", "0.5 m, 300 by 500 cells"),
    ],
)
def test_what_cannot_work_is_refused(overrides, path, got):
    with pytest.raises(ScenarioError) as refused:
        load(TRACKING, overrides)
    (finding,) = refused.value.findings
    assert (finding.path, finding.got) == (path, got)
    assert finding.remedy


@pytest.mark.parametrize(
    ("path", "overrides"),
    [
        (TRACKING, ["problem.watchdogs=border", "algorithm.robust=true"]),
        (TRACKING, ["problem.cell_m=1"]),
        (CENTRAL, ["problem.watchdogs=border"]),  # nobody watches there, and nobody waits for it
        (CENTRAL, ["problem.cell_m=0.5"]),
    ],
)
def test_what_can_work_is_not(path, overrides):
    load(path, overrides)


def test_the_algorithm_of_a_group_is_looked_at_too():
    own = ["nodes[0].algorithm={type: idsq}", "algorithm={type: idsq, robust: true}", "problem.watchdogs=border"]
    with pytest.raises(ScenarioError, match="border with robust: false"):
        load(TRACKING, own)
