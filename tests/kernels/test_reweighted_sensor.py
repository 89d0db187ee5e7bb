"""A sensor's reweighted messages and choice against the same sensor with every association written out."""

import association_oracle as oracle
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.injections import injections

# Sensor 0 shares two targets with sensor 1 and one with 2, sees one together with both, and one alone.
COVERAGE = [(0, 1), (0, 1), (0, 1, 2), (0, 2), (0,)]
SHARED = {1: (0, 1), 2: (3,)}
"""Targets behind the edges of sensor 0 to other sensors; its third neighbour is the vertex of target 2, number 3 + 2."""
TARGET, TARGET_VERTEX = 2, 5


@st.composite
def problems(draw):
    counts = [draw(st.integers(1, 4)), draw(st.integers(0, 3)), draw(st.integers(0, 3))]
    false_alarms = draw(st.sampled_from(["strict", "geometric"]))
    return oracle.instance(COVERAGE, counts, draw(st.integers(0, 2**32 - 1)), oracle.model(false_alarms))


def entries(problem, sensor, neighbour):
    """For each association of a sensor written out, its place in a message that tells of the targets behind an edge."""
    targets = SHARED.get(neighbour, (TARGET,))
    columns = [problem.targets_of[sensor].index(target) for target in targets]
    known = injections(len(targets), len(problem.measurements_m[sensor])).states.tolist()
    return [known.index([state[column] for column in columns]) for state in oracle.sensor_states(problem)[sensor]]


def drawn_weights(problem, vertex, seed):
    """Random weights with some states ruled out (never "missed"), as the vertex takes them and on every association."""
    rng = np.random.default_rng(seed)
    weights, spread = {}, {}
    for neighbour in vertex.neighbours:
        row = rng.normal(0.0, 2.0, vertex.incoming_size(neighbour))
        row[1:][rng.random(len(row) - 1) < 0.2] = -np.inf
        weights[neighbour] = row
        spread[neighbour] = row[entries(problem, 0, neighbour)]
    return weights, spread


def pair(problem):
    """Sensor 0 as it is, and written out state by state."""
    full = {vertex.id: vertex for vertex in oracle.full_state_vertices(problem)}
    return instance_vertices(problem)[0], full[0]


def is_possible(full, spread):
    """Whether any association is left; also of the measurements alone, which `strict` may not explain."""
    try:
        return full.choice(spread).state is not None
    except ScenarioError:
        return False


@settings(max_examples=60)
@given(problems(), st.integers(0, 2**32 - 1), st.floats(1.0, 5.0))
def test_messages_equal_those_of_all_associations(problem, seed, exponent):
    vertex, full = pair(problem)
    weights, spread = drawn_weights(problem, vertex, seed)
    assume(is_possible(full, spread))
    assert vertex.neighbours == full.neighbours == (1, 2, TARGET_VERTEX)
    for neighbour in vertex.neighbours:
        found = vertex.reweighted(neighbour, weights, exponent)
        expected = full.reweighted(neighbour, spread, exponent)
        if neighbour == TARGET_VERTEX:
            shape = [len(points) + 1 for points in problem.measurements_m]
            place = np.indices(shape)[0].ravel()
        else:
            place = entries(problem, neighbour, neighbour)  # the same targets, at the other end
        np.testing.assert_allclose((found - found.max())[place], expected - expected.max(), rtol=1e-9, atol=1e-9)


@settings(max_examples=60)
@given(problems(), st.integers(0, 2**32 - 1))
def test_the_choice_and_its_margin_equal_those_of_all_associations(problem, seed):
    vertex, full = pair(problem)
    weights, spread = drawn_weights(problem, vertex, seed)
    assume(is_possible(full, spread))
    found, expected = vertex.choice(weights), full.choice(spread)
    state = oracle.sensor_states(problem)[0][expected.state[0]]
    decision = [-1] * len(problem.measurements_m[0])
    for target, measurement in zip(problem.targets_of[0], state, strict=True):
        if measurement:
            decision[measurement - 1] = target
    assert found.margin == pytest.approx(expected.margin, abs=1e-9)
    if expected.margin > 1e-9:
        assert found.state == tuple(decision)
