"""The test doubles: what they carry, in which order, and that the documented examples hold."""

import doctest

import networkx as nx
import numpy as np
import pytest

import netsim.testing
from netsim.api import NodeHandle, Op
from netsim.errors import AlgorithmError, NetsimError
from netsim.testing import (
    DROP,
    PASS,
    Passage,
    PerfectMedium,
    ScriptedMedium,
    delay,
    duplicate,
    rule,
    run_algorithm,
)
from netsim.trace.events import (
    EnergyLedger,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    RadioState,
)

MS = 1_000_000


class Tell:
    """Node 0 tells node `to` something `times` times; the others listen until `until_ns`."""

    def __init__(self, to=1, times=1, until_ns=100 * MS):
        self.to, self.times, self.until_ns = to, times, until_ns
        self.deliveries = []

    def run(self, node: NodeHandle) -> Op[None]:
        if node.id == 0:
            for number in range(self.times):
                self.deliveries.append((yield from node.send(self.to, "word", bytes([number])).wait()))
        else:
            yield from node.pause_until(self.until_ns)


def received(run, node):
    return [(message.received_ns, message.payload[0]) for message in run.delivered[node]]


def test_the_documented_examples_hold():
    result = doctest.testmod(netsim.testing)
    assert result.attempted > 5
    assert result.failed == 0


def test_everything_arrives_after_the_delay_and_every_event_is_recorded():
    run = run_algorithm(Tell(), medium=PerfectMedium(delay_s=0.002)).require_success()
    assert [(time_ns, type(event)) for time_ns, event in run.events if not isinstance(event, EnergyLedger)][1:] == [
        (0, NodeLife),
        (0, NodeLife),
        (0, MessageSent),
        (2 * MS, MessageDelivered),
        (2 * MS, NodeLife),
        (100 * MS, NodeLife),
        (100 * MS, type(run.events[0][1])),
    ]
    assert received(run, 1) == [(2 * MS, 0)]
    assert run.end_ns == 100 * MS


def test_rules_delay_drop_duplicate_by_count_and_the_first_opinion_decides():
    rules = [
        rule(DROP, kind="word", counts={1}),
        rule(delay(0.005), source=0, destination=1, counts={2}),
        rule(duplicate(0.003), when=lambda passage: passage.payload == b"\x03"),
        rule(DROP, kind="other"),
        rule(PASS, counts={4}),
        rule(DROP, counts={4}),
        rule(DROP, from_s=0.011, until_s=0.012),
    ]
    algorithm = Tell(times=6)
    run = run_algorithm(algorithm, medium=ScriptedMedium(rules)).require_success()
    # sent at 0, 1 (lost, known at 2), 2 (arrives at 8), 8, 9, 10
    assert received(run, 1) == [(1 * MS, 0), (8 * MS, 2), (9 * MS, 3), (10 * MS, 4), (11 * MS, 5), (12 * MS, 3)]
    assert [delivery.reason for delivery in algorithm.deliveries] == ["", "no_ack", "", "", "", ""]
    assert [(time_ns, event.reason, event.node) for time_ns, event in run.of(MessageDropped)] == [(2 * MS, "no_ack", 0)]


def test_time_rules_are_half_open():
    within = rule(DROP, from_s=0.001, until_s=0.002)
    passages = [Passage(0, 1, "k", b"", time_ns, 0, False) for time_ns in (MS - 1, MS, 2 * MS - 1, 2 * MS)]
    assert [within(passage) for passage in passages] == [None, DROP, DROP, None]


class Shout:
    """Everybody speaks at the same instant, in an order that depends on the seed."""

    def run(self, node: NodeHandle) -> Op[None]:
        yield from node.pause_until(5 * MS)
        for _ in range(2):
            node.broadcast("shout", b"")
        yield from node.pause_until(50 * MS)


def test_deliveries_at_one_instant_go_by_receiver_sender_number_and_copy():
    run = run_algorithm(Shout, nodes=[7, 3, 5], medium=ScriptedMedium([rule((0, 0), source=3)]))
    order = [(event.node, event.source) for _, event in run.of(MessageDelivered)]
    assert order == sorted(order)
    assert [message.source for message in run.delivered[5]] == [3, 3, 3, 3, 7, 7]
    ids = [message.id for message in run.delivered[5]]
    assert ids[0] == ids[1] < ids[2] == ids[3]


def test_broadcasts_reach_neighbours_and_messages_take_the_fewest_hops():
    line = nx.path_graph(4).adj
    run = run_algorithm(Shout, nodes=4, neighbours=line)
    assert {event.node for _, event in run.of(MessageDelivered) if event.source == 0} == {1}
    run = run_algorithm(Tell(to=3), nodes=4, neighbours=line).require_success()
    assert [message.hops for message in run.delivered[3]] == [3]


def test_without_a_way_a_message_is_dropped():
    algorithm = Tell(to=2)
    run = run_algorithm(algorithm, nodes=3, neighbours={0: [1], 1: [0]}).require_success()
    assert [event.reason for _, event in run.of(MessageDropped)] == ["no_route"]
    assert algorithm.deliveries[0].attempts == 0


class Doze:
    def run(self, node: NodeHandle) -> Op[None]:
        if node.id == 1:
            node.radio_sleep()
            yield from node.pause(10 * MS)
            node.radio_wake()
            message = yield from node.receive()
            node.log(str(message.payload))
        else:
            early = yield from node.send(1, "word", b"early").wait()
            yield from node.pause_until(20 * MS)
            late = yield from node.send(1, "word", b"late").wait()
            node.log(f"{early.reason} {late.reason}")


def test_a_sleeping_radio_hears_nothing():
    run = run_algorithm(Doze).require_success()
    assert [message.payload for message in run.delivered[1]] == [b"late"]
    assert [event.message for _, event in run.events if type(event).__name__ == "Log"] == ["b'late'", "no_ack "]
    assert [time_ns for time_ns, _ in run.of(RadioState)] == [0, 10 * MS]


class Work:
    def __init__(self, operations):
        self.operations = operations

    def run(self, node: NodeHandle) -> Op[None]:
        yield from node.compute(self.operations)
        observation = yield from node.sense()
        assert observation.values.tolist() == [node.id, 2.0]
        assert node.knowledge == f"node {node.id}"


def test_devices_cost_what_mental_arithmetic_says():
    run = run_algorithm(
        Work, parameters=3000, knowledge="node {}".format, observe=lambda node: [node, 2.0]
    ).require_success()
    assert run.energy_j == {0: pytest.approx(4e-6, rel=1e-12), 1: pytest.approx(4e-6, rel=1e-12)}
    assert run.end_ns == 4 * MS


def test_an_empty_battery_ends_a_node():
    run = run_algorithm(Work, parameters=3000, battery_j=2e-6)
    assert [(time_ns, event.event) for time_ns, event in run.of(NodeLife)][2:] == [(2 * MS, "died")] * 2
    assert run.failures == {}


class Draw:
    def run(self, node: NodeHandle) -> Op[None]:
        node.broadcast("number", node.rng("x").bytes(8))
        yield from node.pause(0)


def test_runs_repeat_and_seeds_differ():
    payloads = [run_algorithm(Draw, nodes=3, seed=seed).delivered[0][0].payload for seed in (1, 1, 2)]
    assert payloads[0] == payloads[1] != payloads[2]


class Stuck:
    def run(self, node: NodeHandle) -> Op[None]:
        yield from node.receive()


def test_failures_and_unfinished_nodes_are_told():
    run = run_algorithm(Stuck, duration_s=1.0)
    assert run.unfinished == (0, 1)
    assert run.end_ns == 10**9
    with pytest.raises(NetsimError, match=r"not ended.*\[0, 1\]"):
        run.require_success()
    run = run_algorithm(Work, parameters=10, observe=lambda node: np.zeros(2))
    assert set(run.failures) == {0, 1}
    with pytest.raises(AlgorithmError, match="node 0: the algorithm raised"):
        run.require_success()
