"""What the table of nodes says of their energy adds up to the run's metrics."""

import math

import pytest

from netsim.study.plan import load_plan, write_plan
from netsim.study.trial import run_trial


def test_the_nodes_energy_adds_up_to_the_metrics(tmp_path, scenarios):
    plan = load_plan(scenarios / "studies" / "quick.yaml", ["repetitions=1"])
    write_plan(plan, tmp_path, "netsim study quick.yaml")
    outcome = run_trial(plan.tasks(tmp_path)[0])
    for name in ("energy_j", "energy_beyond_listening_j"):
        assert math.fsum(outcome.nodes[name]) == pytest.approx(outcome.figures[name], rel=1e-12)
    assert max(outcome.nodes["energy_beyond_listening_j"]) < min(outcome.nodes["energy_j"])
