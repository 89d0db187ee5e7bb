"""Tree-reweighted max-product by real messages between the nodes: the MAP state, proved, or an honest "not proved".

Chen, Wainwright, Cetin, Willsky, Mathematical and Computer Modelling 43 (2006), section 2.3; Wainwright, Jaakkola, Willsky,
IEEE Transactions on Information Theory 51 (2005).

Each connected component of the model works on its own and at its own pace: its vertices grow spanning trees
(`netsim.algorithms.trmp_trees`), then repeat max-product on all trees, a vote and a verdict
(`netsim.algorithms.trmp_inference`) until all trees agree on the state of every vertex, which is then the MAP state. A node
serves all the vertices it hosts; messages between them cost no air, those for another node that are ready together share
one. Every message is needed: `netsim.protocols.courier` sees to it that none is missing. Where one is in the end, its
component waits until the time is over and proves nothing. Where a node crashed and came up again, where a measurement was
not heard that a vertex is made of, or two built their vertices from different ones, the component gives up as soon as that
shows, vertex telling vertex. Where a node's energy allowance refuses a computation, what depends on it waits for the
allowance, or is never said. Where sensors do not host their own variables, as in the target-oriented and the
sensor-oriented model, hosts tell them in the end (`netsim.algorithms.trmp_conclusions`).

What the processor is charged for: the sensor's reading, every max-product message and every decision on a tree. Not charged:
building vertices, tree building, rewriting the potentials, encoding and decoding.
"""

from collections.abc import Sequence
from functools import partial

from netsim.algorithms.hosting import Hosting, is_founded, prepare
from netsim.algorithms.patient_compute import compute_when_allowed
from netsim.algorithms.trmp_conclusions import Conclusions
from netsim.algorithms.trmp_inference import Plan
from netsim.algorithms.trmp_messages import Claim, Entry, Heard, TreeMessage, decode, encode
from netsim.algorithms.trmp_parameters import TrmpParameters
from netsim.algorithms.trmp_report import Report
from netsim.algorithms.trmp_vertex import HostedVertex
from netsim.api import NodeHandle, Op
from netsim.kernels.trmp import MARGIN
from netsim.protocols.courier import Arrival, Courier
from netsim.units import s_to_ns

TRMP = "trmp"
_MARGINS = {"float64": MARGIN, "float32": 1e-3}
"""By precision on the air: how clearly a state must be the best; above what rounding can do."""
_LINGER_STALLS = 4
"""How many times `stall_s` a node stays that has nothing left to do."""


def _plan(chosen: TrmpParameters, diameters: tuple[int, ...]) -> Plan:
    """What all vertices of a component know when all their trees stand, of these longest paths."""
    return Plan(
        rounds=diameters if chosen.schedule == "flooding" else None,
        damping=chosen.damping,
        iterations=chosen.iterations,
        margin=_MARGINS[chosen.payload],
    )


class Trmp:
    """See the module.

    Args:
        parameters: Its settings.
    """

    def __init__(self, parameters: TrmpParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        chosen = self._parameters
        setup = s_to_ns(chosen.setup_s), chosen.setup_attempts, chosen.setup_exchange
        hosting = yield from prepare(node, chosen.payload, *setup)
        plan = partial(_plan, chosen)
        vertices = {vertex.id: HostedVertex(vertex, plan) for vertex in hosting.vertices}  # type: ignore[arg-type]  # all are
        report = Report(node, hosting.hosts, vertices)
        host = _Host(node, hosting, vertices, chosen, report)
        report.begun()
        yield from host.serve(s_to_ns(chosen.time_limit_s))
        report.end()
        told = host.conclusions.association(node.id)
        if told is not None:
            node.record(told)


class _Host:
    """A node's side: carries entries between the vertices, here and elsewhere."""

    def __init__(
        self,
        node: NodeHandle,
        hosting: Hosting,
        vertices: dict[int, HostedVertex],
        parameters: TrmpParameters,
        report: Report,
    ) -> None:
        self._node = node
        self._hosts = hosting.hosts
        self._vertices = vertices
        self._parameters = parameters
        self._report = report
        self._stall_ns = s_to_ns(parameters.stall_s)
        self._limit_ns = s_to_ns(parameters.time_limit_s)
        self._is_spent = False
        self._measured = hosting.measured
        self.conclusions = Conclusions(hosting.measured)
        hosted = {number: each.vertex for number, each in vertices.items()}
        peers = (set(hosting.hosts.values()) | self.conclusions.peers(hosted)) - {node.id}
        resend = parameters.resend, s_to_ns(parameters.resend_s)
        self._courier = Courier(node, TRMP, peers, self._stall_ns, *resend)

    def serve(self, end_ns: int) -> Op[None]:
        """Begin, then answer until the time is over or nothing is left to be done here."""
        begun: list[Entry] = []
        for hosted in self._vertices.values():
            begun += hosted.start() if is_founded(hosted.vertex, self._measured) else hosted.abandon()
        yield from self._send(begun)
        while not self._is_finished and self._node.now_ns < end_ns:
            if not (yield from self._answer(end_ns)):
                break
        if self.conclusions.are_told:
            yield from self._conclude(end_ns + _LINGER_STALLS * self._stall_ns)
        elif not self._is_finished:
            return
        yield from self._linger(end_ns)

    def _answer(self, end_ns: int, *, asks: bool = True) -> Op[bool]:
        """Wait for what comes next, and answer it and all that comes in the pause before; False if the time is over."""
        node = self._node
        arrived = yield from self._courier.receive(end_ns - node.now_ns, asks=asks)
        if arrived is None:
            return False
        entries = self._taken(arrived)
        yield from node.pause(int(node.rng("spread").random() * s_to_ns(self._parameters.spread_s)))
        while (arrived := (yield from self._courier.receive(0, asks=False))) is not None:
            entries += self._taken(arrived)
        yield from self._send(entries)
        return True

    @property
    def _is_finished(self) -> bool:
        """Whether nothing is left to be done here, or nothing more can be: no energy is left to compute with."""
        return self._is_spent or all(vertex.is_finished for vertex in self._vertices.values())

    def _conclude(self, end_ns: int) -> Op[None]:
        """Tell the sensors until all have confirmed, as often as messages are sent again; hear what one's own is told."""
        node, conclusions = self._node, self.conclusions
        for hosted in self._vertices.values():
            conclusions.draw(hosted.vertex, hosted.inference)
        for _ in range(self._parameters.resend + 1):
            if not conclusions.unconfirmed:
                break
            yield from self._send(conclusions.unconfirmed)
            again_ns = min(node.now_ns + self._stall_ns, end_ns)
            while conclusions.unconfirmed and (yield from self._answer(again_ns, asks=False)):
                pass
        while not conclusions.is_complete and (yield from self._answer(end_ns, asks=False)):
            pass

    def _linger(self, end_ns: int) -> Op[None]:
        """Stay within reach of those who may still lack a message: done, but not deaf."""
        node = self._node
        end_ns = min(node.now_ns + _LINGER_STALLS * self._stall_ns, max(end_ns, node.now_ns))
        while (yield from self._answer(end_ns, asks=False)):
            pass
        yield from self._courier.see_off()

    def _taken(self, arrival: Arrival) -> list[Entry]:
        if arrival.payload is None:
            return self._parted(arrival.peer)
        entries: list[Entry] = []
        for entry in decode(arrival.payload, self._parameters.payload):
            if self._fits(entry):
                entries += self._delivered(entry)
            else:
                self._node.log(f"message from vertex {entry.source} to {entry.destination} does not fit: given up")
                entries += self._vertices[entry.destination].abandon()
        return entries

    def _parted(self, peer: int) -> list[Entry]:
        """This node or the peer began anew: what the vertices there and here have to settle, they cannot any more."""
        self.conclusions.lose(peer)
        entries: list[Entry] = []
        for hosted in self._vertices.values():
            if any(self._hosts[other] == peer for other in hosted.vertex.neighbours):
                entries += hosted.abandon()
        return entries

    def _fits(self, entry: Entry) -> bool:
        """Whether sender and receiver built their vertices from the same measurements, as far as the size tells."""
        body = entry.body
        if not isinstance(body, TreeMessage):
            return True
        return len(body.log_message) == self._vertices[entry.destination].vertex.incoming_size(entry.source)

    def _delivered(self, entry: Entry) -> list[Entry]:
        """What an entry that has reached its node is answered with."""
        match entry.body:
            case Claim():
                return self.conclusions.hear(entry, entry.body)
            case Heard():
                self.conclusions.confirm(entry)
                return []
        return self._vertices[entry.destination].take(entry)

    def _host_of(self, entry: Entry) -> int:
        """The node that an entry is for."""
        if isinstance(entry.body, Claim):
            return self.conclusions.node_of(entry.destination)
        return self._hosts[entry.destination]

    def _send(self, entries: Sequence[Entry]) -> Op[None]:
        """Hand entries over here until only those for other nodes are left, then send these."""
        remote: list[Entry] = []
        waiting = list(entries)
        while waiting:
            ready, waiting = waiting, []
            self._report.messages(ready)
            for entry in ready:
                if self._host_of(entry) == self._node.id:
                    waiting += self._delivered(entry)
                else:
                    remote.append(entry)
        operations = sum(vertex.spent() for vertex in self._vertices.values())
        if not (yield from compute_when_allowed(self._node, operations, self._limit_ns)):
            self._is_spent = True  # what it would say or conclude is of a computation that was refused
            return
        if not self._is_spent:
            self._report.verdicts()
        self._hand_over([entry for entry in remote if not entry.is_held])
        held = [entry for entry in remote if entry.is_held]
        if held:
            self._node.spawn(self._later(held))

    def _later(self, entries: Sequence[Entry]) -> Op[None]:
        yield from self._node.pause(s_to_ns(self._parameters.hold_s))
        self._hand_over(entries)

    def _hand_over(self, entries: Sequence[Entry]) -> None:
        by_host: dict[int, list[Entry]] = {}
        for entry in entries:
            by_host.setdefault(self._host_of(entry), []).append(entry)
        for host, together in sorted(by_host.items()):
            self._courier.send(host, encode(together, self._parameters.payload))
