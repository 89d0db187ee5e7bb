"""Vertices of target-distribution estimation against listing all states, and their laws."""

import numpy as np
import pytest
from counting_oracle import exact, instance
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.central import run_synchronous
from netsim.kernels.counting_exact import exact_counts
from netsim.kernels.counting_model import hosted_vertices, instance_vertices
from netsim.kernels.counting_vertex import CountingVertex, convolve
from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.semiring import Semiring
from netsim.kernels.target_distribution import DistributionInstance

log_weights = st.lists(st.floats(-8.0, 0.0), min_size=1, max_size=5).map(np.array)
READING = st.floats(-2.0, 6.0)


def beliefs(problem, semiring=Semiring.SUM, rounds=40):
    result = run_synchronous(instance_vertices(problem), semiring, rounds)
    return [result.beliefs[region.vertex] for region in problem.subregions]


@pytest.mark.parametrize(("semiring", "combine"), [(Semiring.SUM, sum), (Semiring.MAX, max)])
@pytest.mark.parametrize("sets", [[(0,), (0, 1)], [(0,), (0, 1), (1,)], [(0, 1, 2), (2,)]])
@settings(max_examples=4, deadline=None)
@given(readings=st.tuples(READING, READING, READING))
def test_exact_on_trees(semiring, combine, sets, readings):
    sensors = 1 + max(max(covering) for covering in sets)
    problem = instance(sets, readings[:sensors], [(0, 1), (1, 2), (0, 1)])
    for found, right in zip(beliefs(problem, semiring), exact(problem, combine), strict=True):
        np.testing.assert_allclose(found, right, rtol=1e-10, atol=1e-10)


@settings(max_examples=40, deadline=None)
@given(data=st.data(), semiring=st.sampled_from(Semiring), count=st.integers(1, 4))
def test_messages_equal_those_of_the_full_table(data, semiring, count):
    """The sensor's vertex against a factor that lists its states, its edges carried by hand."""
    sizes = [(data.draw(st.integers(1, 4)), data.draw(st.integers(1, 3))) for _ in range(count)]
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    edges = {neighbour: rng.normal(size=size) for neighbour, size in enumerate(sizes, start=1)}
    reading = rng.normal(scale=3.0, size=1 + sum(z - 1 for z, _ in sizes))
    incoming = {neighbour: np.log(rng.dirichlet(np.ones(z))) for neighbour, (z, _) in enumerate(sizes, start=1)}
    totals = np.indices([z for z, _ in sizes]).sum(axis=0)
    listed = FactorVertex(0, sorted(edges), reading[totals]).outgoing(incoming, semiring)
    found = CountingVertex(0, edges, reading).outgoing(incoming, semiring)
    for neighbour, edge in edges.items():
        joint = edge + listed[neighbour][:, None]
        right = joint.max(axis=0) if semiring is Semiring.MAX else np.log(np.exp(joint).sum(axis=0))
        right = right - np.log(np.exp(right).sum())
        np.testing.assert_allclose(found[neighbour], right, rtol=1e-10, atol=1e-10)


@given(first=log_weights, second=log_weights)
def test_convolution_is_numpys(first, second):
    right = np.log(np.convolve(np.exp(first), np.exp(second)))
    np.testing.assert_allclose(convolve(first, second, Semiring.SUM), right, rtol=1e-10, atol=1e-10)


@settings(max_examples=10, deadline=None)
@given(readings=st.lists(READING, min_size=4, max_size=4), order=st.permutations(range(4)))
def test_permuting_sensors_permutes_nothing_else(readings, order):
    """Sensors renumbered, and subregions with them: each subregion's marginal stays."""
    sets = [(0, 1), (1, 2), (2, 3), (0, 3), (1,), (0, 1, 2)]
    renamed = [tuple(sorted(order[sensor] for sensor in covering)) for covering in sets]
    turned = [readings[order.index(sensor)] for sensor in range(4)]
    for one, other in zip(beliefs(instance(sets, readings)), beliefs(instance(renamed, turned)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_far_reading_leaves_the_extreme_state():
    """A reading that no total explains (a fault) neither underflows nor contradicts the model."""
    (found,) = beliefs(instance([(0,)], [1e4]))
    assert np.isfinite(found).all()
    assert found.argmax() == 2


def test_unread_sensor_tells_nothing():
    """Its messages are uniform: whatever the count, some number of detections follows."""
    sensor, *_ = hosted_vertices(instance([(0,), (0, 1)], [0.0, 0.0]).knowledge(0), None)
    for message in sensor.outgoing({}, Semiring.SUM).values():
        np.testing.assert_allclose(message, np.log([1 / 3, 1 / 3, 1 / 3]))


def test_instance_survives_json():
    problem = instance([(0,), (0, 1)], [0.1, 1.0 / 3.0])
    again = DistributionInstance.from_json(problem.to_json())
    assert again.subregions == problem.subregions
    assert again.readings.tolist() == problem.readings.tolist()
    assert again.model == problem.model
    assert again.sensor_nodes == problem.sensor_nodes


@settings(max_examples=5, deadline=None)
@given(readings=st.tuples(READING, READING, READING))
def test_elimination_equals_listing_on_a_graph_with_cycles(readings):
    problem = instance([(0, 1), (0, 1), (1,)], readings[:2], [(0, 1), (1, 2), (0, 1)])
    for found, right in zip(exact_counts(problem), exact(problem), strict=True):
        np.testing.assert_allclose(found, right, rtol=1e-10, atol=1e-10)


def test_sensor_that_covers_too_much_is_refused_with_its_size():
    problem = instance([(0,)] * 14, [3.0])
    with pytest.raises(ScenarioError, match=r"sensor 0 needs a table of [\d,]+ entries"):
        exact_counts(problem)
