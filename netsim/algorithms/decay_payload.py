"""What correlation-decay sensors tell each other, as bytes.

A report: number of events (1 byte), then each event (number and owner, 2 bytes each, and position), then each measurement
(number, 1 byte, and position). An empty report has no bytes. Where floats are narrowed, the owner computes with what the
others get.

A request for factors: its number (4 bytes), depth (2 bytes), number of removed vertices (2 bytes), then removed vertices and
the list, each vertex of 5 bytes: kind (1 byte), owner (2 bytes), number (2 bytes). The answer: the request's number (4
bytes), and the product's exponent (4 bytes) and mantissa (8 bytes).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from netsim.codec import FloatWidth, Record, decode_floats, encode_floats, size_byte
from netsim.errors import AlgorithmError
from netsim.kernels.event_association import PredictedEvent
from netsim.kernels.known_association import SensorReport
from netsim.kernels.scaled_product import Product
from netsim.kernels.semiring import FloatArray

_COUNT = Record("B")
_EVENT = Record("HH")
_NUMBER = Record("B")
_REQUEST = Record("IHH")
_VERTEX = Record("BHH")
_ANSWER = Record("Ii")
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


def rounding_m(place_m: tuple[float, float], width: FloatWidth, around_m: float = 0.0) -> float:
    """How far a position may have been, at most, from where those see it who are told of it.

    Args:
        place_m: The position.
        width: Precision on the air.
        around_m: For every position up to so far from it.
    """
    return float(np.finfo(width).eps) * (1.0 + abs(place_m[0]) + abs(place_m[1]) + 2.0 * around_m)


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
    """The inverse of `encode_report`.

    Raises:
        ValueError: If it is cut short.
        struct.error: If it is cut short.
    """
    if not data:
        return SensorReport(node, (), np.empty((0, 2)), ())
    (events,), offset = _COUNT.unpack(data), _COUNT.size_byte
    place_byte = size_byte(2, width)
    events_byte = offset + events * (_EVENT.size_byte + place_byte)
    if len(data) < events_byte or (len(data) - events_byte) % (_NUMBER.size_byte + place_byte):
        message = f"a report of {len(data)} bytes, which is not one of {events} events and some measurements"
        raise ValueError(message)
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
        depth: Levels of the recursion that it asks for, t, at most 65,535.
        removed: What is removed from the graph so far (U), carried whole.
        vertices: The rest of the list; the receiver owns the first.
    """

    number: int
    depth: int
    removed: tuple[VertexName, ...]
    vertices: tuple[VertexName, ...]


def encode_request(request: FactorRequest) -> bytes:
    """A request as it goes over the air."""
    names = (*request.removed, *request.vertices)
    head = _REQUEST.pack(request.number, request.depth, len(request.removed))
    return head + b"".join(_VERTEX.pack(name.is_event, name.owner, name.number) for name in names)


def decode_request(data: bytes) -> FactorRequest:
    """The inverse of `encode_request`.

    Raises:
        ValueError: If it is cut short.
        struct.error: If it is cut short.
    """
    number, depth, removed = _REQUEST.unpack(data)
    offsets = range(_REQUEST.size_byte, len(data), _VERTEX.size_byte)
    names = tuple(_name(_VERTEX.unpack(data, offset)) for offset in offsets)
    if len(names) <= removed:
        message = f"a request for factors with {removed} vertices removed names {len(names)} in all"
        raise ValueError(message)
    return FactorRequest(number, depth, names[:removed], names[removed:])


def _name(fields: Sequence[int]) -> VertexName:
    kind, owner, number = fields
    return VertexName(bool(kind), owner, number)


def encode_answer(number: int, product: Product) -> bytes:
    """An answer as it goes over the air."""
    return _ANSWER.pack(number, product.exponent) + encode_floats([product.mantissa], "float64")


def decode_answer(data: bytes) -> tuple[int, Product]:
    """The inverse of `encode_answer`.

    Raises:
        ValueError: If it is cut short, or what is in it is no product of probabilities.
        struct.error: If it is cut short.
    """
    number, exponent = _ANSWER.unpack(data)
    (mantissa,) = decode_floats(data[_ANSWER.size_byte :], "float64").tolist()
    if not (0.5 <= mantissa < 1.0 and (exponent <= 0 or (mantissa, exponent) == (0.5, 1))):
        message = f"a product of probabilities of {mantissa:g} x 2^{exponent}"
        raise ValueError(message)
    return number, Product(mantissa, exponent)
