"""How runs end: nothing is recorded or printed after the end, and who was down does not make up for what it missed."""

import gc
import sys

import pytest

from netsim.errors import AlgorithmError
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import EVENT_TYPES, EnergyLedger, MessageSent

SCENARIO = """
kind: scenario
schema_version: 1
name: ends
duration_s: DURATION
nodes: [{name: a, placement: {type: grid, rows: 2, columns: 2, spacing_m: 9}BUDGET}]
problem: {type: association, targets: {type: uniform, count: 2}}
algorithm: ALGORITHM
faults: FAULTS
"""


class Everything:
    """Every event of a run."""

    def __init__(self):
        self.events = []

    def handlers(self):
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))

    def of(self, kind):
        return [(time_ns, event) for time_ns, event in self.events if isinstance(event, kind)]


class Holding:
    """Holds a task, and clears up loudly."""

    def run(self, node):
        with node.task("work"):
            try:
                while True:
                    yield from node.pause(1_000_000_000)
            finally:
                node.log("cleared up")


class Spinning:
    """Lets no time pass."""

    def run(self, node):
        with node.task("work"):
            while True:
                yield from node.pause(0)


def ran(tmp_path, algorithm, duration_s=5, faults="[]", budget="", folder=None):
    text = SCENARIO.replace("ALGORITHM", algorithm).replace("DURATION", str(duration_s)).replace("FAULTS", faults)
    (tmp_path / "ends.yaml").write_text(text.replace("BUDGET", budget), encoding="utf-8")
    seen = Everything()
    result = run(load(tmp_path / "ends.yaml"), observers=[seen], folder=folder)
    return result, seen


def test_nothing_follows_the_ledger_and_nothing_is_complained_of(tmp_path, monkeypatch):
    complaints = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    (tmp_path / "run").mkdir()
    _, seen = ran(tmp_path, '{type: "test_ends:Holding"}', folder=tmp_path / "run")
    gc.collect()
    assert isinstance(seen.events[-1][1], EnergyLedger)
    assert complaints == []


def test_an_algorithm_that_lets_no_time_pass_is_told_of_once(tmp_path, monkeypatch):
    complaints = []
    monkeypatch.setattr(sys, "unraisablehook", complaints.append)
    (tmp_path / "run").mkdir()
    with pytest.raises(AlgorithmError, match="time stands still"):
        ran(tmp_path, '{type: "test_ends:Spinning"}', folder=tmp_path / "run")
    gc.collect()
    assert complaints == []


@pytest.mark.parametrize(
    ("algorithm", "planned"),
    [
        ("{type: neighbour-traffic, period_s: 1, rounds: 20, neighbours: 1, payload_byte: 9}", 20),
        ("{type: csmp, rounds: 17, round_s: 1, setup_s: 2}", None),
    ],
)
def test_a_node_that_was_down_goes_on_with_the_present_period(tmp_path, algorithm, planned):
    faults = "[{type: crash, nodes: [0], at_s: 12.2, reboot_after_s: 5}]"
    _, seen = ran(tmp_path, algorithm, duration_s=25, faults=faults)
    sent = [time_ns / 1e9 for time_ns, event in seen.of(MessageSent) if event.source == 0]
    assert not [time_s for time_s in sent if 12.2 <= time_s < 17.2]
    if planned is not None:
        assert len(sent) <= planned - 4
        assert len([time_s for time_s in sent if 17.2 <= time_s < 18.2]) <= 2


@pytest.mark.parametrize(
    "algorithm", ["{type: csmp, rounds: 3, round_s: 1, setup_s: 2}", "{type: sum-product, rounds: 3}"]
)
def test_message_passing_lives_with_an_allowance_that_refuses(tmp_path, algorithm):
    budget = ", budget: {allowance_j: 0.1, per: 10, policy: refuse}"
    result, _ = ran(tmp_path, algorithm, duration_s=60, budget=budget)
    assert result.failures == {}
    assert result.metrics["nodes_finished"] == 4
