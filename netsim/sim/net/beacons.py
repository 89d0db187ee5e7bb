"""Neighbour discovery: a node tells now and then that it is there, and whom it hears how well.

A beacon: form and flags (4 + 4 bits), number (16), position x, y (32 each, if the flag says so), how much routing adds
(8) and that, how many reports (8), then of each neighbour heard its id (16) and the share of its beacons that came (8,
255 for all). The sender is in the link layer's header. What does not fit is reported in the next beacon.
"""

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from netsim.api import Delivery, Neighbour
from netsim.sim.clock import Clock
from netsim.sim.net.link_port import Draw, LinkPort
from netsim.sim.net.neighbours import NeighbourTable
from netsim.sim.net.packet import Form
from netsim.sim.net.planar import Point, as_sent, distance
from netsim.sim.net.settings import BeaconDiscovery
from netsim.units import s_to_ns

BEACON = "beacon"
_WITH_POSITION, _COMPLETE = 1, 2
_REPORT_BYTE = 3
HURRY = 0.1
"""An extra beacon goes out within this part of a period."""


class Advertiser(Protocol):
    """Routing that rides on beacons, or follows the neighbours."""

    def advert(self) -> bytes:
        """What this node's beacons are to carry, at most 32 bytes."""
        ...

    def on_advert(self, neighbour: int, advert: bytes) -> None:
        """A neighbour's beacon carried this; it may be any bytes."""
        ...

    def on_neighbours(self) -> None:
        """A beacon was taken in, a neighbour was lost, or a link estimated anew."""
        ...

    def forget(self) -> None:
        """The node lost its memory."""
        ...


class Discovery:
    """Sends beacons and keeps the neighbour table. A `Service` and the `Surroundings` of its network layer.

    Args:
        clock: Simulated time.
        node: This node's id.
        settings: Period and estimator.
        draw: The node's random numbers by name.
        position_m: Where the node is.
        packet_byte: Largest packet.
    """

    def __init__(
        self,
        clock: Clock,
        node: int,
        settings: BeaconDiscovery,
        draw: Draw,
        position_m: Callable[[], Point],
        packet_byte: int,
    ) -> None:
        self._clock = clock
        self._node = node
        self._settings = settings
        self._draw = draw
        self._position_m = position_m
        self._packet_byte = packet_byte
        self._period_ns = s_to_ns(settings.period_s)
        self.table = NeighbourTable(settings, int(settings.validity_periods * self._period_ns))
        self._port: LinkPort | None = None
        self.advertiser: Advertiser | None = None
        self._number = 0
        self._life = 0
        self._hurries = False
        self._next_report = 0

    def connect(self, port: LinkPort) -> None:
        """Give it the way to the MAC."""
        self._port = port

    # --- what others ask ----------------------------------------------------------------------------------------------

    @property
    def discovered(self) -> Sequence[Neighbour]:
        """See `Surroundings.discovered`: those that hear us too."""
        me = as_sent(self._position_m())
        return tuple(
            Neighbour(node, math.inf if entry.position_m is None else distance(me, entry.position_m), there)
            for node, entry, there, _ in self.table.two_way()
        )

    def positions(self, minimum_prr: float) -> Mapping[int, Point]:
        """Positions of neighbours whose links are good enough."""
        usable = self.table.costs(minimum_prr)
        known = self.table.known
        return {node: there for node in usable if (there := known[node].position_m) is not None}

    def on_sent(self, hop: int, delivery: Delivery) -> None:
        """See `Surroundings.on_sent`."""
        self.table.on_data(hop, delivery)
        self._tell()

    # --- a service ----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """The first beacon falls at a random moment of the first period."""
        life = self._life
        phase_ns = int(self._draw(f"beacon/phase/{life}") * self._period_ns)
        self._clock.call_after(phase_ns, lambda _: self._beat(life))

    def stop(self) -> None:
        """See `Service.stop`. The number of the next beacon is kept."""
        self._life += 1
        self._hurries = False
        self.table.clear()
        if self.advertiser is not None:
            self.advertiser.forget()

    def hurry(self) -> None:
        """Send an extra beacon soon: there is news that neighbours should have."""
        if self._hurries:
            return
        self._hurries = True
        life = self._life

        def act(_: object) -> None:
            if life == self._life:
                self._hurries = False
                self._send()

        delay_ns = int((1 + self._draw(f"beacon/hurry/{self._number}")) / 2 * HURRY * self._period_ns)
        self._clock.call_after(delay_ns, act)

    def on_packet(self, data: bytes, neighbour: int) -> bool:
        """A beacon came."""
        beacon = decode_beacon(data)
        if beacon is None:
            return False
        number, position_m, advert, reports, complete = beacon
        if self.table.on_beacon(neighbour, number, position_m, self._clock.now_ns):
            if self._node in reports or complete:
                self.table.on_report(neighbour, reports.get(self._node))
            if self.advertiser is not None:
                self.advertiser.on_advert(neighbour, advert)
            self._tell()
        return True

    def _beat(self, life: int) -> None:
        if life != self._life:
            return
        if self.table.expire(self._clock.now_ns):
            self._tell()
        self._send()
        jitter = self._settings.jitter * (2 * self._draw(f"beacon/{self._number}") - 1)
        self._clock.call_after(max(1, int(self._period_ns * (1 + jitter))), lambda _: self._beat(life))

    def _send(self) -> None:
        if self._port is None:
            return
        self._number = (self._number + 1) % 0x10000
        position_m = as_sent(self._position_m()) if self._settings.positions else None
        advert = b"" if self.advertiser is None else self.advertiser.advert()
        room = (self._packet_byte - 5 - len(advert) - (8 if position_m else 0)) // _REPORT_BYTE
        shares = [(node, entry.prr_in) for node, entry in sorted(self.table.known.items()) if entry.prr_in is not None]
        complete = len(shares) <= room
        if not complete:
            start = self._next_report % len(shares)
            shares = (shares[start:] + shares[:start])[:room]
            self._next_report = start + room
        self._port.control(encode_beacon(self._number, position_m, advert, shares, complete), BEACON)

    def _tell(self) -> None:
        if self.advertiser is not None:
            self.advertiser.on_neighbours()


def encode_beacon(
    number: int, position_m: Point | None, advert: bytes, shares: Sequence[tuple[int, float]], complete: bool
) -> bytes:
    """A beacon, see the module."""
    flags = _WITH_POSITION * (position_m is not None) + _COMPLETE * complete
    where = b"" if position_m is None else struct.pack(">2f", *position_m)
    reports = b"".join(struct.pack(">HB", node, round(255 * share)) for node, share in shares)
    head = struct.pack(">BH", Form.BEACON << 4 | flags, number)
    return head + where + bytes([len(advert)]) + advert + bytes([len(shares)]) + reports


def decode_beacon(data: bytes) -> tuple[int, Point | None, bytes, dict[int, float], bool] | None:
    """Number, position, what routing added, reports, whether they are all; None for what is no beacon."""
    try:
        flags, number = struct.unpack_from(">BH", data)
        offset, position_m = 3, None
        if flags & _WITH_POSITION:
            position_m = struct.unpack_from(">2f", data, offset)
            offset += 8
        advert = data[offset + 1 : offset + 1 + data[offset]]
        offset += 1 + data[offset]
        count = data[offset]
        reports = dict(struct.iter_unpack(">HB", data[offset + 1 : offset + 1 + _REPORT_BYTE * count]))
    except (struct.error, IndexError):
        return None
    if len(reports) != count or (position_m and not all(map(math.isfinite, position_m))):
        return None
    return number, position_m, advert, {node: share / 255 for node, share in reports.items()}, bool(flags & _COMPLETE)
