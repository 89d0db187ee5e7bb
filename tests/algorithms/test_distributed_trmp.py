"""Distributed tree-reweighted max-product against the central kernel and the exact answer."""

import json
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.algorithms.trmp_messages import Echo, Entry, Go, Next, TreeMessage, Verdict, Vote, Wave, decode, encode
from netsim.algorithms.trmp_trees import TreeBuilder
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.graph_model import GraphInstance
from netsim.kernels.trmp import run_trmp
from netsim.metrics.collect import Metrics
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import AlgorithmRecord, Association, Event, Problem

ASSOCIATION = Path("scenarios/chen2006/association-csmp.yaml")
GRAPH = Path("scenarios/graphs/grid-sum-product.yaml")
COMMON = ["duration_s=2000", "algorithm={type: trmp}", "problem.variance=total", "problem.targets.count=17"]
IDEAL = ["fidelity=ideal"]


class Keep:
    """Keeps the events of some kinds."""

    def __init__(self, *kinds: type[Event]) -> None:
        self.kinds = kinds
        self.events: list[Any] = []

    def handlers(self) -> Mapping[type[Event], Any]:
        return dict.fromkeys(self.kinds, lambda event, _: self.events.append(event))

    def of(self, kind: type[Event]) -> list[Any]:
        return [event for event in self.events if type(event) is kind]

    def notes(self, kind: str) -> list[dict[str, Any]]:
        return [json.loads(e.fields_json) for e in self.of(AlgorithmRecord) if e.kind == kind]


def simulate(path: Path, overrides: list[str]) -> tuple[Keep, dict[str, Any]]:
    keep, metrics = Keep(Problem, Association, AlgorithmRecord), Metrics()
    result = run(load(path, overrides), observers=[keep, *metrics.observers])
    assert not result.failures
    return keep, metrics.figures()


def forests_of(keep: Keep) -> list[frozenset[tuple[int, int]]]:
    """The trees that grew in the network."""
    parents = {note["vertex"]: note["parents"] for note in keep.notes("trmp_parents")}
    most = max(len(row) for row in parents.values())
    return [
        frozenset((min(v, row[k]), max(v, row[k])) for v, row in parents.items() if len(row) > k and row[k] is not None)
        for k in range(most)
    ]


@pytest.mark.parametrize("schedule", ["two_pass", "flooding"])
def test_a_run_equals_the_kernel_on_the_trees_that_grew(schedule):
    keep, figures = simulate(ASSOCIATION, [*COMMON, *IDEAL, f"algorithm.schedule={schedule}", "repetition=3"])
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    results = run_trmp(instance_vertices(instance), forests=forests_of(keep), schedule=schedule)
    notes = {note["root"]: note for note in keep.notes("trmp_component")}
    for part in results:
        (note,) = (note for root, note in notes.items() if root in part.vertices)
        assert (note["proved"], note["iterations"]) == (part.proved, part.iterations)
        assert note["vertices"] == len(part.vertices)
    states = {v: state for part in results for v, state in part.states.items()}
    decided = {event.node: tuple(event.target) for event in keep.of(Association)}
    assert decided == {node: states[sensor] for sensor, node in enumerate(instance.sensor_nodes)}
    inference = sum(note["inference"] for note in keep.notes("trmp_messages"))
    assert inference == sum(part.messages for part in results)
    assert figures["map_proved"] == int(all(part.proved for part in results))
    if figures["map_proved"]:
        assert figures["association_differs_from_exact_map"] == 0.0


def test_what_is_lost_is_asked_for():
    lossy = ["medium={type: ideal, loss_probability: 0.05}", "mac={type: ideal}", "network={type: one-hop}"]
    small = ["problem.targets.count=8", "algorithm.stall_s=1", "algorithm.setup_exchange=broadcast"]
    _, figures = simulate(ASSOCIATION, [*COMMON, *lossy, *small])
    assert figures["map_proved"] == 1
    assert figures["radio_messages_by_kind"]["trmp-repeat"] > 0


def test_a_variable_model_with_its_marginals():
    keep, figures = simulate(GRAPH, ["duration_s=2000", "algorithm={type: trmp}", *IDEAL])
    instance = GraphInstance.from_json(keep.of(Problem)[0].content_json)
    results = run_trmp(instance.vertices(), forests=forests_of(keep))
    assert figures["map_proved"] == int(all(part.proved for part in results))


def test_time_over_is_not_proved():
    _, figures = simulate(ASSOCIATION, [*COMMON, *IDEAL, "algorithm.time_limit_s=6.2"])
    assert figures["map_proved"] == 0
    assert figures["trmp_vertices_unfinished"] > 0


EDGES = st.sets(st.tuples(st.integers(0, 8), st.integers(0, 8)).filter(lambda e: e[0] < e[1]), min_size=1, max_size=20)


@given(edges=EDGES, seed=st.integers(0, 2**32 - 1), in_order=st.booleans())
def test_trees_span_and_cover_in_whatever_order_messages_come(edges, seed, in_order):
    graph = nx.Graph(edges)
    builders = {v: TreeBuilder(v, tuple(sorted(graph[v]))) for v in graph}
    rng, number = np.random.default_rng(seed), count()
    queue = [(next(number), entry) for v in graph for entry in builders[v].start()]
    steps = 0
    while queue:
        queue.sort(key=lambda item: (item[1].is_held, item[0] if in_order else rng.random()))
        _, entry = queue.pop(0)
        queue += [(next(number), new) for new in builders[entry.destination].take(entry.source, entry.body)]
        steps += 1
        assert steps < 20_000
    assert all(builder.is_done for builder in builders.values())
    for component in nx.connected_components(graph):
        part = graph.subgraph(component)
        depth = {len(builders[v].places) for v in component}
        assert len(depth) == 1
        covered = set()
        for k in range(depth.pop()):
            tree = {(v, p) for v in component if (p := builders[v].places[k].parent) is not None}
            assert nx.is_tree(nx.Graph(tree))
            assert all(v in builders[p].places[k].children for v, p in tree)
            assert builders[min(component)].diameters[k] == nx.diameter(nx.Graph(tree))
            covered |= {(min(pair), max(pair)) for pair in tree}
        assert covered == {(min(pair), max(pair)) for pair in part.edges}


def test_entries_survive_the_wire():
    bodies = [
        Wave(0, 7, None),
        Wave(3, 9, Echo(5, 4, 3, 2, 1, 6)),
        Next(12, (3, 4)),
        Go((3, 4, 5)),
        Vote(6, True),
        Verdict(7, False, True),
    ]
    entries = [Entry(number, number + 1, body) for number, body in enumerate(bodies)]
    assert decode(encode(entries, "float64"), "float64") == entries
    numbers = np.array([0.5, -np.inf, -1.25])
    message = TreeMessage(1, 2, 3, numbers)
    (back,) = decode(encode([Entry(1, 2, message)], "float64"), "float64")
    assert back.body.log_message.tolist() == numbers.tolist()
    assert (back.body.iteration, back.body.tree, back.body.round) == (1, 2, 3)
