"""One vertex of distributed tree-reweighted max-product on its own."""

import numpy as np
import pytest

from netsim.algorithms.trmp_inference import Plan, TreeReweighted
from netsim.algorithms.trmp_messages import Echo, Entry, TreeMessage, Wave, decode, encode
from netsim.algorithms.trmp_trees import TreeBuilder
from netsim.kernels.factor_graph import Factor, FactorGraph
from netsim.kernels.graph_model import GraphInstance
from netsim.kernels.trmp import run_trmp


@pytest.mark.parametrize(("weights", "proved"), [([1.0, 1.0], False), ([1.0, 2.0], True)])
def test_a_vertex_without_neighbours_decides_at_once(weights, proved):
    """A tie stays a tie: more iterations, and there may be 65,535, change nothing."""
    graph = FactorGraph((2,), (Factor((0,), np.array(weights)),))
    (vertex,) = GraphInstance(graph, "pairwise", (0,)).vertices()
    builder = TreeBuilder(vertex.id, vertex.neighbours)
    assert builder.start() == []
    plan = Plan(rounds=None, damping=0.5, iterations=65_535, margin=1e-9)
    inference = TreeReweighted(vertex, builder.places, plan)
    assert inference.begin() == []
    assert inference.verdict.stop
    (central,) = run_trmp([vertex], iterations=65_535)
    assert (inference.verdict.proved, inference.iteration) == (central.proved, central.iterations) == (proved, 1)


@pytest.mark.parametrize("entries", [3, 65_534, 65_535, 70_000])
def test_messages_of_any_size_follow_each_other(entries):
    """What is charged is what is sent: two bytes say how many entries, from 65,535 on six."""
    message = TreeMessage(7, 2, 0, np.arange(entries, dtype=float))
    sent = encode([Entry(4, 5, message), Entry(5, 4, Wave(1, 2, None))], "float32")
    first, second = decode(sent, "float32")
    assert len(sent) == 10 + (2 if entries < 65_535 else 6) + 4 * entries + 10
    assert (first.source, first.destination, first.body.iteration, first.body.tree) == (4, 5, 7, 2)
    assert first.body.log_message.tolist() == message.log_message.tolist()
    assert second == Entry(5, 4, Wave(1, 2, None))


@pytest.mark.parametrize("uncovered", [12, 90_000])
def test_an_answer_tells_of_any_number_of_edges(uncovered):
    entry = Entry(1, 2, Wave(3, 1, Echo(40_000, uncovered, 9, 17, 12, 20)))
    sent = encode([entry], "float64")
    assert decode(sent, "float64") == [entry]
    assert len(sent) == 10 + 12 + (4 if uncovered > 65_534 else 0)
