"""What correlation-decay sensors tell each other, as bytes.

A report: number of events (1 byte), then each event (number and owner, 2 bytes each, and position), then each measurement
(number, 1 byte, and position). An empty report has no bytes. Where floats are narrowed, the owner computes with what the
others get.

A request for factors: its number (4 bytes), number of removed vertices (2 bytes), then removed vertices and the list, each
vertex of 5 bytes: kind (1 byte), owner (2 bytes), number (2 bytes). The answer: the request's number and the product.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from netsim.codec import FloatWidth, Record, decode_floats, encode_floats, size_byte
from netsim.errors import AlgorithmError
from netsim.kernels.event_association import PredictedEvent
from netsim.kernels.known_association import SensorReport
from netsim.kernels.semiring import FloatArray

_COUNT = Record("B")
_EVENT = Record("HH")
_NUMBER = Record("B")
_REQUEST = Record("IH")
_VERTEX = Record("BHH")
_ANSWER = Record("I")
_MOST = 255


@dataclass(frozen=True, slots=True, order=True)
class VertexName:
    """A vertex of the association graph, as all nodes call it: measurements before events, by owner and number.

    Attributes:
        is_event: Whether it is an event.
        owner: Node that owns it.
        number: An event's number, or a measurement's number at its owner.
    """

    is_event: bool
    owner: int
    number: int


def narrowed(points_m: FloatArray, width: FloatWidth) -> FloatArray:
    """Positions as those decode them who are told of them, shape (n, 2)."""
    return decode_floats(encode_floats(points_m.ravel(), width), width).reshape(-1, 2)


def encode_report(report: SensorReport, width: FloatWidth) -> bytes:
    """A report as it goes over the air.

    Raises:
        AlgorithmError: For more than 255 measurements or events.
    """
    if not report.numbers:
        return b""
    if max(len(report.events), report.numbers[-1]) > _MOST:
        message = f"node {report.node}: more than {_MOST} measurements or events in a report"
        raise AlgorithmError(message)
    parts = [_COUNT.pack(len(report.events))]
    for event in report.events:
        parts += [_EVENT.pack(event.event, event.owner), encode_floats((event.x_m, event.y_m), width)]
    for number, place in zip(report.numbers, report.measurements_m, strict=True):
        parts += [_NUMBER.pack(number), encode_floats(place, width)]
    return b"".join(parts)


def decode_report(node: int, data: bytes, width: FloatWidth) -> SensorReport:
    """The inverse of `encode_report`."""
    if not data:
        return SensorReport(node, (), np.empty((0, 2)), ())
    (events,), offset = _COUNT.unpack(data), _COUNT.size_byte
    place_byte = size_byte(2, width)
    found, numbers, points = [], [], []
    for _ in range(events):
        event, owner = _EVENT.unpack(data, offset)
        offset += _EVENT.size_byte + place_byte
        found.append(PredictedEvent(event, owner, *decode_floats(data[offset - place_byte : offset], width).tolist()))
    while offset < len(data):
        numbers.append(int(_NUMBER.unpack(data, offset)[0]))
        offset += _NUMBER.size_byte + place_byte
        points.append(decode_floats(data[offset - place_byte : offset], width))
    return SensorReport(node, tuple(numbers), np.array(points).reshape(-1, 2), tuple(found))


@dataclass(frozen=True, slots=True)
class FactorRequest:
    """A request to go on with a chain of factors (Oh 2010, Algorithm 4).

    Attributes:
        number: Its number at the node that sends it.
        removed: What is removed from the graph so far (U), carried whole.
        vertices: The rest of the list; the receiver owns the first.
    """

    number: int
    removed: tuple[VertexName, ...]
    vertices: tuple[VertexName, ...]


def encode_request(request: FactorRequest) -> bytes:
    """A request as it goes over the air."""
    names = (*request.removed, *request.vertices)
    head = _REQUEST.pack(request.number, len(request.removed))
    return head + b"".join(_VERTEX.pack(name.is_event, name.owner, name.number) for name in names)


def decode_request(data: bytes) -> FactorRequest:
    """The inverse of `encode_request`."""
    number, removed = _REQUEST.unpack(data)
    offsets = range(_REQUEST.size_byte, len(data), _VERTEX.size_byte)
    names = tuple(_name(_VERTEX.unpack(data, offset)) for offset in offsets)
    return FactorRequest(number, names[:removed], names[removed:])


def _name(fields: Sequence[int]) -> VertexName:
    kind, owner, number = fields
    return VertexName(bool(kind), owner, number)


def encode_answer(number: int, product: float) -> bytes:
    """An answer as it goes over the air."""
    return _ANSWER.pack(number) + encode_floats([product], "float64")


def decode_answer(data: bytes) -> tuple[int, float]:
    """The inverse of `encode_answer`."""
    (number,) = _ANSWER.unpack(data)
    return number, float(decode_floats(data[_ANSWER.size_byte :], "float64")[0])
