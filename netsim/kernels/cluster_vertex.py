"""The sensor-oriented model of data association (Chen et al. 2006, section 3.2.1, eqs 7-10).

One variable a sensor: the association of all its measurements. A target that three or more sensors cover would make a
clique of them; the paper merges the members into one variable. Clusters are the connected components of such covers, so
that between two of them there are only targets of two sensors, one in each, and the model is pairwise.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from math import prod

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_model import AssociationKnowledge, Cluster, CoveredTarget
from netsim.kernels.association_vertices import (
    Measured,
    detection_log_weights,
    evidence,
    false_alarm_log_weights,
)
from netsim.kernels.injections import IntArray, check_states, count_injections, injections
from netsim.kernels.listed_vertex import ClassEdge, Classes, ListedVertex, Pair
from netsim.kernels.semiring import FloatArray

CLUSTER_STATE_LIMIT = 1_000_000
"""Most joint associations of a cluster: they are listed, with a few numbers for each."""


def check_cluster(nodes: Sequence[int], covered: Sequence[int], measurements: Sequence[int]) -> None:
    """Refuse a cluster with too many joint associations.

    Args:
        nodes: The nodes of its sensors.
        covered: How many targets each covers.
        measurements: How many measurements each has.

    Raises:
        ScenarioError: With the number of joint associations.
    """
    states = prod(count_injections(targets, count) for targets, count in zip(covered, measurements, strict=True))
    if states > CLUSTER_STATE_LIMIT:
        who = (
            f"the sensor of node {nodes[0]}"
            if len(nodes) == 1
            else f"the sensors of nodes {', '.join(map(str, nodes))}"
        )
        text = (
            f"model: sensor: {who} would be one variable of {states:.3g} joint associations, more than the "
            f"{CLUSTER_STATE_LIMIT} supported: set model: hybrid, or use fewer targets"
        )
        raise ScenarioError(text)


def cluster_vertices(knowledge: AssociationKnowledge, measured: Measured) -> list[ListedVertex]:
    """The vertex of the cluster that a node hosts; none where another node hosts it.

    Args:
        knowledge: What the node knows.
        measured: Measurements of its own sensor and of all its partners.

    Raises:
        ScenarioError: When there are too many states.
    """
    own = next(cluster for cluster in knowledge.clusters if knowledge.sensor in cluster.sensors)
    if own.host != knowledge.node:
        return []
    every = sorted((*knowledge.targets, *knowledge.wider), key=lambda covered: covered.target)
    scope = tuple((sensor, each.target) for sensor in own.sensors for each in every if sensor in each.sensors)
    check_cluster(
        [knowledge.sensor_nodes[sensor] for sensor in own.sensors],
        [knowledge.covered[sensor] for sensor in own.sensors],
        [len(measured[sensor]) for sensor in own.sensors],
    )
    states, node = _listed(knowledge, own, measured)
    place = {pair: column for column, pair in enumerate(scope)}
    for each in every:
        if set(each.sensors) <= set(own.sensors):
            table = evidence(knowledge.model, each, [measured[sensor] for sensor in each.sensors])
            node = node + table[tuple(states[:, place[sensor, each.target]] for sensor in each.sensors)]
    edges = {
        other.vertex: _edge(knowledge, own, other, every, place, states, measured)
        for other in knowledge.clusters
        if other is not own
    }
    sizes = tuple(len(measured[sensor]) + 1 for sensor, _ in scope)
    return [ListedVertex(own.vertex, scope, states, node, edges, sizes)]


def _listed(knowledge: AssociationKnowledge, own: Cluster, measured: Measured) -> tuple[IntArray, FloatArray]:
    """All joint associations, and their log weight by detections and false alarms; the last sensor varies fastest."""
    states, node = np.zeros((1, 0), dtype=np.int64), np.zeros(1)
    for sensor in own.sensors:
        targets, count = knowledge.covered[sensor], len(measured[sensor])
        each = injections(targets, count)
        weight = detection_log_weights(knowledge.model, targets)[each.used]
        weight = weight + false_alarm_log_weights(knowledge.model, count)[count - each.used]
        before, after = np.divmod(np.arange(len(states) * len(each.states)), len(each.states))
        states, node = np.hstack([states[before], each.states[after]]), node[before] + weight[after]
    return states, node


def _edge(
    knowledge: AssociationKnowledge,
    own: Cluster,
    other: Cluster,
    every: Sequence[CoveredTarget],
    place: Mapping[Pair, int],
    states: IntArray,
    measured: Measured,
) -> ClassEdge:
    """Eq (9): evidence of the targets that a sensor here and one there share."""
    shared = [c for c in every if set(c.sensors) & set(own.sensors) and set(c.sensors) & set(other.sensors)]
    here = [next(sensor for sensor in covered.sensors if sensor in own.sensors) for covered in shared]
    there = [next(sensor for sensor in covered.sensors if sensor in other.sensors) for covered in shared]
    tables = tuple(
        evidence(knowledge.model, covered, [measured[first], measured[second]])
        for covered, first, second in zip(shared, here, there, strict=True)
    )
    mine, theirs = _classes(here, measured), _classes(there, measured)
    check_states(len(mine.cells) * max(theirs.grid), f"the compatibility of clusters {own.vertex} and {other.vertex}")
    columns = [place[sensor, covered.target] for sensor, covered in zip(here, shared, strict=True)]
    multiplicity = _multiplicity(knowledge, there, theirs, measured)
    return ClassEdge(mine, theirs, tables, False, mine.of(states[:, columns]), multiplicity)


def _classes(sensors: Sequence[int], measured: Measured) -> Classes:
    """Values of shared targets at these sensors, no measurement of a sensor twice."""
    grid = tuple(len(measured[sensor]) + 1 for sensor in sensors)
    check_states(prod(grid), "the joint association of targets shared by two clusters")
    values = np.indices(grid).reshape(len(grid), -1)
    possible = np.ones(values.shape[1], bool)
    for second, first in product(range(len(grid)), repeat=2):
        if first < second and sensors[first] == sensors[second]:
            possible &= (values[first] != values[second]) | (values[first] == 0)
    return Classes(grid, np.flatnonzero(possible))


def _multiplicity(
    knowledge: AssociationKnowledge, there: Sequence[int], classes: Classes, measured: Measured
) -> FloatArray:
    """Ways in which the sensors there that share a target can associate the rest of their measurements."""
    values = np.array(np.unravel_index(classes.cells, classes.grid))
    total = np.ones(len(classes.cells))
    for sensor in sorted(set(there)):
        rows = [row for row, owner in enumerate(there) if owner == sensor]
        left, count = knowledge.covered[sensor] - len(rows), len(measured[sensor])
        ways = np.array(
            [count_injections(left, count - used) for used in range(min(len(rows), count) + 1)], dtype=float
        )
        total *= ways[(values[rows] > 0).sum(axis=0)]
    return total
