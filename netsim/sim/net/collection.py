"""A tree to the sinks, after the collection tree protocol, CTP (Gnawali et al., SenSys 2009).

Every node knows its parent, and what a packet costs from there to a sink in expected transmissions; its beacons tell both.
It leaves its parent for one that is better by 1.5 transmissions, or when the link to it has become too bad. Each packet
carries its last sender's cost: a receiver that is not nearer to the sink has found what may be a loop; it passes the
packet on, and lets neighbours have its own cost at once. The hop limit ends what goes round all the same.

Unlike CTP the interval between beacons is not adapted (Trickle); news bring an extra beacon.
"""

import struct
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.parameters import NonNegative, parameters
from netsim.sim.clock import Clock
from netsim.sim.net.packet import Form, Packet
from netsim.sim.net.router import Way
from netsim.sim.net.settings import BeaconDiscovery, HopLimit, NetworkSettings
from netsim.trace.events import BROADCAST, RouteChange
from netsim.trace.recorder import Recorder

NONE = 0xFFFF
UNIT = 100
_ADVERT = struct.Struct(">3H")


@parameters
class CollectionParameters(NetworkSettings):
    """Messages to a sink climb a tree of cheapest ways (CTP, Gnawali et al. 2009); others go to neighbours only."""

    type: Literal["collection"] = "collection"
    discovery: BeaconDiscovery = BeaconDiscovery()
    """How nodes come to know their neighbours; the beacons carry the tree too (6 bytes)."""
    switch_etx: NonNegative = 1.5
    """A parent is left for one whose way costs so many transmissions less (TinyOS, PARENT_SWITCH_THRESHOLD)."""
    largest_link_etx: Annotated[float, Ge(1)] = 5.0
    """Links that take more transmissions are not used (TinyOS, MAX_ONE_HOP_ETX)."""
    hop_limit: HopLimit = 64
    """Packets that have made so many hops are dropped."""
    retries: Annotated[int, Ge(0), Le(30)] = 7
    """How often a packet that the link layer gave up, or that found no parent, is tried again; with the four attempts of
    CSMA the 30 retransmissions of TinyOS or so."""


@dataclass(slots=True)
class Offer:
    """What a neighbour's beacon said: its parent, its cost in hundredths, and the sink it leads to."""

    parent: int
    cost: int
    root: int


class CollectionTree:
    """One node's place in the tree; a `Router` and an `Advertiser`.

    Args:
        clock: Simulated time.
        node: This node's id.
        sinks: The roots, known from the start; `node` may be one.
        settings: Thresholds.
        links: Expected transmissions to each neighbour.
        recorder: Where changes of parent go.

    Attributes:
        on_news: Called when neighbours should hear of this node soon.
    """

    fields_byte = 2

    def __init__(
        self,
        clock: Clock,
        node: int,
        sinks: Collection[int],
        settings: CollectionParameters,
        links: Callable[[], Mapping[int, float]],
        recorder: Recorder,
    ) -> None:
        self._clock = clock
        self._node = node
        self._sinks = sinks
        self._is_sink = is_sink = node in sinks
        self._settings = settings
        self._links = links
        self._recorder = recorder
        self.on_news: Callable[[], None] = lambda: None
        self._offers: dict[int, Offer] = {}
        self._parent: int | None = None
        self._cost = 0 if is_sink else NONE
        self._root: int | None = node if is_sink else None
        self._looks = False

    @property
    def root(self) -> int | None:
        """The sink that this node's way leads to; None while it has none."""
        return self._root

    def route(self, packet: Packet, previous: int | None) -> Way:
        """See `Router.route`."""
        if packet.destination in self._links() and packet.form != Form.COLLECT:
            return Way(packet.destination, packet)
        if packet.form == Form.COLLECT and previous is not None:
            self._look_for_loop(struct.unpack(">H", packet.fields)[0])
        is_up = packet.form == Form.COLLECT or packet.destination in self._sinks
        if not is_up or self._parent is None:
            return Way(None, packet)
        return Way(self._parent, replace(packet, form=Form.COLLECT, fields=struct.pack(">H", self._cost)))

    def is_direct(self, destination: int) -> bool:
        """See `Router.is_direct`."""
        return destination in self._links()

    def advert(self) -> bytes:
        """See `Advertiser.advert`."""
        parent = self._node if self._parent is None else self._parent
        return _ADVERT.pack(parent, self._cost, self._node if self._root is None else self._root)

    def on_advert(self, neighbour: int, advert: bytes) -> None:
        """See `Advertiser.on_advert`."""
        if len(advert) == _ADVERT.size:
            self._offers[neighbour] = Offer(*_ADVERT.unpack(advert))

    def on_neighbours(self) -> None:
        """Choose anew at the end of this instant, however much happens in it."""
        if not self._looks and not self._is_sink:
            self._looks = True
            self._clock.call_last(0, lambda _: self._choose())

    def forget(self) -> None:
        """The node lost its memory."""
        self._offers.clear()
        if not self._is_sink:
            self._parent, self._cost, self._root = None, NONE, None

    def _look_for_loop(self, sender_cost: int) -> None:
        if sender_cost <= self._cost:
            self.on_news()

    def _choose(self) -> None:
        self._looks = False
        links = self._links()
        costs = {}
        for node, offer in list(self._offers.items()):
            link = links.get(node)
            if link is None:
                del self._offers[node]
            elif offer.parent != self._node and link <= self._settings.largest_link_etx:
                costs[node] = offer.cost + round(UNIT * link)
        costs = {node: cost for node, cost in costs.items() if cost < NONE}
        best = min(costs, key=lambda node: (costs[node], node), default=None)
        here = costs.get(self._parent) if self._parent is not None else None
        if here is not None and best is not None and here - costs[best] < UNIT * self._settings.switch_etx:
            best = self._parent
        self._take(best, NONE if best is None else costs[best])

    def _take(self, parent: int | None, cost: int) -> None:
        was, self._parent, self._cost = self._parent, parent, cost
        root, self._root = self._root, None if parent is None else self._offers[parent].root
        if parent != was:
            destination = root if self._root is None else self._root
            hop = BROADCAST if parent is None else parent
            self._recorder.record(
                RouteChange(self._node, BROADCAST if destination is None else destination, hop, cost / UNIT)
            )
            self.on_news()
