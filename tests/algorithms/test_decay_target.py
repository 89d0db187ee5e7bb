"""Correlation decay with a target: t grows, and what it takes to know is asked for, until the interval is narrow enough."""

from dataclasses import replace

import numpy as np
import pytest
from decay_rig import PROBLEM, WHOLE, by_kernel, holds, parameters, problem, stated
from hypothesis import example, given, settings
from hypothesis import strategies as st

from netsim.algorithms.correlation_decay import CorrelationDecay
from netsim.algorithms.correlation_decay_parameters import TargetParameters
from netsim.kernels.decay_interval import DecayInterval
from netsim.kernels.known_association import KnownAssociation, report_of
from netsim.kernels.matchings import association_probabilities
from netsim.testing import DROP, rule
from netsim.trace.events import EnergyBudget, MessageSent, PairProbabilities

fast = settings(deadline=None, max_examples=8)
seeds = st.integers(0, 2**32 - 1)
TARGET = TargetParameters(interval_width=0.01)


def count(found, kind):
    return sum(event.kind == kind for _, event in found.run.of(MessageSent))


@fast
@given(seeds, st.integers(0, 2), st.integers(1, 9), st.sampled_from([0.5, 0.01, 0.0]))
def test_a_target_is_reached_or_everything_was_tried(seed, hops, depth, width):
    scene = problem(seed)
    found = stated(scene, parameters(hops, depth=depth, target=TargetParameters(interval_width=width)))
    holds(scene, found)
    exact = association_probabilities(scene.instance.weights)
    for (j, k), (p, low, high) in found.told.items():
        used = found.depth[scene.instance.owners[j]]
        assert abs(p - exact[j, k]) <= high - low + 1e-12
        assert used <= depth
        assert used % 2 == 0 or used == depth
        assert high - low <= width or used == depth


@fast
@given(seeds, st.integers(0, 1))
def test_with_depth_enough_a_target_is_always_reached_by_asking(seed, hops):
    """Nothing was flooded, or little: what is missing is asked for, and all intervals become points."""
    scene = problem(seed, replace(PROBLEM, events=replace(PROBLEM.events, count=4)))
    found = stated(scene, parameters(hops, depth=9, target=TargetParameters(interval_width=1e-9)))
    exact = association_probabilities(scene.instance.weights)
    assert all(high - low <= 1e-9 for _, low, high in found.told.values())
    assert all(abs(p - exact[pair]) <= 1e-9 for pair, p in found.probabilities.items())


@fast
@given(seeds, st.sampled_from([1, 3, 5]))
def test_at_the_last_odd_depth_all_that_it_needs_is_asked_for(seed, depth):
    """Intervals are then those of the whole graph at that depth."""
    scene = problem(seed)
    found = stated(scene, parameters(0, depth=depth, target=TargetParameters(interval_width=0.0)))
    whole = by_kernel(scene, lambda graph, j, k: DecayInterval(graph).pair(j, k, depth))
    for (j, k), (_, low, high) in found.told.items():
        if found.depth[scene.instance.owners[j]] == depth:
            assert (low, high) == pytest.approx(whole[j, k], rel=1e-12)


def test_growing_asks_for_no_more_than_it_needs():
    scene = problem(3)
    wide, narrow = (
        stated(scene, parameters(0, depth=9, target=TargetParameters(interval_width=width))) for width in (0.9, 0.01)
    )
    assert 0 < wide.statistics["asked"] < narrow.statistics["asked"]
    assert max(wide.depth.values()) < max(narrow.depth.values())
    assert count(narrow, "report") == narrow.statistics["asked"]


def test_who_does_not_answer_is_asked_a_few_times_and_no_more():
    scene = problem(3)
    target = replace(TARGET, ask_attempts=2)
    found = stated(scene, parameters(0, depth=6, target=target), [rule(DROP, kind="report", source=13)])
    holds(scene, found)
    asked = [event.source for _, event in found.run.of(MessageSent) if event.kind == "report" and event.source == 13]
    assert asked
    assert len(asked) == 2 * len({node for node in scene.sensors_m if node != 13 and found_asks(found, node)})


def found_asks(found, node):
    """Whether a node asked node 13, which is in the answers' receivers."""
    return any(
        event.kind == "report" and event.source == 13 and event.destination == node
        for _, event in found.run.of(MessageSent)
    )


class Torn:
    """A node of which the first report to each that asks is torn."""

    def __init__(self, node):
        self._node, self._told = node, set()

    def __getattr__(self, name):
        return getattr(self._node, name)

    def send(self, destination, kind, payload, **more):
        if kind == "report" and destination not in self._told:
            self._told.add(destination)
            payload = b"torn" + payload
        return self._node.send(destination, kind, payload, **more)


class TearsReports(CorrelationDecay):
    def run(self, node):
        yield from super().run(Torn(node))


def test_a_report_that_cannot_be_read_is_no_answer():
    scene = problem(3)
    chosen = parameters(0, depth=9, target=replace(TARGET, ask_attempts=2))
    whole, torn = stated(scene, chosen), stated(scene, chosen, algorithm=TearsReports)
    assert torn.told == whole.told
    assert torn.statistics["asked"] == 2 * whole.statistics["asked"]


SILENT = [rule(DROP, kind="report", source=13)]


def test_no_question_is_asked_whose_answer_could_not_come_before_the_end():
    """An answer is waited for for half a minute, and nodes end after a minute and a half."""
    scene, until_s = problem(3), 90.0
    target = TargetParameters(interval_width=0.0, ask_attempts=5, answer_s=30.0)
    found = stated(scene, parameters(0, depth=9, target=target, until_s=until_s), SILENT)
    holds(scene, found)
    assert len(found.told) == np.count_nonzero(scene.instance.weights)
    assert all(time_ns <= until_s * 1e9 for time_ns, _ in found.run.of(PairProbabilities))
    asked_ns = [time_ns for time_ns, event in found.run.of(MessageSent) if event.kind == "ask"]
    assert 30e9 < max(asked_ns) <= (until_s - 30.0) * 1e9


@fast
@given(seeds, st.sampled_from([0.01, 0.1, 0.3]))
@example(0, 0.3)
@example(3, 0.1)
@example(4, 0.2)
@example(7, 0.3)
def test_who_stops_before_its_time_could_have_gained_no_more_than_the_target(seed, width):
    """Against the intervals at full depth with all reports but the silent sensor's."""
    scene = problem(seed)
    found = stated(scene, parameters(0, depth=12, target=TargetParameters(interval_width=width)), SILENT)
    holds(scene, found)
    for pair, (low, high) in all_but(scene, 13).items():
        _, stated_low, stated_high = found.told[pair]
        assert stated_low <= low + 1e-12
        assert high <= stated_high + 1e-12
        if stated_high - stated_low > width and found.depth[scene.instance.owners[pair[0]]] < 12:
            assert high - low > width
            assert stated_high - stated_low <= high - low + width + 1e-12


def all_but(scene, silent):
    """Bounds at full depth of the pairs of all sensors but one, which is never heard of; by number among all."""
    places = {node: scene.knowledge(node) for node in scene.sensors_m if node != silent}
    reports = {
        node: report_of(node, scene.observe(node, 0), known.events, known.model) for node, known in places.items()
    }
    known = KnownAssociation.of(
        reports,
        {event.event: scene.knowledge(silent).observers(event) for event in scene.instance.events},
        PROBLEM.model,
    )
    interval = DecayInterval(known.graph, known.incomplete)
    names = [(places[node].first_variable + number) for node, number in known.measurements]
    return {
        (names[j], known.events[k].event): interval.pair(j, k, known.graph.exact_depth + 1)
        for j, k in np.argwhere(known.graph.weights > 0.0).tolist()
    }


def test_a_target_that_a_silent_sensor_puts_out_of_reach_is_given_up():
    scene = problem(3)
    chosen = parameters(0, depth=12, target=TargetParameters(interval_width=0.01))
    found = stated(scene, chosen, SILENT)
    stopped = {
        pair: high - low
        for pair, (_, low, high) in found.told.items()
        if found.depth[scene.instance.owners[pair[0]]] < 12
    }
    assert max(stopped.values()) > 0.01


def test_an_allowance_ends_the_growing():
    scene = problem(3)
    free = stated(scene, parameters(0, depth=9, target=replace(TARGET, interval_width=0.0)))
    spent = max(event.spent_j for _, event in free.run.of(EnergyBudget))
    tight = replace(TARGET, interval_width=0.0, allowance_j=spent / 100)
    found = stated(scene, parameters(0, depth=9, target=tight))
    holds(scene, found)
    owners = set(scene.instance.owners)
    assert max(found.depth.values()) < max(free.depth.values())
    assert found.depth.keys() == free.depth.keys() <= owners
    assert found.statistics["asked"] < free.statistics["asked"]


def test_factors_are_computed_at_the_depth_of_who_asks():
    """Where nodes choose t each for itself: a node without measurements stops at once, and computes for others all the
    same as deep as they are.
    """
    scene = problem(3)
    target = TargetParameters(interval_width=0.0)
    chosen = parameters(WHOLE, estimator="literal", depth=8, vertices="known", target=target)
    local = stated(scene, chosen)
    assert stated(scene, replace(chosen, factors="requests")).probabilities == pytest.approx(
        local.probabilities, rel=1e-11
    )
