"""One vertex of distributed tree-reweighted max-product on its own."""

import numpy as np
import pytest

from netsim.algorithms.trmp_inference import Plan, TreeReweighted
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
