"""Shortest paths found by the nodes themselves: distance vectors with destination sequence numbers.

Each node tells its neighbours, regularly and when something changed, how far it has to every destination it knows, with
a number that only the destination raises (DSDV, Perkins and Bhagwat 1994). What a neighbour tells is used only where it
cannot lead back here: its number is newer than that of any route this node has told of, or as new and its distance
smaller than the smallest told (the feasibility condition of Babel, RFC 8966, 3.5.1). So there are no loops, also while
routes change, and split horizon is not needed: who goes through this node tells of a greater distance. Where no usable
route is left, a new way is found with the destination's next number.

An update: form (8 bits), then for each destination its id, number and distance (16 each; hundredths, 65,535 for none).
"""

import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from netsim.sim.clock import Clock
from netsim.sim.net.link_port import Draw, LinkPort
from netsim.sim.net.packet import Form
from netsim.trace.events import BROADCAST, RouteChange
from netsim.trace.recorder import Recorder

ROUTE = "route"
NONE = 0xFFFF
UNIT = 100
SHARE_OF_PERIOD = 0.1
"""News go out within this part of an update period."""
VALID_PERIODS = 3.5
"""A neighbour's word on a destination is forgotten when it was not repeated for so many periods."""
SWITCH = 50
"""A next hop is left for one whose way costs so many hundredths less: half a transmission, against noise in estimates."""
NOTABLE = 0.1
"""The cost of a link in use is replaced when the estimate differs by more than this part of it."""
_ENTRY = struct.Struct(">3H")


@dataclass(slots=True)
class Word:
    """What a neighbour said of its distance to a destination."""

    sequence: int
    distance: int
    heard_ns: int


@dataclass(slots=True)
class Route:
    """What this node knows of a destination.

    Attributes:
        words: By neighbour.
        hop: Next hop; None for no route.
        cost: Distance through it, in hundredths.
        told: The newest number told of, and the smallest distance told with it: the feasible distance.
    """

    words: dict[int, Word]
    hop: int | None = None
    cost: int = NONE
    told: tuple[int, int] | None = None


def is_newer(a: int, b: int) -> bool:
    """Whether a sequence number is newer than another, as they come round (RFC 1982)."""
    return 0 < (a - b) % 0x10000 < 0x8000


def is_feasible(word: Word, told: tuple[int, int] | None) -> bool:
    """Whether a word cannot lead back to who told that."""
    if told is None or is_newer(word.sequence, told[0]):
        return True
    return word.sequence == told[0] and word.distance < told[1]


class DistanceVector:
    """The routing table of one node; a `Service`, an `Advertiser` (that adds nothing) and `Routes`.

    Args:
        clock: Simulated time.
        node: This node's id.
        period_ns: Mean time between full updates.
        draw: The node's random numbers by name.
        links: Cost of the link to each usable neighbour.
        packet_byte: Largest packet.
        recorder: Where changes of next hops go.
    """

    def __init__(
        self,
        clock: Clock,
        node: int,
        period_ns: int,
        draw: Draw,
        links: Callable[[], Mapping[int, float]],
        packet_byte: int,
        recorder: Recorder,
    ) -> None:
        self._clock = clock
        self._node = node
        self._period_ns = period_ns
        self._draw = draw
        self._links = links
        self._most_entries = (packet_byte - 1) // _ENTRY.size
        self._recorder = recorder
        self._port: LinkPort | None = None
        self._routes: dict[int, Route] = {}
        self._sequence = 0
        self._updates = 0
        self._news: set[int] = set()
        self._used: dict[int, int] = {}  # cost of each link, in hundredths, as routes are computed with
        self._touched: set[int] = set()  # destinations to choose for anew
        self._life = 0
        self._looks = False

    def connect(self, port: LinkPort) -> None:
        """Give it the way to the MAC."""
        self._port = port

    def next_hop(self, node: int, destination: int) -> int | None:
        """See `Routes.next_hop`."""
        route = self._routes.get(destination)
        return None if route is None else route.hop

    # --- a service ----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """The first full update falls at a random moment of the first period."""
        life = self._life
        self._clock.call_after(int(self._draw(f"route/phase/{life}") * self._period_ns), lambda _: self._beat(life))

    def stop(self) -> None:
        """See `Service.stop`. The number is kept: a new life must not seem older than the one before."""
        self._life += 1
        self.forget()

    def forget(self) -> None:
        """See `Advertiser.forget`."""
        self._routes.clear()
        self._news.clear()
        self._used.clear()
        self._touched.clear()
        self._looks = False

    def on_packet(self, data: bytes, neighbour: int) -> bool:
        """A neighbour's update."""
        if (len(data) - 1) % _ENTRY.size:
            return False
        now_ns = self._clock.now_ns
        for destination, sequence, distance in _ENTRY.iter_unpack(data[1:]):
            if destination != self._node:
                word = None if distance == NONE else Word(sequence, distance, now_ns)
                self._hear(self._routes.setdefault(destination, Route({})), destination, neighbour, word)
        self.on_neighbours()
        return True

    def _hear(self, route: Route, destination: int, neighbour: int, word: Word | None) -> None:
        """Keep a neighbour's word; only one that may change something makes the node choose anew."""
        if word is None:
            route.words.pop(neighbour, None)
        else:
            route.words[neighbour] = word
        may_win = word is not None and word.distance + self._used.get(neighbour, NONE) < route.cost
        if may_win or neighbour == route.hop:
            self._touched.add(destination)

    def advert(self) -> bytes:
        """See `Advertiser.advert`: routes travel by themselves."""
        return b""

    def on_advert(self, neighbour: int, advert: bytes) -> None:
        """See `Advertiser.on_advert`."""

    def on_neighbours(self) -> None:
        """Choose anew at the end of this instant, however much happens in it."""
        if not self._looks:
            self._looks = True
            life = self._life
            self._clock.call_last(0, lambda _: self._choose() if life == self._life else None)

    # --- choosing -----------------------------------------------------------------------------------------------------

    def _choose(self) -> None:
        self._looks = False
        changed = self._take_links()
        if changed:
            self._touched |= {node for node, route in self._routes.items() if not changed.isdisjoint(route.words)}
        for destination in sorted(self._touched):
            self._choose_for(destination, self._routes[destination])
        self._touched.clear()
        if self._news:
            self._tell_soon()

    def _take_links(self) -> set[int]:
        """Take over the estimates that differ notably from the costs in use; returns whose."""
        links = {node: round(UNIT * cost) for node, cost in self._links().items()}
        changed = self._used.keys() - links.keys()
        for node, cost in links.items():
            if node not in self._used or abs(cost - self._used[node]) > NOTABLE * self._used[node]:
                changed.add(node)
        for node in changed:
            self._used.pop(node, None)
            if node in links:
                self._used[node] = links[node]
        return changed

    def _choose_for(self, destination: int, route: Route) -> None:
        """The cheapest feasible neighbour, the lowest id among equals; or the present one if that is hardly worse."""
        costs = {
            node: word.distance + self._used[node]
            for node, word in route.words.items()
            if node in self._used and is_feasible(word, route.told)
        }
        costs = {node: cost for node, cost in costs.items() if cost < NONE}
        best = min(costs, key=lambda node: (costs[node], node), default=None)
        was = route.hop
        if best is not None and was in costs and costs[was] - costs[best] < SWITCH:
            best = was
        route.hop, route.cost = best, NONE if best is None else costs[best]
        if best != was:
            self._news.add(destination)
            hop, cost = (BROADCAST, 0.0) if best is None else (best, route.cost / UNIT)
            self._recorder.record(RouteChange(self._node, destination, hop, cost))

    def _drop_stale(self) -> None:
        """Forget what was not repeated for too long."""
        oldest_ns = self._clock.now_ns - int(VALID_PERIODS * self._period_ns)
        for destination, route in self._routes.items():
            for node in [node for node, word in route.words.items() if word.heard_ns < oldest_ns]:
                del route.words[node]
                self._touched.add(destination)

    # --- telling ------------------------------------------------------------------------------------------------------

    def _beat(self, life: int) -> None:
        if life != self._life:
            return
        self._drop_stale()
        self._choose()
        self._sequence = (self._sequence + 1) % 0x10000
        self._tell(sorted(self._routes))
        self._news.clear()
        factor = 0.75 + 0.5 * self._draw(f"route/{self._updates}")
        self._clock.call_after(max(1, int(self._period_ns * factor)), lambda _: self._beat(life))

    def _tell_soon(self) -> None:
        """News go out together a little later; what is told meanwhile is not told twice."""
        life = self._life
        delay_ns = int(SHARE_OF_PERIOD * self._period_ns * self._draw(f"route/news/{self._updates}"))

        def act(_: object) -> None:
            if life == self._life and self._news:
                news, self._news = sorted(self._news), set()
                self._tell(news)

        self._clock.call_after(delay_ns, act)

    def _tell(self, destinations: Iterable[int]) -> None:
        entries = [(self._node, self._sequence, 0)]
        entries += [entry for node in destinations if (entry := self._entry(node, self._routes[node])) is not None]
        self._updates += 1
        for start in range(0, len(entries), self._most_entries):
            part = entries[start : start + self._most_entries]
            data = bytes([Form.ROUTE << 4]) + b"".join(_ENTRY.pack(*entry) for entry in part)
            if self._port is not None:
                self._port.control(data, ROUTE)

    @staticmethod
    def _entry(destination: int, route: Route) -> tuple[int, int, int] | None:
        """What to tell of a destination; remembers it as told. None where it was never told of."""
        if route.hop is None:
            return None if route.told is None else (destination, route.told[0], NONE)
        sequence = route.words[route.hop].sequence
        told = route.told
        if told is None or is_newer(sequence, told[0]):
            route.told = (sequence, route.cost)
        else:
            route.told = (sequence, min(told[1], route.cost))
        return destination, sequence, route.cost
