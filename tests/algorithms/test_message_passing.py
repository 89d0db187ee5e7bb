"""Distributed message passing against the central kernel, brute force and libDAI's printed figures."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from netsim.algorithms.entries import decode_entries, encode_entries
from netsim.algorithms.message_passing_parameters import rule_of
from netsim.codec import Precision, decode_floats, encode_floats, size_byte
from netsim.kernels.association_graph import graph_vertices
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.factor_graph import exact_marginals
from netsim.kernels.graph_model import GraphInstance
from netsim.kernels.semiring import Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.models.device_tables import load_cpu
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.sim.energy import Entry
from netsim.trace.events import Association, Event, GraphMessages, Marginals, Problem, VariablePlacement

IDEAL = ["medium={type: ideal, delay_s: 0.001}", "mac={type: ideal}", "network={type: one-hop}"]
SEMIRING = {"max-product": Semiring.MAX, "csmp": Semiring.MAX, "sum-product": Semiring.SUM, "cssp": Semiring.SUM}


class Keep:
    """Keeps the events of some kinds."""

    def __init__(self, *kinds: type[Event]) -> None:
        self.kinds = kinds
        self.events: list[Any] = []

    def handlers(self) -> Mapping[type[Event], Any]:
        return dict.fromkeys(self.kinds, lambda event, _: self.events.append(event))

    def of(self, kind: type[Event]) -> list[Any]:
        return [event for event in self.events if type(event) is kind]


def simulate(path: Path, overrides: Sequence[str]) -> tuple[Any, Keep, Any]:
    loaded = load(path, overrides)
    keep = Keep(Problem, Association, Marginals, GraphMessages)
    result = run(loaded, observers=[keep])
    assert not result.failures
    return loaded.scenario.algorithm, keep, result


def sent_by_round(keep: Keep) -> dict[int, set[tuple[int, int]]]:
    rounds: dict[int, set[tuple[int, int]]] = {}
    for event in keep.of(GraphMessages):
        pairs = zip(event.source, event.destination, strict=True)
        rounds.setdefault(event.round, set()).update(pairs)
    return rounds


ADAPTIVE = "csmp, tolerance: adaptive"
FEW = "csmp, damping: 0.3, messages_per_round: 2"


RULES = ["max-product", "sum-product", "csmp", "cssp", ADAPTIVE, FEW]


@pytest.mark.parametrize(("seed", "algorithm"), [*((1, rule) for rule in RULES), (2, "csmp")])
def test_ideal_rounds_send_and_decide_what_the_central_kernel_does(scenarios: Path, seed: int, algorithm: str) -> None:
    overrides = [f"seed={seed}", f"algorithm={{type: {algorithm}, rounds: 6}}", *IDEAL]
    parameters, keep, _ = simulate(scenarios / "chen2006" / "association-csmp.yaml", overrides)
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    vertices = instance_vertices(instance)
    rule, semiring = rule_of(parameters), SEMIRING[algorithm.partition(",")[0]]
    central = run_synchronous(vertices, semiring, 6, rule, stop_when_converged=False)
    assert sent_by_round(keep) == {count.round: set(count.sent) for count in central.rounds}
    changes = {number: 0.0 for number in range(7)}
    for event in keep.of(GraphMessages):
        changes[event.round] = max(changes[event.round], event.largest_change)
    assert changes == {count.round: count.largest_change for count in central.rounds}  # bit for bit
    last = {event.node: event.target for event in keep.of(Association) if event.round == 6}
    for vertex in vertices:
        if isinstance(vertex, SensorVertex):
            decision = vertex.decide(central.incoming[vertex.id], semiring)
            assert last[instance.sensor_nodes[vertex.id]] == decision.tolist()


@pytest.mark.parametrize("form", ["pairwise", "factor"])
@pytest.mark.parametrize("algorithm", ["max-product", "sum-product"])
def test_ideal_beliefs_equal_the_central_kernels_bit_for_bit(scenarios: Path, form: str, algorithm: str) -> None:
    overrides = [f"problem.form={form}", f"algorithm={{type: {algorithm}, rounds: 9}}", *IDEAL]
    parameters, keep, _ = simulate(scenarios / "graphs" / "grid-sum-product.yaml", overrides)
    instance = GraphInstance.from_json(keep.of(Problem)[0].content_json)
    central = run_synchronous(
        instance.vertices(), SEMIRING[algorithm], 9, rule_of(parameters), stop_when_converged=False
    )
    beliefs = {event.variable: event.probability for event in keep.of(Marginals) if event.round == 9}
    assert sorted(beliefs) == list(range(16))
    for variable, belief in beliefs.items():
        assert np.array_equal(belief, np.exp(central.beliefs[variable]))


def test_narrow_payloads_differ_by_little_and_not_by_nothing(scenarios: Path) -> None:
    path = scenarios / "graphs" / "grid-sum-product.yaml"
    exact = simulate(path, IDEAL)[2].metrics["marginals"]
    for payload, most in {"float32": 1e-6, "float16": 1e-2, "uint8": 3e-2}.items():
        narrow = simulate(path, [*IDEAL, f"algorithm.payload={payload}"])[2].metrics["marginals"]
        difference = max(np.abs(np.subtract(exact[name], narrow[name])).max() for name in exact)
        assert 0.0 < difference < most, payload


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), algorithm=st.sampled_from(["max-product", "sum-product"]), data=st.data())
def test_trees_are_exact(scenarios: Path, seed: int, algorithm: str, data: st.DataObject) -> None:
    variables = data.draw(st.integers(1, 7))
    shape = data.draw(st.sampled_from(["chain", "tree"]))
    graph = f"problem.graph={{type: {shape}, variables: {variables}, states: 3}}"
    overrides = [graph, f"seed={seed}", f"algorithm={{type: {algorithm}, rounds: {variables + 1}}}", *IDEAL]
    _, keep, _ = simulate(scenarios / "graphs" / "grid-sum-product.yaml", overrides)
    instance = GraphInstance.from_json(keep.of(Problem)[0].content_json)
    exact = exact_marginals(instance.graph, SEMIRING[algorithm])
    for event in keep.of(Marginals):
        if event.round == variables + 1:
            np.testing.assert_allclose(event.probability, np.exp(exact[event.variable]), rtol=1e-10)


def printed_beliefs(path: Path, method: str) -> dict[int, list[float]]:
    """The beliefs that libDAI printed for one method."""
    beliefs: dict[int, list[float]] = {}
    reading = False
    for line in path.read_text().splitlines():
        if not line.startswith("#"):
            reading = line.split()[:1] == [method]
        elif reading:
            name, _, numbers = line.removeprefix("# ({x").partition("}, (")
            beliefs[int(name)] = [float(number) for number in numbers.rstrip(")").split(", ")]
    return beliefs


@pytest.mark.parametrize("over", ["ideal", "radio"])
def test_libdai_figures_to_the_digits_printed(scenarios: Path, measured_data: Path, over: str, tmp_path: Path) -> None:
    base = (scenarios / "graphs" / "grid-sum-product.yaml").resolve()
    graph = f"{{type: file, path: {measured_data / 'libdai-testfast.fg'}}}"
    rounds = ["algorithm.rounds=60", "algorithm.round_s=2", "duration_s=200"]
    _, _, result = simulate(base, [f"problem.graph={graph}", *rounds, *(IDEAL if over == "ideal" else [])])
    printed = printed_beliefs(measured_data / "libdai-testfast.out", "BP")
    assert len(printed) == 16
    for variable, belief in printed.items():
        mine = result.metrics["marginals"][f"variable {variable}"]
        assert [float(f"{number:.3e}") for number in mine] == belief


@given(
    entries=st.lists(
        st.tuples(
            st.integers(0, 65535),
            st.integers(0, 65535),
            st.lists(st.floats(allow_nan=False) | st.just(-np.inf), max_size=9).map(np.array),
        ),
        max_size=5,
    ),
    number=st.integers(0, 65535),
)
def test_entries_survive_the_air_bit_for_bit(entries: list[tuple[int, int, Any]], number: int) -> None:
    decoded = decode_entries(encode_entries(number, entries, "float64"), "float64")
    assert len(decoded) == len(entries)
    for (round_number, *edge, message), (source, destination, sent) in zip(decoded, entries, strict=True):
        assert round_number == number
        assert edge == [source, destination]
        assert message.tobytes() == sent.astype(float).tobytes()


@pytest.mark.parametrize("payload", ["float64", "float32", "float16", "uint8"])
def test_entries_of_any_precision_follow_each_other(payload: Precision) -> None:
    messages = [np.log([0.2, 0.3, 0.5]), np.array([]), np.array([0.0, -np.inf]), np.array([-1.5] * 4)]
    sent = encode_entries(7, [(number, 9, message) for number, message in enumerate(messages)], payload)
    assert len(sent) == sum(8 + size_byte(len(message), payload) for message in messages)
    for (round_number, source, destination, got), message in zip(decode_entries(sent, payload), messages, strict=True):
        assert (round_number, destination) == (7, 9)
        assert got.tolist() == decode_floats(encode_floats(messages[source], payload), payload).tolist()
        np.testing.assert_allclose(got, message, atol=3e-3)  # half a step over this range is 1.9e-3


def test_an_entry_may_have_more_numbers_than_two_bytes_can_count() -> None:
    messages = [np.linspace(-9.0, 0.0, 70_000), np.array([-0.5])]
    sent = encode_entries(7, [(number, 9, message) for number, message in enumerate(messages)], "float64")
    assert len(sent) == 8 + 4 + 8 * 70_000 + 8 + 8
    for (_, _, _, got), message in zip(decode_entries(sent, "float64"), messages, strict=True):
        assert got.tolist() == message.tolist()


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["{type: max-product, rounds: 2, round_s: 60}", "{type: trmp, time_limit_s: 60}"])
def test_sensors_that_share_many_targets_send_what_they_have(algorithm: str, scenarios: Path) -> None:
    """Some messages between these five have more entries than two bytes can count; no node ends with an error."""
    places = "nodes[0].placement={type: grid, rows: 1, columns: 5, spacing_m: 5}"
    rest = ["problem.targets.count=30", f"algorithm={algorithm}", "duration_s=200"]
    _, keep, _ = simulate(scenarios / "chen2006" / "association-csmp.yaml", [*IDEAL, places, *rest])
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    vertices = graph_vertices(instance)
    assert max(vertex.outgoing_size(other) for vertex in vertices for other in vertex.neighbours) > 65_535
    assert max(sent_by_round(keep)) >= 1


def test_asynchronous_agrees_with_synchronous_on_a_tree(scenarios: Path) -> None:
    graph = "problem.graph={type: tree, variables: 9, states: 2}"
    algorithm = "algorithm={type: cssp, tolerance: 0, schedule: asynchronous, rounds: 30, round_s: 1}"
    _, _, result = simulate(scenarios / "graphs" / "grid-sum-product.yaml", [graph, algorithm, *IDEAL])
    assert result.metrics["marginal_error_linf"] < 1e-10


def test_a_huge_tolerance_leaves_the_start_round_and_the_independent_estimate(scenarios: Path) -> None:
    overrides = ["algorithm.tolerance=1e9", *IDEAL]
    _, keep, result = simulate(scenarios / "chen2006" / "association-csmp.yaml", overrides)
    edges = len(sent_by_round(keep)[0])
    assert result.metrics["graph_messages"] == edges
    assert result.metrics["association_error"] == result.metrics["association_error_independent"]


def test_parameters_are_frozen() -> None:
    from netsim.algorithms.message_passing_parameters import CsmpParameters

    with pytest.raises(dataclasses.FrozenInstanceError):
        CsmpParameters().tolerance = 2.0  # type: ignore[misc]


def test_a_late_old_message_does_not_replace_a_newer_one() -> None:
    from netsim.algorithms.hosted import Hosted
    from netsim.algorithms.hosting import Hosting
    from netsim.algorithms.message_passing_parameters import LAST_ROUND
    from netsim.kernels.communication import CommunicationRule
    from netsim.kernels.pairwise_vertex import PairwiseVertex

    vertex = PairwiseVertex(0, np.zeros(2), {1: np.zeros((2, 2))})
    hosted = Hosted.of(Hosting((vertex,), {0: 0, 1: 1}), CommunicationRule())
    for number, first in ((LAST_ROUND - 1, 1.0), (LAST_ROUND, 2.0), (0, 3.0), (LAST_ROUND, 4.0), (0, 5.0)):
        assert hosted.accept((number, 1, 0, np.array([first, 0.0])))
    assert hosted.incoming[0][1].tolist() == [5.0, 0.0]
    assert not hosted.accept((1, 1, 0, np.zeros(3)))  # of another size


def test_a_slow_processor_is_reported(scenarios: Path) -> None:
    overrides = ["nodes.0.cpu=msp430", "algorithm.rounds=4", "duration_s=600"]
    metrics = simulate(scenarios / "chen2006" / "association-csmp.yaml", overrides)[2].metrics
    assert metrics["rounds_begun_late"] > 0
    assert metrics["round_lateness_max_s"] > 1.0
    quick = simulate(scenarios / "chen2006" / "association-csmp.yaml", ["algorithm.rounds=4"])[2].metrics
    assert quick["rounds_begun_late"] == 0


def test_asynchronous_runs_have_no_rounds(scenarios: Path) -> None:
    path = scenarios / "graphs" / "grid-sum-product.yaml"
    metrics = simulate(path, ["algorithm.schedule=asynchronous", *IDEAL])[2].metrics
    assert "rounds" not in metrics
    assert 0 < metrics["last_news_s"] < metrics["simulated_s"]


@pytest.mark.parametrize(("allowance_j", "rounds"), [(0.26, 1), (0.32, 2)])
def test_a_node_short_of_energy_raises_its_tolerance(allowance_j: float, rounds: int, scenarios: Path) -> None:
    """56.4 mW of listening use 0.26 J up between 4 and 5 s, 0.32 J between 5 and 6 s: before round 1 and round 2."""
    budget = f"nodes[0].budget={{allowance_j: {allowance_j}, policy: warn}}"
    common = [*IDEAL, "seed=2", "algorithm.tolerance=0.01", budget]
    quickstart = scenarios / "quickstart.yaml"
    usual = sent_by_round(simulate(quickstart, common)[1])
    thrifty = sent_by_round(simulate(quickstart, [*common, "algorithm.tolerance_when_short=1000"])[1])
    free = sent_by_round(simulate(quickstart, [*common[:-1], "algorithm.tolerance_when_short=1000"])[1])
    assert free == usual
    assert all(usual[number] for number in (0, 1, 2))
    assert all(thrifty[number] == usual[number] for number in range(rounds))
    assert not any(thrifty[number] for number in thrifty if number >= rounds)


def test_every_round_takes_cpu_time_and_energy(scenarios: Path) -> None:
    """Each node's CPU is active for the operations of its vertices, once a round; whoever listens pays for that too."""
    loaded = load(scenarios / "quickstart.yaml", [*IDEAL, "algorithm.rounds=7"])
    keep = Keep(Problem, VariablePlacement)
    simulation = build(loaded, [keep]).simulation
    simulation.run()
    simulation.conclude()
    (event,) = keep.of(Problem)
    instance = AssociationInstance.from_json(event.content_json)
    vertices = {vertex.id: vertex for vertex in instance_vertices(instance)}
    (placement,) = keep.of(VariablePlacement)
    hosts = dict(zip(placement.variable, placement.host, strict=True))
    cpu = load_cpu("cortex_m4", Path())
    busy = 0
    for number, node in simulation.nodes.items():
        operations = sum(vertex.operations() for vertex in vertices.values() if hosts[vertex.id] == number)
        round_ns = -(-operations * 10**9 // int(cpu.operations_per_s))
        entry = node.parts.account.entries.get(("cpu", "active", ""), Entry())
        busy += round_ns > 0
        assert entry.time_ns == 7 * round_ns
        assert entry.energy_j == pytest.approx(cpu.active_mw * 1e-3 * 7 * round_ns / 1e9, rel=1e-12)
    assert busy >= 5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_two_sensors_find_the_exact_origins_of_their_measurements(scenarios: Path, seed: int) -> None:
    """Their model is a tree; a chain of more sensors has loops where three see a target."""
    two = "nodes=[{name: two, cpu: cortex_m4, placement: {type: grid, rows: 1, columns: 2, spacing_m: 3}}]"
    algorithm = "algorithm={type: sum-product, rounds: 3}"
    overrides = [two, "problem.targets.count=5", f"seed={seed}", algorithm, *IDEAL]
    metrics = simulate(scenarios / "quickstart.yaml", overrides)[2].metrics
    assert len(metrics["marginals"]) == 2
    assert metrics["marginal_error_linf"] < 1e-10
    with_max = simulate(scenarios / "quickstart.yaml", [*overrides, "algorithm.type=max-product"])[2].metrics
    assert "marginals" not in with_max
