"""Variables of dead hosts: taken over by the next, and never for good by two."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from netsim.algorithms.message_passing import MessagePassing
from netsim.algorithms.message_passing_parameters import MaxProductParameters
from netsim.algorithms.rehosting import Claim, successor
from netsim.api import Algorithm, NodeHandle, Op
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.semiring import Semiring
from netsim.problems.association import AssociationParameters, UniformTargets, build
from netsim.rng import Streams
from netsim.testing import DROP, MessageMedium, ScriptedMedium, TestRun, rule, run_algorithm
from netsim.trace.events import AlgorithmRecord, Association, GraphMessages

ROUNDS = 40
PARAMETERS = MaxProductParameters(rounds=ROUNDS, spread_s=0.1, resend=1, rehost=True, suspect_after=2)


class Mortal:
    """Runs an algorithm; on some nodes only until a moment."""

    def __init__(self, inner: Algorithm, victims: Sequence[int], end_ns: int) -> None:
        self._inner = inner
        self._victims = victims
        self._end_ns = end_ns

    def run(self, node: NodeHandle) -> Op[None]:
        if node.id not in self._victims:
            yield from self._inner.run(node)
            return
        task = node.spawn(self._inner.run(node))
        yield from node.pause_until(self._end_ns)
        node.radio_sleep()
        task.cancel()


def problem(seed: int) -> tuple[AssociationInstance, int, int, tuple[int, ...]]:
    """Nine sensors, a target seen by three or more, its host and the other covering nodes."""
    sensors_m = np.array([(4.0 * x, 4.0 * y) for x in range(3) for y in range(3)])
    parameters = AssociationParameters(targets=UniformTargets(count=7), variance="total")
    instance = build(parameters, sensors_m, range(9), Streams(seed)).instance
    target, host = next((t, h) for t, h in enumerate(instance.hosts) if h is not None)
    others = instance.preferences[target][1:]
    return instance, target, host, others


def simulate(
    instance: AssociationInstance,
    parameters: MaxProductParameters = PARAMETERS,
    *victims: int,
    medium: MessageMedium | None = None,
) -> TestRun:
    def made() -> Algorithm:
        return Mortal(MessagePassing(parameters, Semiring.MAX), victims, 12 * 10**9)

    return run_algorithm(
        made,
        nodes=instance.sensor_nodes,
        knowledge=instance.knowledge,
        observe=lambda node: instance.measurements_m[node],
        medium=medium,
    )


def decisions(run: TestRun, without: int = -1) -> dict[int, list[int]]:
    return {e.node: list(e.target) for _, e in run.of(Association) if e.round == ROUNDS and e.node != without}


def hosts_at_the_end(run: TestRun, vertex: int) -> set[int]:
    return {e.node for _, e in run.of(GraphMessages) if e.round == ROUNDS and vertex in list(e.source)}


def moves(run: TestRun, kind: str) -> list[int]:
    return [event.node for _, event in run.of(AlgorithmRecord) if event.kind == kind]


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_after_a_death_all_decide_as_if_the_next_had_been_the_host_from_the_start(seed: int) -> None:
    instance, target, host, others = problem(seed)
    run = simulate(instance, PARAMETERS, host)
    assert others[0] in moves(run, "rehosted")
    hosted_by = tuple(instance.preferences[t][1] if h == host else h for t, h in enumerate(instance.hosts))
    elsewhere = simulate(replace(instance, hosts=hosted_by), PARAMETERS, host)
    assert not moves(elsewhere, "rehosted")
    assert decisions(run, host) == decisions(elsewhere, host)
    assert hosts_at_the_end(run, 9 + target) == {others[0]}


def test_notices_tell_of_a_death_too() -> None:
    instance, target, host, others = problem(1)
    run = simulate(instance, replace(PARAMETERS, silence="notice"), host)
    assert hosts_at_the_end(run, 9 + target) == {others[0]}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_bad_link_does_not_split_the_variable_for_good(seed: int) -> None:
    """The next candidate does not reach the living host for a while, and takes over; the host hears of it."""
    instance, target, host, others = problem(seed)
    cut = [
        rule(DROP, source=a, destination=b, from_s=8.0, until_s=20.0) for a, b in ((host, others[0]), (others[0], host))
    ]
    run = simulate(instance, medium=ScriptedMedium(cut)).require_success()
    assert others[0] in moves(run, "rehosted")
    assert host in moves(run, "stepped-down")
    assert len(hosts_at_the_end(run, 9 + target)) == 1
    assert decisions(run) == decisions(simulate(instance))


@pytest.mark.parametrize("seed", [1, 2])
def test_who_was_told_that_a_host_lives_suspects_it_again_later(seed: int) -> None:
    """The third candidate never hears the host; the second says that it lives; then both die, and the third takes over."""
    instance, target, host, others = problem(seed)
    cut = [rule(DROP, source=a, destination=b) for a, b in ((host, others[1]), (others[1], host))]
    run = simulate(instance, PARAMETERS, host, others[0], medium=ScriptedMedium(cut))
    assert hosts_at_the_end(run, 9 + target) == {others[1]}


def test_nothing_moves_where_nothing_fails() -> None:
    instance, *_ = problem(1)
    run, plain = simulate(instance), simulate(instance, replace(PARAMETERS, rehost=False))
    assert not run.of(AlgorithmRecord)
    assert run.delivered == plain.delivered


@pytest.mark.parametrize(("suspects", "expected"), [((), 5), ((5,), 7), ((5, 7), 2), ((5, 7, 2), None)], ids=str)
def test_the_order_goes_round(suspects: Sequence[int], expected: Any) -> None:
    assert successor((2, 3, 5, 7), 1, set(suspects)) == expected


def test_of_two_claims_exactly_one_wins() -> None:
    claims = [Claim(0, epoch, rank) for epoch in range(3) for rank in range(3)]
    assert all(a.beats(b) != b.beats(a) for a in claims for b in claims if a != b)
    assert not any(claim.beats(claim) for claim in claims)
