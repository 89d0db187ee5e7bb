"""How sensors learn their associations where other nodes host the variables: the hosts tell them at the end, by messages.

In the target-oriented model the host of a target decides which measurement of each covering sensor is the target's, in the
sensor-oriented model the host of a cluster decides for all its sensors. Each host sends every sensor what it concludes about
its measurements: the (max-)marginal of missed and of each measurement, target by target. A sensor decides when it has heard
of all its targets, or when the time is over, by what it has heard (`netsim.kernels.association_graph.decide_by_claims`).
"""

from collections.abc import Mapping

from netsim.algorithms.hosted import Hosted
from netsim.algorithms.hosting import Measurements
from netsim.algorithms.message_passing_parameters import MessagePassingParameters
from netsim.api import Message, NodeHandle, Op
from netsim.codec import FloatWidth, Record, decode_floats, encode_floats, float_width, size_byte
from netsim.errors import AlgorithmError
from netsim.kernels.association_graph import decide_by_claims
from netsim.kernels.association_model import AssociationKnowledge
from netsim.kernels.listed_vertex import ListedVertex
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.trace.events import Association
from netsim.units import s_to_ns

CLAIM = "claim"
_CLAIM = Record("HH")  # target, number of entries

Claims = dict[int, FloatArray]
"""For each target what its host says of one sensor's measurements."""


def check_hybrid(knowledge: AssociationKnowledge) -> None:
    """Refuse to re-host variables that are not those of the hybrid model.

    Raises:
        AlgorithmError: For another model.
    """
    if knowledge.graph != "hybrid":
        text = f"rehost: true works with the problem's model: hybrid, got model: {knowledge.graph}: leave rehost out"
        raise AlgorithmError(text)


def encode_claims(claims: Mapping[int, FloatArray], width: FloatWidth) -> bytes:
    """What one sensor is told, as a payload."""
    return b"".join(_CLAIM.pack(target, len(row)) + encode_floats(row, width) for target, row in sorted(claims.items()))


def decode_claims(payload: bytes, width: FloatWidth) -> Claims:
    """The inverse of `encode_claims`."""
    claims, offset = {}, 0
    while offset < len(payload):
        target, size = _CLAIM.unpack(payload, offset)
        begin = offset + _CLAIM.size_byte
        offset = begin + size_byte(size, width)
        claims[int(target)] = decode_floats(payload[begin:offset], width)
    return claims


def report_associations(
    node: NodeHandle, hosted: Hosted, parameters: MessagePassingParameters, semiring: Semiring
) -> Op[None]:
    """Tell the sensors what the vertices hosted here conclude, hear of one's own, and record the association.

    Takes at most one round more (`round_s`). Returns at once where sensors host their own variables, as in the hybrid model.

    Args:
        node: The node.
        hosted: What it hosts, after the last round.
        parameters: Of the algorithm: the round, what is sent again, the precision on the air.
        semiring: What the beliefs are.
    """
    measured = hosted.hosting.measured
    if measured is None or measured.knowledge.graph == "hybrid":
        return
    if parameters.sleep != "never":
        node.radio_wake()
    end_ns = node.now_ns + s_to_ns(parameters.round_s)
    width, knowledge = float_width(parameters.payload), measured.knowledge
    by_sensor = _concluded(hosted, semiring)
    heard = by_sensor.pop(knowledge.sensor, {})
    node.spawn(_tell(node, measured, by_sensor, parameters, end_ns))
    wanted = {covered.target for covered in knowledge.targets}
    while not wanted <= heard.keys() and node.now_ns < end_ns:
        message: Message | None = yield from node.receive(kinds={CLAIM}, timeout_ns=end_ns - node.now_ns)
        if message is not None:
            heard.update(decode_claims(message.payload, width))
    decision = decide_by_claims(heard, len(measured.own_m), semiring)
    node.record(Association(node.id, decision.tolist(), parameters.rounds))
    yield from node.pause_until(end_ns)  # what is on its way from here goes on


def _concluded(hosted: Hosted, semiring: Semiring) -> dict[int, Claims]:
    """What the vertices hosted here say to each sensor."""
    by_sensor: dict[int, Claims] = {}
    for vertex_id, sender in sorted(hosted.senders.items()):
        vertex = sender.vertex
        if isinstance(vertex, ListedVertex):
            for (sensor, target), row in vertex.claims(hosted.incoming[vertex_id], semiring).items():
                by_sensor.setdefault(sensor, {})[target] = row
    return by_sensor


def _tell(
    node: NodeHandle,
    measured: Measurements,
    by_sensor: Mapping[int, Claims],
    parameters: MessagePassingParameters,
    end_ns: int,
) -> Op[None]:
    """Send each sensor its claims, at a random moment of the time for that; again where the link layer gave up."""
    width = float_width(parameters.payload)
    yield from node.pause(int(node.rng("claims").random() * s_to_ns(parameters.spread_s)))
    waiting = {
        measured.knowledge.sensor_nodes[sensor]: encode_claims(claims, width)
        for sensor, claims in sorted(by_sensor.items())
    }
    for _ in range(parameters.resend + 1):
        missed = {}
        for host, payload in waiting.items():
            delivery = yield from node.send(host, CLAIM, payload).wait()
            if not delivery.acknowledged:
                missed[host] = payload
        waiting = missed
        if not waiting or node.now_ns >= end_ns:
            return
