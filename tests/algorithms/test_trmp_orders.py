"""Distributed tree-reweighted max-product under every order of delivery: no deadlock, and only the MAP is proved."""

from itertools import combinations, count, product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from netsim.algorithms.trmp_inference import Plan
from netsim.algorithms.trmp_messages import decode, encode
from netsim.algorithms.trmp_vertex import HostedVertex
from netsim.kernels.factor_graph import Factor, FactorGraph
from netsim.kernels.graph_model import GraphInstance


def drawn(seed, form):
    """A random model of up to five variables, some pairs of states impossible, and the log score of every state."""
    rng = np.random.default_rng(seed)
    variables = int(rng.integers(1, 6))
    pairs = [pair for pair in combinations(range(variables), 2) if rng.random() < 0.6]
    tables = [Factor((v,), np.exp(rng.standard_normal(2))) for v in range(variables)]
    for pair in pairs:
        table = np.exp(2.0 * rng.standard_normal((2, 2)))
        table[tuple(rng.integers(2, size=2))] *= rng.random() < 0.7
        tables.append(Factor(pair, table))
    graph = FactorGraph((2,) * variables, tuple(tables))
    with np.errstate(divide="ignore"):
        logs = [(factor.scope, np.log(factor.table)) for factor in graph.factors]
    scores = {
        state: float(sum(table[tuple(state[v] for v in scope)] for scope, table in logs))
        for state in product(range(2), repeat=variables)
    }
    vertices = GraphInstance(graph, form, (0,) * (variables + len(tables))).vertices()
    return vertices, scores


def settled(vertices, schedule, rng, arrives=lambda entry: True, gives_up=(0, -1)):
    """Deliver what is under way and arrives, in random order and through its bytes, until nothing is.

    The vertex `gives_up[0]` gives up after `gives_up[1]` deliveries.
    """

    def plan(diameters):
        return Plan(rounds=diameters if schedule == "flooding" else None, damping=0.5, iterations=15, margin=1e-9)

    hosted = {vertex.id: HostedVertex(vertex, plan) for vertex in vertices}
    under_way = [entry for each in hosted.values() for entry in each.start()]
    for number in count():
        if number == gives_up[1]:
            under_way += hosted[gives_up[0]].abandon()
        if not under_way:
            return hosted
        entry = under_way.pop(int(rng.integers(len(under_way))))
        if arrives(entry):
            (received,) = decode(encode([entry], "float64"), "float64")
            under_way += hosted[entry.destination].take(received)
    return hosted


def proved(hosted, variables):
    """State of every variable that has a proof, by number."""
    ended = {
        number: each.inference for number, each in hosted.items() if number < variables and each.inference is not None
    }
    judged = {number: inference for number, inference in ended.items() if inference.verdict is not None}
    return {number: inference.choice.state[0] for number, inference in judged.items() if inference.verdict.proved}


@pytest.mark.parametrize("form", ["pairwise", "factor"])
@pytest.mark.parametrize("schedule", ["two_pass", "flooding"])
@given(seed=st.integers(0, 10**6), order=st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_every_order_comes_to_an_end_and_proves_the_map_alone(form, schedule, seed, order):
    vertices, scores = drawn(seed, form)
    best = max(scores, key=scores.__getitem__)
    assume(scores[best] > -np.inf)
    hosted = settled(vertices, schedule, np.random.default_rng(order))
    assert all(each.is_finished and not each.is_abandoned for each in hosted.values())
    assert all(best[number] == state for number, state in proved(hosted, len(best)).items())


@given(seed=st.integers(0, 10**6), order=st.integers(0, 10**6), chance=st.floats(0.8, 1.0))
@settings(max_examples=40, deadline=None)
def test_what_is_proved_though_messages_are_lost_for_good_is_the_map(seed, order, chance):
    """Others may never come to an end, but nobody says anything wrong."""
    vertices, scores = drawn(seed, "pairwise")
    best = max(scores, key=scores.__getitem__)
    assume(scores[best] > -np.inf)
    rng = np.random.default_rng(order)
    hosted = settled(vertices, "two_pass", rng, lambda _: rng.random() < chance)
    assert all(best[number] == state for number, state in proved(hosted, len(best)).items())


@given(seed=st.integers(0, 10**6), order=st.integers(0, 10**6), late=st.integers(0, 200))
@settings(max_examples=40, deadline=None)
def test_giving_up_at_any_time_reaches_everybody_and_leaves_what_was_proved(seed, order, late):
    vertices, scores = drawn(seed, "pairwise")
    best = max(scores, key=scores.__getitem__)
    assume(scores[best] > -np.inf)
    hosted = settled(vertices, "two_pass", np.random.default_rng(order), gives_up=(0, late))
    assert all(each.is_finished for each in hosted.values())
    assert all(best[number] == state for number, state in proved(hosted, len(best)).items())
