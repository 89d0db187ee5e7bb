"""An allowance stops what already waits to be sent: at most one exchange exceeds it."""

import json

import pytest
from scenarios_for_tests import Shuffled, run, small
from test_order import by_instant

from netsim.trace.events import AlgorithmRecord, EnergyBudget, Frame

EXCHANGE_J = {"csma": 1.5e-3, "lpl": 0.04}
"""More than one broadcast with its back-off (26 ms) or its train (0.6 s) at 57 mW."""


class Many:
    """Node 0 broadcasts fifty things at once."""

    def run(self, node):
        if node.id == 0:
            for ticket in [node.broadcast("burst", bytes(80)) for _ in range(50)]:
                delivery = yield from ticket.wait()
                node.record(AlgorithmRecord(node.id, "fate", json.dumps([delivery.reason, delivery.attempts])))
        yield from node.pause(1)


class ManyInATask:
    """The same within a task."""

    def run(self, node):
        with node.task("burst", allowance_j=0.008, policy="refuse"):
            yield from Many().run(node)


class Stamped:
    """Node 0 sends stamped messages while it may send nothing."""

    def run(self, node):
        while not node.budget.is_short:
            yield from node.pause(10**7)
        for _ in range(5):
            node.broadcast_stamped("time", bytes(8))


def burst(folder, mac, budget="", algorithm="Many"):
    more = f"    budget: {budget}" if budget else ""
    return small(
        folder, more=more, mac=f"{{type: {mac}}}", algorithm=f'{{type: "test_budget_queue:{algorithm}"}}', duration_s=30
    )


def started_after_short(events):
    short_ns = next(t for t, e in events if isinstance(e, EnergyBudget) and e.event == "short" and e.node == 0)
    frames = [e for _, e in events if isinstance(e, Frame) and e.source == 0 and e.kind == "burst"]
    return short_ns, {e.message_id for e in frames if e.t_start_ns > short_ns}, {e.message_id for e in frames}


@pytest.mark.parametrize("mac", ["csma", "lpl"])
@pytest.mark.parametrize("policy", ["refuse", "sleep"])
def test_at_most_one_exchange_is_begun_before_and_ends_after_it_is_used_up(tmp_path, mac, policy):
    budget = f"{{allowance_j: 0.008, per: run, policy: {policy}}}"
    events, simulation = run(burst(tmp_path, mac, budget))
    _, late, frames = started_after_short(events)
    assert frames
    assert len(late) <= 1
    fates = [json.loads(e.fields_json) for _, e in events if isinstance(e, AlgorithmRecord)]
    refused = 50 - len(frames) if policy == "refuse" else 0
    assert fates == [["", 1]] * len(frames) + [["no_energy", 0]] * refused
    assert simulation.nodes[0].parts.budget.held == (0 if policy == "refuse" else 50 - len(frames))
    if policy == "sleep":
        parts = simulation.nodes[0].parts
        asleep_j = parts.radio.device.power_down_mw * 1e-3 * 30
        assert parts.budget.spent_j <= 0.008 + EXCHANGE_J[mac] + asleep_j


@pytest.mark.parametrize("mac", ["csma", "lpl"])
def test_a_task_stops_what_waits_too(tmp_path, mac):
    events, simulation = run(burst(tmp_path, mac, algorithm="ManyInATask"))
    _, late, frames = started_after_short(events)
    assert frames
    assert len(late) <= 1
    assert simulation.nodes[0].parts.budget.held == 0


@pytest.mark.parametrize("policy", ["refuse", "sleep"])
def test_what_waited_goes_out_when_it_is_replenished_whatever_the_order(tmp_path, policy):
    loaded = burst(tmp_path, "csma", f"{{allowance_j: 0.008, per: 1, policy: {policy}}}")
    events, _ = run(loaded)
    frames = {e.message_id for _, e in events if isinstance(e, Frame) and e.kind == "burst"}
    assert (len(frames) == 50) == (policy == "sleep")
    assert by_instant(run(loaded, Shuffled(1))[0]) == by_instant(events)


def test_a_stamped_message_that_is_refused_at_once_is_forgotten(tmp_path):
    budget = "{allowance_j: 0.008, per: run, policy: refuse}"
    _, simulation = run(burst(tmp_path, "csma", budget, algorithm="Stamped"))
    assert simulation.nodes[0].parts.stamps._sent == set()
