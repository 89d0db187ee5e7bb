"""Distributed tree-reweighted max-product against the central kernel and the exact answer."""

from itertools import count

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trmp_runs import ASSOCIATION, COMMON, GRAPH, IDEAL, Keep, simulate

from netsim.algorithms.trmp_messages import (
    Abandon,
    Claim,
    Echo,
    Entry,
    Go,
    Heard,
    Next,
    TreeMessage,
    Verdict,
    Vote,
    Wave,
    decode,
    encode,
)
from netsim.algorithms.trmp_trees import TreeBuilder
from netsim.kernels.assignment import best_assignment
from netsim.kernels.association_graph import graph_vertices
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.graph_model import GraphInstance
from netsim.kernels.trmp import run_trmp
from netsim.trace.events import Association, Marginals, Problem


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
    per_sensor = figures["inference_messages_until_convergence_per_sensor"]
    assert per_sensor == inference / len(instance.sensor_nodes)
    phases = figures["trmp_messages_by_phase_per_sensor"]
    assert phases["inference"] == per_sensor
    assert sum(phases.values()) == pytest.approx(figures["graph_messages_until_convergence_per_sensor"])
    assert figures["map_proved"] == int(all(part.proved for part in results))
    if figures["map_proved"]:
        assert figures["association_differs_from_exact_map"] == 0.0


BETWEEN = [[x, y] for x in (7, 11, 15, 19, 23) for y in (7, 11, 15, 19, 23) if (x + y) % 8 == 2]
"""Midway between neighbours on a grid of nine sensors 8 m apart: each target has two sensors, and the model has loops."""
LOOPS = [
    *COMMON[:-1],
    "nodes[0].placement={type: grid, rows: 3, columns: 3, spacing_m: 8}",
    f"problem.targets={{type: listed, positions_m: {BETWEEN}}}",
    "problem.prior_mean=drawn",
    "problem.false_alarms=geometric",
]


@pytest.mark.parametrize(
    ("model", "schedule", "repetition", "proved"),
    [
        ("sensor", "two_pass", 1, True),
        ("sensor", "flooding", 2, True),
        ("target", "two_pass", 0, True),
        ("target", "flooding", 2, True),
        ("target", "two_pass", 3, False),
    ],
)
def test_vertices_hosted_by_others_equal_the_kernel_and_sensors_are_told(model, schedule, repetition, proved):
    chosen = [f"problem.model={model}", f"algorithm.schedule={schedule}", f"repetition={repetition}"]
    keep, figures = simulate(ASSOCIATION, [*LOOPS, *IDEAL, "algorithm.iterations=30", *chosen])
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    vertices = {vertex.id: vertex for vertex in graph_vertices(instance)}
    (part,) = run_trmp(vertices.values(), forests=forests_of(keep), schedule=schedule, iterations=30)
    (note,) = keep.notes("trmp_component")
    assert note["trees"] > 1
    assert (note["proved"], note["iterations"]) == (part.proved, part.iterations)
    assert part.proved == proved
    assert part.iterations > 1
    assert sum(note["inference"] for note in keep.notes("trmp_messages")) == part.messages
    decided = {event.node: event.target for event in keep.of(Association)}
    claimed = claims_of(instance, vertices, part.states)
    for sensor, node in enumerate(instance.sensor_nodes):
        if not any(len(targets) > 1 for targets in claimed[sensor]):  # two targets may want the same measurement
            assert decided[node] == [targets[0] if targets else -1 for targets in claimed[sensor]]
    assert figures["sensors_that_decided"] == len(decided) == 9
    if proved:
        exact = [decision.tolist() for decision in best_assignment(instance).assignment]
        assert [decided[node] for node in instance.sensor_nodes] == exact


def claims_of(instance, vertices, states):
    """For each measurement of each sensor the targets that it belongs to by the states of the vertices."""
    claimed = [[[] for _ in points] for points in instance.measurements_m]
    for number, state in states.items():
        vertex = vertices[number]
        for (sensor, target), value in zip(vertex.scope, vertex.states[state[0]], strict=True):
            if value:
                claimed[sensor][value - 1].append(target)
    return claimed


@pytest.mark.parametrize("model", ["sensor", "target"])
def test_claims_that_are_lost_are_told_again(model):
    lossy = ["medium={type: ideal, loss_probability: 0.1}", "mac={type: ideal}", "network={type: one-hop}"]
    quick = ["algorithm.stall_s=1", "algorithm.setup_exchange=broadcast", f"problem.model={model}", "repetition=1"]
    keep, figures = simulate(ASSOCIATION, [*LOOPS, *lossy, *quick])
    assert figures["map_proved"] == 1
    assert figures["association_differs_from_exact_map"] == 0.0
    assert len(keep.of(Association)) == 9


@pytest.mark.parametrize("model", ["sensor", "target"])
def test_sensors_are_told_what_is_known_when_time_is_over(model):
    late = ["algorithm.time_limit_s=6.2", f"problem.model={model}", "medium={type: ideal, delay_s: 0.05}"]
    keep, figures = simulate(ASSOCIATION, [*LOOPS, "mac={type: ideal}", "network={type: one-hop}", *late])
    assert figures["map_proved"] == 0
    assert figures["trmp_vertices_unfinished"] > 0
    assert sum(target >= 0 for event in keep.of(Association) for target in event.target) > 9


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
    states = {vertex: state for part in results for vertex, state in part.states.items()}
    last = {event.variable: event for event in keep.of(Marginals)}
    assert sorted(last) == list(range(len(instance.graph.cardinalities)))
    for variable, event in last.items():
        assert event.is_max
        assert sum(event.probability) == pytest.approx(1.0)
        assert (int(np.argmax(event.probability)),) == states[variable]


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
        Abandon(),
    ]
    entries = [Entry(number, number + 1, body) for number, body in enumerate(bodies)]
    assert decode(encode(entries, "float64"), "float64") == entries
    numbers = np.array([0.5, -np.inf, -1.25])
    message = TreeMessage(1, 2, 3, numbers)
    (back,) = decode(encode([Entry(1, 2, message)], "float64"), "float64")
    assert back.body.log_message.tolist() == numbers.tolist()
    assert (back.body.iteration, back.body.tree, back.body.round) == (1, 2, 3)
    rows = {3: np.array([0.25, 0.75]), 1: np.array([1.0])}
    back, heard = decode(encode([Entry(1, 2, Claim(4, rows)), Entry(2, 1, Heard())], "float64"), "float64")
    assert back.body.iteration == 4
    assert {target: row.tolist() for target, row in back.body.rows.items()} == {1: [1.0], 3: [0.25, 0.75]}
    assert heard == Entry(2, 1, Heard())
