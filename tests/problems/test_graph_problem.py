"""Graphical models as problems: drawn or read, placed, and known piece by piece."""

import networkx as nx
import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from netsim.errors import ScenarioError
from netsim.kernels.graph_model import GraphInstance
from netsim.kernels.semiring import Semiring
from netsim.problems.drawn_graphs import ChainGraph, GridGraph, TreeGraph, draw_graph
from netsim.problems.graph import GraphFile, GraphParameters, build
from netsim.rng import Streams

UAI = "MARKOV\n3\n2 2 2\n2\n2 2 1\n1 0\n4\n1 2 3 4\n2\n1 3\n"


def edges(graph):
    return nx.Graph([factor.scope for factor in graph.factors if len(factor.scope) == 2])


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (ChainGraph(variables=7), nx.path_graph(7)),
        (GridGraph(rows=3, columns=4), nx.convert_node_labels_to_integers(nx.grid_2d_graph(3, 4))),
    ],
)
def test_drawn_shapes(shape, expected):
    graph = draw_graph(shape, np.random.default_rng(1))
    assert set(map(frozenset, edges(graph).edges)) == set(map(frozenset, expected.edges))
    assert sum(len(factor.scope) == 1 for factor in graph.factors) == len(graph.cardinalities)


@pytest.mark.parametrize("variables", [1, 2, 30])
def test_trees_are_trees(variables):
    graph = draw_graph(TreeGraph(variables=variables, states=3), np.random.default_rng(2))
    drawn = edges(graph)
    drawn.add_nodes_from(range(variables))
    assert nx.is_tree(drawn)
    assert graph.cardinalities == (3,) * variables


def test_strengths_are_standard_deviations_of_log_potentials():
    shape = GridGraph(rows=20, columns=20, states=3, coupling_sd=0.5, field_sd=2.0)
    graph = draw_graph(shape, np.random.default_rng(3))
    for arity, sd in ((1, 2.0), (2, 0.5)):
        logs = np.concatenate([np.log(f.table).ravel() for f in graph.factors if len(f.scope) == arity])
        assert logs.std() == pytest.approx(sd, rel=0.1)


@pytest.mark.parametrize(("placement", "hosts"), [("round_robin", (4, 7, 4, 7, 4)), ("contiguous", (4, 4, 4, 7, 7))])
def test_placement(placement, hosts):
    problem = build(
        GraphParameters(graph=ChainGraph(variables=5), placement=placement, form="pairwise"), [7, 4], Streams(1)
    )
    assert problem.instance.hosts == hosts
    event = problem.placement_event()
    assert list(event.host) == list(hosts)
    assert list(zip(event.edge_a, event.edge_b, strict=True)) == [(0, 1), (1, 2), (2, 3), (3, 4)]


def test_factors_live_with_their_first_variable():
    problem = build(GraphParameters(graph=GraphFile(path="a.uai")), [0, 1, 2], Streams(1), UAI)
    assert problem.instance.hosts == (0, 1, 2, 2, 0)
    event = problem.placement_event()
    assert list(event.name) == ["variable 0", "variable 1", "variable 2", "factor 0", "factor 1"]
    assert list(zip(event.edge_a, event.edge_b, strict=True)) == [(0, 4), (1, 3), (2, 3)]


@pytest.mark.parametrize("form", ["pairwise", "factor"])
def test_nodes_together_know_the_model(form):
    """Every vertex is known to its host alone, acts as the central one, and knows where its neighbours live."""
    problem = build(GraphParameters(form=form), list(range(6)), Streams(1))
    central = {vertex.id: vertex for vertex in problem.instance.vertices()}
    seen = []
    for node in range(6):
        knowledge = problem.knowledge(node)
        for vertex in knowledge.vertices:
            seen.append(vertex.id)
            expected = central[vertex.id].outgoing({}, Semiring.SUM)
            for other, message in vertex.outgoing({}, Semiring.SUM).items():
                assert message.tobytes() == expected[other].tobytes()
                assert knowledge.hosts[other] == problem.instance.hosts[other]
    assert sorted(seen) == sorted(central)
    assert problem.knowledge(77).vertices == ()


def test_instances_survive_json_bit_for_bit():
    problem = build(GraphParameters(), [3, 1], Streams(1))
    again = GraphInstance.from_json(problem.instance_json())
    assert again.to_json() == problem.instance_json()
    for a, b in zip(again.graph.factors, problem.instance.graph.factors, strict=True):
        assert a.table.tobytes() == b.table.tobytes()
    assert (again.form, again.hosts) == (problem.instance.form, problem.instance.hosts)


def test_seeds_decide():
    texts = [build(GraphParameters(), [0], Streams(seed)).instance_json() for seed in (1, 1, 2)]
    assert texts[0] == texts[1] != texts[2]


@pytest.mark.parametrize(
    ("parameters", "nodes", "text", "message"),
    [
        (GraphParameters(), [], None, "at least one node"),
        (GraphParameters(graph=GraphFile(path="a.uai")), [0], None, "was not given"),
        (GraphParameters(graph=GraphFile(path="a.txt")), [0], "", ".uai or .fg"),
        (GraphParameters(graph=GraphFile(path="a.uai")), [0], "BAYES", "a.uai:1"),
        (GraphParameters(graph=GraphFile(path="a.fg")), [0], "x", "a.fg:1"),
        (
            GraphParameters(graph=GraphFile(path="a.uai"), form="pairwise"),
            [0],
            "MARKOV 3 1 1 1 1 3 0 1 2 1 1.0",
            "at most 2",
        ),
    ],
)
def test_what_cannot_be_built_is_refused(parameters, nodes, text, message):
    with pytest.raises(ScenarioError, match=message):
        build(parameters, nodes, Streams(1), text)


def test_nothing_to_observe_and_no_truth():
    problem = build(GraphParameters(), [0], Streams(1))
    assert problem.truth_events() == ()
    with pytest.raises(ScenarioError, match="nothing to observe"):
        problem.observe(0, 0)


def test_parameters_are_checked_by_the_schema():
    schema = TypeAdapter(GraphParameters)
    made = schema.validate_python({"graph": {"type": "tree", "variables": 4}, "placement": "contiguous"})
    assert made == GraphParameters(graph=TreeGraph(variables=4), placement="contiguous")
    with pytest.raises(ValidationError):
        schema.validate_python({"graph": {"type": "chain", "states": 1}})


def test_a_model_without_a_possible_state_is_refused() -> None:
    text = "MARKOV\n1\n2\n1\n1 0\n2\n 0 0\n"
    with pytest.raises(ScenarioError, match="factor 0 has no value above 0"):
        build(GraphParameters(graph=GraphFile(path="z.uai")), [0, 1], Streams(1), text)
