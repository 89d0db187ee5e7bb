"""What an algorithm meets on its node: inbox, tasks, devices, the handle, and the fence around its failures."""

import inspect

import numpy as np
import pytest

from netsim.api import NodeHandle, Op
from netsim.errors import AlgorithmError
from netsim.sim.handle import Handle
from netsim.testing import DROP, PerfectMedium, ScriptedMedium, delay, rule, run_algorithm
from netsim.trace.events import BROADCAST, EnergyLedger, Log, MessageSent, NodeLife

MS = 1_000_000


class By:
    """Each node runs its own function; the others return at once."""

    def __init__(self, **bodies):
        self.bodies = {int(name[1:]): body for name, body in bodies.items()}

    def run(self, node: NodeHandle) -> Op[None]:
        body = self.bodies.get(node.id)
        if body is not None:
            yield from body(node)


def lines(run, node=None):
    """What was logged, (time in ms, text)."""
    return [
        (time_ns / MS, event.message) for time_ns, event in run.of(Log) if node is None or event.name == f"node {node}"
    ]


def talker(*messages):
    """Sends (time in ms, kind) to node 0; each arrives 1 ms later."""

    def body(node):
        for time_ms, kind in messages:
            yield from node.pause_until(int(time_ms * MS))
            node.send(0, kind, f"{kind}{time_ms}".encode())

    return body


def text(message):
    return "nothing" if message is None else message.payload.decode()


# --- inbox ----------------------------------------------------------------------------------------------------------


def test_filters_do_not_steal_and_keep_the_order():
    def body(node):
        node.log(text((yield from node.receive(kinds={"b"}))))
        node.log(text((yield from node.receive(match=lambda message: message.payload.endswith(b"2")))))
        for _ in range(3):
            node.log(text((yield from node.receive(timeout_ns=10 * MS))))

    run = run_algorithm(By(n0=body, n1=talker((0, "a"), (1, "a"), (2, "a"), (3, "b")))).require_success()
    assert lines(run) == [(4, "b3"), (4, "a2"), (4, "a0"), (4, "a1"), (14, "nothing")]


def test_a_timeout_swallows_no_later_message():
    def body(node):
        for _ in range(3):
            node.log(text((yield from node.receive(timeout_ns=2 * MS))))

    run = run_algorithm(By(n0=body, n1=talker((2, "a"), (2.5, "b")))).require_success()
    assert lines(run) == [(2, "nothing"), (3, "a2"), (3.5, "b2.5")]


def test_a_message_that_comes_at_the_instant_of_the_timeout_is_received():
    def body(node):
        node.log(text((yield from node.receive(timeout_ns=3 * MS))))
        node.log(text((yield from node.receive(timeout_ns=0))))

    run = run_algorithm(By(n0=body, n1=talker((2, "a")))).require_success()
    assert lines(run) == [(3, "a2"), (3, "nothing")]


def test_two_receivers_of_one_node_share_its_inbox():
    def listen(node, kind):
        while (message := (yield from node.receive(kinds={kind}, timeout_ns=5 * MS))) is not None:
            node.log(f"{kind} got {text(message)}")
        return f"{kind} done"

    def body(node):
        task = node.spawn(listen(node, "a"))
        node.log((yield from listen(node, "b")))
        node.log((yield from task.join()))

    run = run_algorithm(By(n0=body, n1=talker((0, "a"), (1, "b"), (1, "a"), (2, "b")))).require_success()
    assert lines(run) == [
        (1, "a got a0"),
        (2, "b got b1"),
        (2, "a got a1"),
        (3, "b got b2"),
        (8, "b done"),
        (8, "a done"),
    ]


def test_of_two_equal_askers_the_one_who_waits_longest_is_served():
    def ask(node, name):
        node.log(f"{name} {text((yield from node.receive()))}")

    def body(node):
        tasks = [node.spawn(ask(node, name)) for name in ("first", "second")]
        for task in tasks:
            yield from task.join()

    run = run_algorithm(By(n0=body, n1=talker((0, "a"), (1, "b")))).require_success()
    assert lines(run) == [(1, "first a0"), (2, "second b1")]


def test_what_a_cancelled_task_was_given_is_not_lost():
    """It has the message, but before it can act on it its parent cancels it: the message goes back to the inbox."""

    def wait(node):
        yield from node.receive(kinds={"a"})

    def body(node):
        task = node.spawn(wait(node))
        yield from node.receive(kinds={"b"})
        task.cancel()
        node.log(text((yield from node.receive(timeout_ns=0))))
        assert (yield from task.join()) is None

    both = ScriptedMedium([rule(delay(0.001), kind="b")])
    run = run_algorithm(By(n0=body, n1=talker((0, "b"), (1, "a"))), medium=both).require_success()
    assert lines(run) == [(2, "a1")]


def test_a_match_that_raises_fails_its_own_node_only():
    def body(node):
        yield from node.receive(match=lambda message: message.payload[100] == 0)

    run = run_algorithm(By(n0=body, n1=talker((0, "a"), (5, "b"))))
    assert set(run.failures) == {0}
    assert "IndexError" in str(run.failures[0])
    assert (5 * MS, "finished") in [(time_ns, event.event) for time_ns, event in run.of(NodeLife)]


def test_kinds_given_as_one_string_are_refused():
    def body(node):
        yield from node.receive(kinds="ab")

    assert "collection of names" in str(run_algorithm(By(n0=body)).failures[0])


# --- tasks ----------------------------------------------------------------------------------------------------------


def test_tasks_join_cancel_and_end_with_the_algorithm():
    def work(node, name, duration_ns):
        yield from node.pause(duration_ns)
        node.log(name)
        return name

    def body(node):
        short, long, endless = (node.spawn(work(node, str(n), n * MS)) for n in (1, 3, 100))
        assert (yield from short.join()) == "1"
        assert (yield from short.join()) == "1"
        long.cancel()
        assert (yield from long.join()) is None
        long.cancel()
        yield from node.pause(5 * MS)
        assert endless is not None

    run = run_algorithm(By(n0=body)).require_success()
    assert lines(run) == [(1, "1")]
    assert run.end_ns == 6 * MS


def test_a_task_cancelled_before_it_began_does_nothing():
    def work(node):
        node.log("began")
        yield from node.pause(1)

    def body(node):
        node.spawn(work(node)).cancel()
        yield from node.pause(MS)

    assert lines(run_algorithm(By(n0=body)).require_success()) == []


def test_a_failure_is_recorded_and_the_others_go_on():
    def body(node):
        yield from node.pause(MS)
        raise ValueError("no such luck")

    def other(node):
        yield from node.pause(3 * MS)

    run = run_algorithm(By(n0=body, n1=other))
    assert isinstance(run.failures[0], AlgorithmError)
    assert isinstance(run.failures[0].__cause__, ValueError)
    assert [(time_ns, event.node, event.event) for time_ns, event in run.of(NodeLife)][2:] == [
        (MS, 0, "failed"),
        (3 * MS, 1, "finished"),
    ]


def test_a_task_that_raises_ends_its_algorithm():
    def work(node):
        yield from node.pause(MS)
        raise KeyError("gone")

    def body(node):
        node.spawn(work(node))
        while True:
            yield from node.pause(10 * MS)
            node.log("still here")

    run = run_algorithm(By(n0=body), duration_s=1.0)
    assert "KeyError" in str(run.failures[0])
    assert run.unfinished == ()
    assert lines(run) == []
    assert [event.event for _, event in run.of(NodeLife) if event.node == 0] == ["started", "failed"]


# --- devices --------------------------------------------------------------------------------------------------------


def ledger(run, node=0):
    (_, table), *_ = run.of(EnergyLedger)
    rows = zip(table.node, table.device, table.state, table.energy_j, table.time_s, strict=True)
    return {(device, state): (energy_j, time_s) for at, device, state, energy_j, time_s in rows if at == node}


def test_jobs_of_one_cpu_wait_for_each_other():
    def job(node, operations):
        yield from node.compute(operations)
        node.log(str(operations))

    def body(node):
        tasks = [node.spawn(job(node, operations)) for operations in (2000, 3000)]
        yield from node.pause(MS)
        yield from job(node, 1000)
        for task in tasks:
            yield from task.join()
        yield from node.pause(4 * MS)

    run = run_algorithm(By(n0=body)).require_success()
    assert lines(run) == [(2, "2000"), (5, "3000"), (6, "1000")]
    assert ledger(run)["cpu", "active"] == (pytest.approx(6e-6), 0.006)
    assert ledger(run)["cpu", "sleep"] == (0.0, pytest.approx(0.004))


def test_a_cancelled_reading_or_job_does_not_leave_its_device_on():
    """The CPU finishes the job it was given; the sensor is switched off. What waited for the CPU is forgotten."""

    def body(node):
        tasks = [node.spawn(node.compute(2000)), node.spawn(node.compute(5000)), node.spawn(node.sense())]
        yield from node.pause(MS // 2)
        for task in tasks:
            task.cancel()
        yield from node.pause(50 * MS)

    run = run_algorithm(By(n0=body), observe=lambda node: []).require_success()
    assert ledger(run)["sensor", "sample"] == (pytest.approx(0.5e-6), 0.0005)
    assert ledger(run)["cpu", "active"][1] <= 0.007


def test_a_node_without_a_sensor_cannot_sense():
    def body(node):
        yield from node.sense()

    assert "no sensor" in str(run_algorithm(By(n0=body)).failures[0])


# --- the handle -----------------------------------------------------------------------------------------------------


def test_the_handle_has_the_names_of_the_interface_and_no_more():
    names = {name for name in dir(NodeHandle) if not name.startswith("_")}
    assert {name for name in dir(Handle) if not name.startswith("_")} == names


def test_its_methods_take_the_arguments_of_the_interface():
    for name in dir(NodeHandle):
        if not name.startswith("_") and inspect.isfunction(getattr(NodeHandle, name)):
            mine, theirs = (list(inspect.signature(getattr(cls, name)).parameters) for cls in (Handle, NodeHandle))
            assert mine == theirs, name


INNER = ("netsim.sim.node", "netsim.sim.simulation", "netsim.sim.clock", "netsim.sim.energy", "netsim.sim.handle")


def reachable(start, depth=4):
    """Everything that public attributes, items and elements lead to, but not what calls would give."""
    seen, front = {}, [start]
    for _ in range(depth):
        found = []
        for thing in front:
            if isinstance(thing, str | bytes | int | float | type(None) | np.ndarray) or callable(thing):
                continue
            values = [getattr(thing, name) for name in dir(thing) if not name.startswith("_")]
            values += list(thing) if isinstance(thing, tuple | list | set | frozenset) else []
            found += [value for value in values if id(value) not in seen]
            seen |= {id(value): value for value in values}
        front = found
    return list(seen.values())


def test_no_public_way_leads_from_a_handle_to_another_node_or_the_simulation():
    seen = {}

    def body(node):
        ticket = node.send(1 - node.id, "word", b"")
        task = node.spawn(node.pause(1))
        message = yield from node.receive()
        for thing in (node, ticket, task, message):
            seen.setdefault(node.id, []).extend(reachable(thing))
        yield from task.join()

    run_algorithm(By(n0=body, n1=body), knowledge=lambda node: (node, "known")).require_success()
    for node, things in seen.items():
        modules = {type(thing).__module__ for thing in things if not callable(thing)}
        assert not modules & set(INNER)
        assert not {module for module in modules if module.startswith("simpy")}
        assert (1 - node, "known") not in [thing for thing in things if isinstance(thing, tuple)]


@pytest.mark.parametrize(
    ("misuse", "said"),
    [
        (lambda node: node.send(0, "k", b""), "itself"),
        (lambda node: node.send(9, "k", b""), "does not exist"),
        (lambda node: node.send(BROADCAST, "k", b""), "does not exist"),
        (lambda node: node.send(1, "k", "text"), "not bytes"),
        (lambda node: node.broadcast("k", bytearray(3)), "not bytes"),
        (lambda node: node.spawn(node.pause(-5)), "-5"),
        (lambda node: node.spawn(node.pause(1.5)), "whole number"),
        (lambda node: node.spawn(node.pause_until(1e6)), "whole number"),
        (lambda node: node.spawn(node.receive(timeout_ns=1e6)), "whole number"),
        (lambda node: node.spawn(node.compute(2.5)), "whole number"),
        (lambda node: node.spawn(node.compute(-1)), "-1"),
    ],
)
def test_misuse_is_an_error_of_the_algorithm(misuse, said):
    def body(node):
        misuse(node)
        yield from node.pause(10 * MS)

    def other(node):
        yield from node.pause(20 * MS)

    run = run_algorithm(By(n0=body, n1=other))
    assert isinstance(run.failures[0], AlgorithmError)
    assert said in str(run.failures[0])
    assert run.of(MessageSent) == []
    assert run.end_ns == 20 * MS


def test_whole_numbers_of_numpy_are_whole_numbers():
    def body(node):
        yield from node.pause(np.int64(MS))
        yield from node.compute(np.int32(1000))
        node.log(type(node.now_ns).__name__)

    assert lines(run_algorithm(By(n0=body)).require_success()) == [(2, "int")]


def test_the_past_and_now_are_not_waited_for():
    def body(node):
        yield from node.pause(2 * MS)
        yield from node.pause_until(MS)
        yield from node.pause_until(2 * MS)
        node.log("there")

    assert lines(run_algorithm(By(n0=body)).require_success()) == [(2, "there")]


def test_causes_are_the_messages_received_since_the_sends_before():
    def body(node):
        yield from node.receive(kinds={"a"})
        node.send(1, "reply", b"")
        node.send(1, "again", b"")
        message = yield from node.receive(kinds={"c"})
        node.send(1, "late", b"", causes=[message])

    medium = PerfectMedium()
    run = run_algorithm(By(n0=body, n1=talker((0, "a"), (0, "b"), (5, "c"))), medium=medium).require_success()
    ids = {event.kind: event.message_id for _, event in run.of(MessageSent)}
    causes = {event.kind: list(event.causes) for _, event in run.of(MessageSent)}
    assert causes["reply"] == causes["again"] == [ids["a"]]
    assert causes["late"] == [ids["c"]]


def test_random_streams_are_one_object_for_each_purpose():
    draws = {}

    def body(node):
        assert node.rng("x") is node.rng("x")
        draws[node.id] = (node.rng("x").random(), node.rng("y").random())
        yield from node.pause(0)

    run_algorithm(By(n0=body, n1=body)).require_success()
    assert len({*draws[0], *draws[1]}) == 4


def test_a_lost_message_leaves_its_receiver_waiting():
    def body(node):
        node.log(text((yield from node.receive(timeout_ns=10 * MS))))

    run = run_algorithm(By(n0=body, n1=talker((0, "a"))), medium=ScriptedMedium([rule(DROP)])).require_success()
    assert lines(run) == [(10, "nothing")]


def test_operations_that_are_spawned_stored_or_cancelled_are_not_forgotten():
    def body(node):
        node.spawn(node.pause(5)).cancel()
        later = node.pause(3)
        node.broadcast("a", b"")
        yield from later
        task = node.spawn(node.pause(7))
        yield from task.join()
        assert node.now_ns == 10

    run_algorithm(By(n0=body, n1=body)).require_success()
