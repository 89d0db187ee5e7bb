"""Greedy perimeter stateless routing, GPSR (Karp and Kung, MobiCom 2000).

A packet goes to the neighbour nearest to its destination's position. Where no neighbour is nearer than the node itself,
it walks round the void by the right-hand rule on a planar subgraph, changing faces where its edges cross the line from
the point of entry to the destination, until it comes nearer than where it entered. A packet that is about to traverse
the first edge of a face again cannot reach its destination and is dropped.

On unit-disk graphs a packet is delivered wherever there is a way (Frey and Stojmenovic, MobiCom 2006). Real links break
that promise: the two ends of an edge may disagree about it.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from netsim.parameters import parameters
from netsim.sim.net.packet import GREEDY, PERIMETER, PERIMETER_BYTE, Form, Packet
from netsim.sim.net.planar import (
    Planarisation,
    Point,
    as_sent,
    bearing,
    crossing,
    distance,
    is_nearer,
    next_counterclockwise,
    planar_neighbours,
)
from netsim.sim.net.regions import centre, decode_region, region_byte
from netsim.sim.net.router import Way
from netsim.sim.net.settings import BeaconDiscovery, HopLimit, NetworkSettings


@parameters
class GeographicParameters(NetworkSettings):
    """Messages are forwarded by position, greedily and round voids (GPSR, Karp and Kung 2000).

    A destination's position is looked up in a directory that costs nothing: that of the positions at the start.
    """

    type: Literal["geographic"] = "geographic"
    planarisation: Planarisation = "gabriel"
    """Planar subgraph for the way round a void: Gabriel graph, or the sparser relative neighbourhood graph."""
    minimum_prr: Annotated[float, Gt(0), Le(1)] = 0.5
    """Links whose packet reception ratio is lower, in either direction, are not used."""
    hop_limit: HopLimit = 128
    """Packets that have made so many hops are dropped."""
    retries: Annotated[int, Ge(0), Le(30)] = 2
    """How often a packet that the link layer gave up is routed anew."""

    def __post_init__(self) -> None:
        """Neighbours that do not tell where they are cannot be chosen by position."""
        NetworkSettings.__post_init__(self)
        if isinstance(self.discovery, BeaconDiscovery) and not self.discovery.positions:
            message = "discovery with `positions: true`, for geographic routing"
            raise ValueError(message)


@dataclass(frozen=True, slots=True)
class Course:
    """The fields of a geographic packet.

    Attributes:
        target: Position of the destination, D.
        entry: Where it entered perimeter mode, L_p; None in greedy mode.
        face: Where it entered the present face, L_f.
        edge: First edge of the present face, e_0.
    """

    target: Point
    entry: Point | None = None
    face: Point = (0.0, 0.0)
    edge: tuple[int, int] = (0, 0)

    def encode(self) -> bytes:
        """See `netsim.sim.net.packet.Form.GEOGRAPHIC`."""
        if self.entry is None:
            return struct.pack(">B2f", GREEDY, *self.target)
        return struct.pack(">B6f2H", PERIMETER, *self.target, *self.entry, *self.face, *self.edge)

    @classmethod
    def decode(cls, data: bytes) -> "Course":
        """The course that `encode` gave these bytes."""
        if data[0] == GREEDY:
            x, y = struct.unpack_from(">2f", data, 1)
            return cls((x, y))
        x, y, px, py, fx, fy, a, b = struct.unpack_from(">6f2H", data, 1)
        return cls((x, y), (px, py), (fx, fy), (a, b))


class GeographicRouter:
    """See the module.

    Args:
        node: This node's id.
        position_m: Where it is.
        near: Its neighbours' positions, rounded as they are sent.
        locate: The directory: a node's position, None if it has none.
        rule: Which planar subgraph.
    """

    fields_byte = PERIMETER_BYTE

    def __init__(
        self,
        node: int,
        position_m: Callable[[], Point],
        near: Callable[[], Mapping[int, Point]],
        locate: Callable[[int], Point | None],
        rule: Planarisation,
    ) -> None:
        self._node = node
        self._position_m = position_m
        self._near = near
        self._locate = locate
        self._rule: Planarisation = rule

    def is_direct(self, destination: int) -> bool:
        """See `Router.is_direct`."""
        return destination in self._near()

    def route(self, packet: Packet, previous: int | None) -> Way:
        """See `Router.route`."""
        region, course = self._course(packet)
        if course is None:
            return Way(None, packet)
        near = self._near()
        if packet.form != Form.GEOCAST_WAY and packet.destination in near:
            hop, onward = packet.destination, Course(course.target)
        else:
            found, onward = self._step(course, near, previous)
            if found is None:
                return Way(None, packet)
            hop = found
        form = Form.GEOCAST_WAY if region else Form.GEOGRAPHIC
        return Way(hop, replace(packet, form=form, fields=region + onward.encode()))

    def _course(self, packet: Packet) -> tuple[bytes, Course | None]:
        """The region a packet is for, if it is for one, and its course; a new one where it begins here."""
        if packet.form == Form.GEOCAST_WAY:
            size_byte = region_byte(packet.fields) or 0
            region, rest = packet.fields[:size_byte], packet.fields[size_byte:]
            return region, Course.decode(rest) if rest else Course(as_sent(centre(decode_region(region))))
        if packet.form == Form.GEOGRAPHIC:
            return b"", Course.decode(packet.fields)
        there = self._locate(packet.destination)
        return b"", None if there is None else Course(as_sent(there))

    def _step(self, course: Course, near: Mapping[int, Point], previous: int | None) -> tuple[int | None, Course]:
        """The next hop and the packet's course from there."""
        me = as_sent(self._position_m())
        if course.entry is None or is_nearer(me, course.entry, course.target):
            return self._greedy(Course(course.target), me, near)
        if previous not in near:
            return self._enter(course, me, near)
        return self._round(course, me, near, previous)

    def _greedy(self, course: Course, me: Point, near: Mapping[int, Point]) -> tuple[int | None, Course]:
        best = min(near, key=lambda node: (distance(near[node], course.target), node), default=None)
        if best is not None and distance(near[best], course.target) < distance(me, course.target):
            return best, course
        return self._enter(course, me, near)

    def _enter(self, course: Course, me: Point, near: Mapping[int, Point]) -> tuple[int | None, Course]:
        """Enter perimeter mode: the first edge counterclockwise from the line to the destination."""
        edges = planar_neighbours(me, near, self._rule)
        hop = next_counterclockwise(me, bearing(me, course.target), edges, None)
        return hop, course if hop is None else Course(course.target, me, me, (self._node, hop))

    def _round(
        self, course: Course, me: Point, near: Mapping[int, Point], previous: int | None
    ) -> tuple[int | None, Course]:
        """Go on round the face, and change to the next one where the line to the destination is crossed."""
        edges = planar_neighbours(me, near, self._rule)
        hop = self._after(me, near, edges, previous)
        if hop is None or (self._node, hop) == course.edge:
            return None, course
        for _ in range(len(edges)):
            met = crossing(near[hop], me, course.entry or me, course.target)
            if met is None or not is_nearer(met, course.face, course.target):
                break
            hop = self._after(me, near, edges, hop) or hop
            course = replace(course, face=met, edge=(self._node, hop))
        return hop, course

    @staticmethod
    def _after(me: Point, near: Mapping[int, Point], edges: Mapping[int, Point], previous: int | None) -> int | None:
        """The edge after the one from `previous`, counterclockwise."""
        came = None if previous is None else near.get(previous)
        return None if came is None else next_counterclockwise(me, bearing(me, came), edges, previous)
