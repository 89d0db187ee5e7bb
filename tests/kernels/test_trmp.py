"""Tree-reweighted max-product against enumeration and the integer programme."""

from itertools import product

import numpy as np
import pytest
from association_oracle import instance, model
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.assignment import best_assignment, joint_score
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.factor_graph import Factor, FactorGraph, most_probable, vertices_of
from netsim.kernels.reparameterization import Reparameterized
from netsim.kernels.trmp import agree, run_trmp
from netsim.kernels.vertex import Choice


@st.composite
def pairwise_graphs(draw, zeros=False):
    """A random pairwise model on up to six variables of two or three states, with a few impossible pairs if wished."""
    count = draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    cards = tuple(int(c) for c in rng.integers(2, 4, count))
    factors = [Factor((v,), rng.random(cards[v]) + 0.05) for v in range(count)]
    for a in range(count):
        for b in range(a + 1, count):
            if rng.random() < 0.5:
                table = np.exp(rng.normal(0.0, 1.0, (cards[a], cards[b])))
                if zeros:
                    table[1:, 1:] *= rng.random((cards[a] - 1, cards[b] - 1)) < 0.7  # state 0 is always possible
                factors.append(Factor((a, b), table))
    return FactorGraph(cards, tuple(factors))


@st.composite
def problems(draw):
    sensors = draw(st.integers(2, 4))
    chosen = st.sets(st.integers(0, sensors - 1), min_size=1, max_size=3).map(lambda s: tuple(sorted(s)))
    coverage = draw(st.lists(chosen, min_size=1, max_size=5))
    false_alarms = draw(st.sampled_from(["strict", "geometric"]))
    most = [sum(s in sensors for sensors in coverage) for s in range(sensors)]
    counts = [draw(st.integers(0, min(count + 1, 3))) for count in most]
    return instance(coverage, counts, draw(st.integers(0, 2**32 - 1)), model(false_alarms))


def outcome(result, vertices):
    """(proved, state by vertex) of a whole run."""
    states = {vertex: state for part in result for vertex, state in part.states.items()}
    assert set(states) == {vertex.id for vertex in vertices}
    return all(part.proved for part in result), states


@pytest.mark.parametrize("form", ["pairwise", "factor"])
@pytest.mark.parametrize("schedule", ["two_pass", "flooding"])
@settings(max_examples=40)
@given(graph=pairwise_graphs(zeros=True))
def test_agreement_is_the_map_state(form, schedule, graph):
    vertices = vertices_of(graph, form)
    proved, states = outcome(run_trmp(vertices, schedule=schedule, iterations=40), vertices)
    decided = [states[variable][0] for variable in range(len(graph.cardinalities))]
    best, score = most_probable(graph)
    assert graph.log_score(decided) <= score + 1e-9
    if proved:
        assert graph.log_score(decided) == pytest.approx(score, abs=1e-9)
        assert tuple(decided) == best


@settings(max_examples=40)
@given(problem=problems())
def test_agreement_is_the_best_association(problem):
    vertices = instance_vertices(problem)
    proved, states = outcome(run_trmp(vertices, iterations=60), vertices)
    if proved:
        decisions = [np.array(states[sensor], dtype=np.int64) for sensor in range(len(problem.sensor_nodes))]
        assert joint_score(problem, decisions) == pytest.approx(best_assignment(problem).score, abs=1e-7)


@st.composite
def pairwise_trees(draw):
    count = draw(st.integers(2, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    factors = [Factor((v,), rng.random(3) + 0.05) for v in range(count)]
    factors += [Factor((int(rng.integers(v)), v), np.exp(rng.normal(0.0, 1.0, (3, 3)))) for v in range(1, count)]
    return FactorGraph((3,) * count, tuple(factors))


@settings(max_examples=30)
@given(graph=pairwise_trees(), damping=st.floats(0.05, 1.0), seed=st.integers(0, 2**32 - 1))
def test_rewriting_keeps_the_joint_score(graph, damping, seed):
    """Rewritten by vectors drawn at random instead of messages, a tree still has its best state, with its margin.

    On a tree with one spanning tree edges keep the power of one, so nothing but the rewriting itself is at work.
    """
    vertices = {vertex.id: vertex for vertex in vertices_of(graph, "pairwise")}
    members = {
        v: Reparameterized(vertex, dict.fromkeys(vertex.neighbours, 1.0), [1.0]) for v, vertex in vertices.items()
    }
    near = {v: vertex.neighbours for v, vertex in vertices.items()}
    plain = {v: _tree_choice(members, near, v) for v in vertices}
    rng = np.random.default_rng(seed)
    for member in members.values():
        for _ in range(3):
            member.update([{o: rng.normal(size=3) for o in member.vertex.neighbours}], damping)
    best = most_probable(graph)[0]
    for v in vertices:
        choice = _tree_choice(members, near, v)
        assert choice.state == plain[v].state == (best[v],)
        assert choice.margin == pytest.approx(plain[v].margin)


def _tree_choice(members, near, root):
    """The choice of one vertex after messages have come in to it from all over the tree."""
    received = {v: {} for v in members}
    for source, destination in _inward(near, root):
        sent = members[source].message(destination, received[source])
        received[destination][source] = members[destination].arrived(source, sent)
    return members[root].choice(received[root])


def _inward(near, root):
    """Directed edges of a tree towards `root`, the farthest first."""
    order, queue, seen = [], [root], {root}
    for vertex in queue:
        for other in near.get(vertex, ()):
            if other not in seen:
                seen.add(other)
                queue.append(other)
                order.append((other, vertex))
    return order[::-1]


def test_a_tree_is_proved_at_once():
    graph = FactorGraph(
        (2, 2, 2), (Factor((0, 1), np.array([[1.0, 2], [3, 5]])), Factor((1, 2), np.array([[4.0, 1], [1, 2]])))
    )
    (part,) = run_trmp(vertices_of(graph, "pairwise"))
    assert (part.proved, part.iterations, part.messages) == (True, 1, 4)
    assert tuple(part.states[v][0] for v in range(3)) == most_probable(graph)[0]


def test_a_tie_is_not_proved():
    graph = FactorGraph((2, 2), (Factor((0, 1), np.array([[1.0, 0.1], [0.1, 1.0]])),))
    (part,) = run_trmp(vertices_of(graph, "pairwise"), iterations=3)
    assert (part.proved, part.iterations) == (False, 3)


def test_frustration_is_not_proved():
    """An odd cycle of repelling variables: the tree bound is loose, so the trees cannot agree."""
    repel = np.array([[1.0, 5.0], [5.0, 1.0]])
    factors = [Factor(pair, repel) for pair in ((0, 1), (1, 2), (0, 2))] + [Factor((0,), np.array([1.0, 1.01]))]
    (part,) = run_trmp(vertices_of(FactorGraph((2, 2, 2), tuple(factors)), "pairwise"), iterations=50)
    assert not part.proved


def test_components_stop_on_their_own():
    repel = np.array([[1.0, 5.0], [5.0, 1.0]])
    factors = [Factor(pair, repel) for pair in ((0, 1), (1, 2), (0, 2))]
    factors += [Factor((3, 4), np.array([[1.0, 2.0], [3.0, 7.0]])), Factor((5,), np.array([1.0, 2.0]))]
    parts = run_trmp(vertices_of(FactorGraph((2,) * 6, tuple(factors)), "pairwise"), iterations=9)
    assert [(part.vertices, part.proved, part.iterations) for part in parts] == [
        ((0, 1, 2), False, 9),
        ((3, 4), True, 1),
        ((5,), True, 1),
    ]


@given(pairwise_graphs(), st.integers(0, 2**32 - 1))
def test_choice_and_margin_equal_enumeration(graph, seed):
    rng = np.random.default_rng(seed)
    for vertex in vertices_of(graph, "factor"):
        weights = {other: rng.normal(size=vertex.incoming_size(other)) for other in vertex.neighbours}
        choice = vertex.choice(weights)
        sizes = [vertex.incoming_size(other) for other in vertex.neighbours]
        if vertex.id < len(graph.cardinalities):
            scores = {(s,): sum(row[s] for row in weights.values()) for s in range(graph.cardinalities[vertex.id])}
        else:
            factor = graph.factors[vertex.id - len(graph.cardinalities)]
            scores = {
                state: factor.log_table[state]
                + sum(weights[o][x] for o, x in zip(vertex.neighbours, state, strict=True))
                for state in product(*map(range, sizes))
            }
        ranked = sorted(scores.values(), reverse=True)
        assert scores[choice.state] == pytest.approx(ranked[0])
        assert choice.margin == pytest.approx(ranked[0] - ranked[1] if len(ranked) > 1 else np.inf)


def test_agreement_needs_one_clear_state():
    clear, tied, other = Choice((1, 2), 0.5), Choice((1, 2), 0.0), Choice((2, 1), 0.5)
    assert agree([clear, clear], 1e-9)
    assert not agree([clear, tied], 1e-9)
    assert not agree([clear, other], 1e-9)
