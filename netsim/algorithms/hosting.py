"""How a node comes to the vertices it hosts: from its knowledge, its own sensor and its partners' measurements."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.codec import FloatWidth, Precision, decode_floats, encode_floats, float_width
from netsim.errors import AlgorithmError
from netsim.kernels import counting_model
from netsim.kernels.association_graph import model_vertices
from netsim.kernels.association_model import AssociationKnowledge
from netsim.kernels.graph_model import GraphKnowledge
from netsim.kernels.listed_vertex import ListedVertex
from netsim.kernels.semiring import FloatArray
from netsim.kernels.target_distribution import DistributionKnowledge
from netsim.kernels.vertex import Vertex
from netsim.protocols.exchange import Manner, ask_again, exchange

OBSERVATIONS = "observations"


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """What a node of a data-association problem knows once measurements are exchanged.

    Attributes:
        knowledge: What it knew before.
        own_m: Its own measurements, shape (q, 2).
        others_m: Those of its partners, by sensor.
        lacking: Sensors that are taken to have measured nothing because nothing is known of it: partners that were not
            heard, and the node's own sensor where its energy allowance refused the reading.
    """

    knowledge: AssociationKnowledge
    own_m: FloatArray
    others_m: Mapping[int, FloatArray]
    lacking: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Hosting:
    """The vertices of one node.

    Attributes:
        vertices: The vertices hosted here at the start, ascending.
        hosts: Node of each vertex that one of them exchanges messages with.
        measured: What the vertices of a data-association problem are made of.
    """

    vertices: tuple[Vertex, ...]
    hosts: dict[int, int]
    measured: Measurements | None = None


def prepare(
    node: NodeHandle, width: Precision, deadline_ns: int, attempts: int, manner: Manner = "unicast", late_ns: int = 0
) -> Op[Hosting]:
    """Build the vertices this node hosts; returns at the deadline on every node that is up by then.

    In data association a sensor's compatibility functions contain its partners' measurements (Chen et al. 2006, eqs 9
    and 14), so these are exchanged first. Where a partner was not heard, the node goes on as if it had measured nothing;
    a node whose energy allowance refuses the reading tells nothing.

    Args:
        node: The node.
        width: Precision on the air; measurements go as float16 where messages are quantised, because the two coordinates
            of few points are no array with a range worth telling.
        deadline_ns: When the exchange ends, by the node's clock.
        attempts: How often an unacknowledged measurement is sent.
        manner: How measurements are exchanged (see `netsim.protocols.exchange`).
        late_ns: How long a node that was down at the deadline asks its partners for their measurements, which they must
            serve (see `netsim.algorithms.rehosting`); 0 for not at all, as if they had measured nothing.

    Raises:
        AlgorithmError: If the scenario's problem is not one for message passing.
    """
    knowledge = node.knowledge
    if isinstance(knowledge, AssociationKnowledge):
        payload = yield from _sensed(node, float_width(width))
        partners = sorted(knowledge.sensor_nodes[sensor] for sensor in knowledge.partners)
        if node.now_ns >= deadline_ns and late_ns:
            heard = yield from ask_again(node, OBSERVATIONS, partners, node.now_ns + late_ns, attempts)
        else:
            heard = yield from exchange(node, OBSERVATIONS, payload, partners, deadline_ns, attempts, manner)
        own, others = _measured(knowledge, payload or b"", heard, float_width(width))
        vertices = tuple(model_vertices(knowledge, own, others))
        lacking = {sensor for sensor in knowledge.partners if knowledge.sensor_nodes[sensor] not in heard}
        lacking |= {knowledge.sensor} if payload is None else set()
        return Hosting(vertices, dict(knowledge.hosts), Measurements(knowledge, own, others, frozenset(lacking)))
    if isinstance(knowledge, DistributionKnowledge):
        reading = yield from _read(node)
        yield from node.pause_until(deadline_ns)
        return Hosting(counting_model.hosted_vertices(knowledge, reading), dict(knowledge.hosts))
    yield from node.pause_until(deadline_ns)
    if isinstance(knowledge, GraphKnowledge):
        return Hosting(knowledge.vertices, dict(knowledge.hosts))
    if knowledge is None:
        return Hosting((), {})
    needed = "an association, target-distribution or factor-graph problem"
    message = f"message passing needs {needed}, not {type(knowledge).__name__}"
    raise AlgorithmError(message)


def is_founded(vertex: Vertex, measured: Measurements | None) -> bool:
    """Whether a vertex' potentials rest on measurements alone, none of them taken to be nothing because it is unknown.

    What clusters of the sensor-oriented model have of each other's measurements is not looked at: where one of two hosts
    lacks them, messages between the two do not have the size that the other expects.
    """
    if measured is None:
        return True
    sensors = {s for s, _ in vertex.scope} if isinstance(vertex, ListedVertex) else {vertex.id, *vertex.neighbours}
    return measured.lacking.isdisjoint(sensors)


def _read(node: NodeHandle) -> Op[float | None]:
    """The sensor's count; None where the sensor gives none, or the node's energy allowance refuses the reading."""
    try:
        observation = yield from node.sense()
    except NoEnergyError:
        return None
    return float(observation.values[0]) if observation.values.size else None


def _sensed(node: NodeHandle, width: FloatWidth) -> Op[bytes | None]:
    """The sensor's measurements as they are told; None where the node's energy allowance refuses the reading."""
    try:
        observation = yield from node.sense()
    except NoEnergyError:
        return None
    return encode_floats(observation.values.ravel(), width)


def _measured(
    knowledge: AssociationKnowledge, payload: bytes, heard: Mapping[int, bytes], width: FloatWidth
) -> tuple[FloatArray, Mapping[int, FloatArray]]:
    """Own measurements and those heard. What is used here is what is sent: both ends must compute with the same."""
    nodes = {knowledge.sensor_nodes[sensor]: sensor for sensor in knowledge.partners}
    numbers = knowledge.model.numbers
    others = {sensor: np.empty((0, numbers)) for sensor in knowledge.partners}
    others.update({nodes[source]: _points(data, width, numbers) for source, data in heard.items()})
    return _points(payload, width, numbers), others


def _points(data: bytes, width: FloatWidth, numbers: int) -> FloatArray:
    return decode_floats(data, width).reshape(-1, numbers)
