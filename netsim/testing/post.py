"""Below a message, without physics: stations in place of radio, MAC and network layer, and the post between them."""

from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import networkx as nx

from netsim.api import Delivery, Message, Neighbour, Region
from netsim.errors import AlgorithmError
from netsim.sim.clock import Clock
from netsim.sim.mac.link import LinkJob
from netsim.sim.net.regions import contains
from netsim.testing.media import MessageMedium, Passage
from netsim.trace.events import (
    BROADCAST,
    RADIO_STATE_CODE,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    RadioState,
)
from netsim.trace.recorder import Recorder
from netsim.units import s_to_ns

Done = Callable[[Delivery], None]


class Station:
    """Radio, MAC and network layer of one node in one: a letter box (see `netsim.sim.layers`)."""

    def __init__(self, node: int, post: "Post", deliver: Callable[[Message], None]) -> None:
        self._node = node
        self._post = post
        self.deliver = deliver
        self.state = "off"
        self.pending = 0
        self.position_m = (0.0, 0.0)
        self.refuses: Callable[[], bool] = lambda: False

    @property
    def is_sending(self) -> bool:
        """See `Transceiver.is_sending`; letters need no radio."""
        return False

    def start(self) -> None:
        """See `Transceiver.start`."""
        self.state = "listen"

    def die(self) -> None:
        """See `Transceiver.die`."""
        self._turn("dead")

    def power_off(self) -> None:
        """See `Transceiver.power_off`."""
        self._turn("off")

    def settle(self) -> None:
        """It draws nothing."""

    def give_up(self, reason: str) -> None:
        """What is on its way already arrives."""

    def stop(self) -> None:
        """It remembers nothing."""

    def sleep(self) -> None:
        """See `LinkLayer.sleep`."""
        if self.state == "listen":
            self._turn("sleep")

    def wake(self) -> None:
        """See `LinkLayer.wake`."""
        if self.state == "sleep":
            self._turn("listen")

    @property
    def discovered(self) -> Sequence[Neighbour] | None:
        """Neighbours are given."""
        return None

    def is_direct(self, destination: int) -> bool:
        """See `NetworkLayer.is_direct`."""
        return self._post.hops(self._node, destination) == 1

    def send(self, destination: int, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """See `NetworkLayer.send`."""
        return self._post.accept(self._node, destination, kind, payload, causes, done)

    def submit(self, job: LinkJob) -> None:
        """There are no packets here: nothing is ever submitted."""

    def multicast(
        self, destinations: Sequence[int], kind: str, payload: bytes, causes: Sequence[int], done: Done
    ) -> int:
        """See `NetworkLayer.multicast`."""
        receivers = dict.fromkeys(sorted(destinations), 1)
        return self._post.accept(self._node, BROADCAST, kind, payload, causes, done, receivers, is_addressed=True)

    def flood(self, hop_limit: int, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Reaches whoever is within so many hops, at once and without loss on the way but that of the medium."""
        within = {node: hops for node, hops in self._post.distances(self._node).items() if 0 < hops <= hop_limit}
        return self._post.accept(self._node, BROADCAST, kind, payload, causes, done, within)

    def geocast(self, region: Region, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """Reaches whoever stands in the region and has a way to there."""
        inside = {
            node: hops
            for node, hops in self._post.distances(self._node).items()
            if hops > 0 and contains(region, self._post.stations[node].position_m)
        }
        return self._post.accept(self._node, BROADCAST, kind, payload, causes, done, inside)

    def send_to_sink(self, kind: str, payload: bytes, causes: Sequence[int], done: Done) -> int:
        """The sink with the fewest hops, then the lowest number."""
        sink = self._post.nearest_sink(self._node)
        if sink is None or sink == self._node:
            message = f"sent a {kind!r} message to the sink, and there is none or it is there already"
            raise AlgorithmError(message)
        return self.send(sink, kind, payload, causes, done)

    def _turn(self, state: str) -> None:
        self.state = state
        self._post.recorder.record(RadioState(self._node, RADIO_STATE_CODE[state]))


@dataclass(frozen=True, slots=True)
class Letter:
    """A sent message and whom to tell what became of it."""

    id: int
    source: int
    destination: int
    kind: str
    payload: bytes
    sent_ns: int
    done: Done
    is_addressed: bool = False


class Post:
    """Carries letters between stations as the medium decides."""

    def __init__(
        self,
        clock: Clock,
        recorder: Recorder,
        medium: MessageMedium,
        neighbours: Mapping[int, Collection[int]],
        sinks: Collection[int] = (),
    ) -> None:
        self._sinks = sinks
        self._clock = clock
        self.recorder = recorder
        self._medium = medium
        self._neighbours = neighbours
        self._graph = nx.DiGraph((node, other) for node, others in neighbours.items() for other in others)
        self.stations: dict[int, Station] = {}
        self._sent = 0
        self._counts: defaultdict[tuple[int, int, str], int] = defaultdict(int)
        self._due: dict[int, list[tuple[tuple[int, ...], Callable[[], None]]]] = {}

    def accept(
        self,
        source: int,
        destination: int,
        kind: str,
        payload: bytes,
        causes: Sequence[int],
        done: Done,
        receivers: Mapping[int, int] | None = None,
        is_addressed: bool = False,
    ) -> int:
        """Take a message, call `done` once with what became of it, return its number in the trace.

        Args:
            source: Who sends it.
            destination: To whom, or `BROADCAST`.
            kind: Its kind.
            payload: Its bytes.
            causes: Messages that led to it.
            done: Told what became of it.
            receivers: Whom a broadcast reaches, with the hops it takes; by default the neighbours.
            is_addressed: Whether each receiver finds itself named as the destination.
        """
        self._sent += 1
        self.recorder.record(MessageSent(self._sent, source, destination, kind, len(payload), 1, causes))
        letter = Letter(self._sent, source, destination, kind, payload, self._clock.now_ns, done, is_addressed)
        if self.stations[source].refuses():
            self._lose(letter, "no_energy", 0)
        elif destination == BROADCAST:
            self._spread(letter, dict.fromkeys(self._neighbours.get(source, ()), 1) if receivers is None else receivers)
        elif (hops := self.hops(source, destination)) is None:
            self._lose(letter, "no_route", 0)
        else:
            self._carry(letter, destination, hops)
        return letter.id

    def _spread(self, letter: Letter, receivers: Mapping[int, int]) -> None:
        for receiver, hops in sorted(receivers.items()):
            self._carry(letter, receiver, hops)
        self._after(self._usual_ns, letter, letter.source, 0, lambda: letter.done(Delivery(True, "", 1)))

    def _carry(self, letter: Letter, receiver: int, hops: int) -> None:
        edge = (letter.source, receiver, letter.kind)
        passage = Passage(*edge, letter.payload, letter.sent_ns, self._counts[edge], letter.destination == BROADCAST)
        self._counts[edge] += 1
        extras_ns = self._medium.verdict(passage)
        for copy, extra_ns in enumerate(extras_ns):
            self._post_copy(letter, receiver, hops, copy, self._usual_ns + extra_ns)
        if not extras_ns and letter.destination != BROADCAST:
            self._after(self._usual_ns, letter, receiver, 0, lambda: self._lose(letter, "no_ack", 1))

    def _post_copy(self, letter: Letter, receiver: int, hops: int, copy: int, delay_ns: int) -> None:
        tell = copy == 0 and letter.destination != BROADCAST
        self._after(delay_ns, letter, receiver, copy, lambda: self._arrive(letter, receiver, hops, tell))

    def _arrive(self, letter: Letter, receiver: int, hops: int, tell: bool) -> None:
        heard = self.stations[receiver].state == "listen"
        if heard:
            self._hand_over(letter, receiver, hops)
        if tell and heard:
            letter.done(Delivery(True, "", 1))
        elif tell:
            self._lose(letter, "no_ack", 1)

    def _hand_over(self, letter: Letter, receiver: int, hops: int) -> None:
        now_ns = self._clock.now_ns
        latency_ns = now_ns - letter.sent_ns
        size_byte = len(letter.payload)
        self.recorder.record(
            MessageDelivered(letter.id, letter.source, receiver, letter.kind, size_byte, hops, latency_ns)
        )
        to = receiver if letter.is_addressed else letter.destination
        self.stations[receiver].deliver(
            Message(letter.id, letter.source, to, letter.kind, letter.payload, now_ns, hops)
        )

    def _lose(self, letter: Letter, reason: str, attempts: int) -> None:
        if self.stations[letter.source].state not in ("dead", "off"):
            source = letter.source
            self.recorder.record(MessageDropped(letter.id, source, letter.destination, source, letter.kind, reason))
        letter.done(Delivery(False, reason, attempts))

    def nearest_sink(self, node: int) -> int | None:
        """The sink with the fewest hops, then the lowest number; itself for a sink, None without sinks."""
        if node in self._sinks:
            return node
        hops = self.distances(node)
        return min(self._sinks, key=lambda sink: (hops.get(sink, len(self.stations)), sink), default=None)

    def distances(self, source: int) -> Mapping[int, int]:
        """Hops to every node there is a way to."""
        if source not in self._graph:
            return {}
        return {
            int(node): int(hops) for node, hops in nx.single_source_shortest_path_length(self._graph, source).items()
        }

    def hops(self, source: int, destination: int) -> int | None:
        """Hops to a node; None if there is no way."""
        if destination in self._neighbours.get(source, ()):
            return 1
        try:
            return int(nx.shortest_path_length(self._graph, source, destination))
        except (nx.NetworkXNoPath, nx.NodeNotFound):
            return None

    @property
    def _usual_ns(self) -> int:
        return s_to_ns(self._medium.delay_s)

    def _after(self, delay_ns: int, letter: Letter, receiver: int, copy: int, action: Callable[[], None]) -> None:
        """Do something later; what falls on the same instant is sorted, so that no order of sending shows."""
        station = self.stations[letter.source]
        station.pending += 1

        def act() -> None:
            station.pending -= 1
            action()

        at_ns = self._clock.now_ns + delay_ns
        if at_ns not in self._due:
            self._due[at_ns] = []
            self._clock.call_after(delay_ns, self._act_on_due)
        self._due[at_ns].append(((receiver, letter.source, letter.id, copy), act))

    def _act_on_due(self, _: object) -> None:
        for _key, action in sorted(self._due.pop(self._clock.now_ns), key=lambda entry: entry[0]):
            action()
