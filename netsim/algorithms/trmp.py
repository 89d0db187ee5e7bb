"""Tree-reweighted max-product by real messages between the nodes: the MAP state, proved, or an honest "not proved".

Chen, Wainwright, Cetin, Willsky, Mathematical and Computer Modelling 43 (2006), section 2.3; Wainwright, Jaakkola, Willsky,
IEEE Transactions on Information Theory 51 (2005).

Each connected component of the model works on its own and at its own pace: its vertices grow spanning trees
(`netsim.algorithms.trmp_trees`), then repeat max-product on all trees, a vote and a verdict
(`netsim.algorithms.trmp_inference`) until all trees agree on the state of every vertex, which is then the MAP state. A node
serves all the vertices it hosts; messages between them cost no air, those for another node that are ready together share
one. Every message is needed: `netsim.protocols.courier` sees to it that none is missing. Where one is in the end, its
component waits until the time is over and proves nothing.

What the processor is charged for: the sensor's reading, every max-product message and every decision on a tree. Not charged:
building vertices, tree building, encoding and decoding.
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le

from netsim.algorithms.hosting import Hosting, prepare
from netsim.algorithms.trmp_inference import Plan, TreeReweighted
from netsim.algorithms.trmp_messages import Entry, Go, Next, TreeMessage, Verdict, Vote, Wave, decode, encode
from netsim.algorithms.trmp_trees import TreeBuilder
from netsim.api import Message, NodeHandle, NoEnergyError, Op
from netsim.errors import AlgorithmError
from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.semiring import Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.kernels.target_vertex import TargetVertex
from netsim.kernels.trmp import MARGIN, TreeSchedule
from netsim.kernels.vertex import ReweightableVertex
from netsim.parameters import NonNegative, Positive, PositiveInt, parameters
from netsim.protocols.courier import Courier
from netsim.protocols.exchange import Manner
from netsim.trace.events import AlgorithmRecord, Association, GraphMessages, Marginals
from netsim.units import s_to_ns

TRMP = "trmp"
_PHASES = {Wave: "trees", Next: "trees", Go: "trees", TreeMessage: "inference", Vote: "agreement", Verdict: "agreement"}
_MARGINS = {"float64": MARGIN, "float32": 1e-3}
"""By precision on the air: how clearly a state must be the best; above what rounding can do."""


@parameters
class TrmpParameters:
    """Tree-reweighted max-product: finds the MAP state and proves it, or says that it could not."""

    type: Literal["trmp"] = "trmp"
    """Selects this algorithm."""
    schedule: TreeSchedule = "two_pass"
    """On each tree: from the leaves inward and back out, one message a directed edge; or `flooding`, parallel rounds, as
    many as the tree's longest path has edges."""
    iterations: Annotated[int, Ge(1), Le(65_535)] = 100
    """Most iterations; then the answer is not proved."""
    damping: Annotated[float, Gt(0), Le(1)] = 0.5
    """Share of each step of the reparameterization that is taken: 0.5 is the geometric mean of old and new compatibilities,
    1 the step as printed, which oscillates on dense graphs."""
    setup_s: Positive = 6.0
    """Time for sensing and for the exchange of measurements before anything else. Without them nothing is proved."""
    setup_attempts: PositiveInt = 6
    """How often a measurement is sent that was not acknowledged."""
    setup_exchange: Manner = "unicast"
    """How measurements are exchanged (see `max-product`)."""
    time_limit_s: Positive = 600.0
    """When nodes give up waiting, from the start of the run."""
    spread_s: NonNegative = 0.02
    """Before it sends, a node waits at random up to this long: others have their turn, and messages gather."""
    hold_s: NonNegative = 0.1
    """How much later a growing tree passes an edge that has one already; several times what a message takes."""
    resend: Annotated[int, Ge(0), Le(50)] = 10
    """How often a message that the link layer gave up is sent again."""
    resend_s: Positive = 0.5
    """Longest pause before it is sent again."""
    stall_s: Positive = 5.0
    """How long a node hears nothing new before it asks for what it lacks; then twice as long, up to 32 times."""
    payload: Literal["float64", "float32"] = "float64"
    """Precision of numbers on the air. With float32 a state must be better than the next by a factor of e^0.001, not
    e^(10^-9), to count as the only best one: rounding must not prove anything."""


class _Vertex:
    """One hosted vertex: it grows trees first, then infers; what comes early waits."""

    def __init__(self, vertex: ReweightableVertex, parameters: TrmpParameters) -> None:
        self.vertex = vertex
        self.builder = TreeBuilder(vertex.id, vertex.neighbours)
        self.inference: TreeReweighted | None = None
        self._parameters = parameters
        self._early: list[Entry] = []

    def start(self) -> list[Entry]:
        """Begin; an isolated vertex is done at once."""
        return self._onward(self.builder.start())

    def take(self, entry: Entry) -> list[Entry]:
        """Answer a message."""
        body = entry.body
        if isinstance(body, Wave | Next | Go):
            return self._onward(self.builder.take(entry.source, body))
        if self.inference is None:
            self._early.append(entry)
            return []
        return self.inference.take(entry.source, body)

    def _onward(self, entries: list[Entry]) -> list[Entry]:
        """Begin inference as soon as all trees stand."""
        diameters = self.builder.diameters
        if self.inference is not None or diameters is None:
            return entries
        chosen = self._parameters
        plan = Plan(
            rounds=diameters if chosen.schedule == "flooding" else None,
            damping=chosen.damping,
            iterations=chosen.iterations,
            margin=_MARGINS[chosen.payload],
        )
        self.inference = TreeReweighted(self.vertex, self.builder.places, plan)
        entries = entries + self.inference.begin()
        early, self._early = self._early, []
        for entry in early:
            entries += self.take(entry)
        return entries

    @property
    def is_finished(self) -> bool:
        """Whether the verdict that ends it is known."""
        return self.inference is not None and self.inference.verdict is not None

    def spent(self) -> int:
        """Operations since this was asked last."""
        if self.inference is None:
            return 0
        spent, self.inference.operations = self.inference.operations, 0
        return spent


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
        if hosting.measured is not None and hosting.measured.knowledge.graph != "hybrid":
            graph = hosting.measured.knowledge.graph
            text = f"trmp works on the association problem's model: hybrid, got model: {graph}: leave model out"
            raise AlgorithmError(text)
        vertices = {vertex.id: _Vertex(vertex, chosen) for vertex in hosting.vertices}  # type: ignore[arg-type]  # all are
        host = _Host(node, hosting, vertices, chosen)
        yield from host.serve(s_to_ns(chosen.time_limit_s))
        host.report()


class _Host:
    """A node's side: carries entries between the vertices, here and elsewhere."""

    def __init__(
        self, node: NodeHandle, hosting: Hosting, vertices: dict[int, _Vertex], parameters: TrmpParameters
    ) -> None:
        self._node = node
        self._hosts = hosting.hosts
        self._vertices = vertices
        self._parameters = parameters
        self._counts: Counter[str] = Counter()
        peers = set(hosting.hosts.values()) - {node.id}
        resend = parameters.resend, s_to_ns(parameters.resend_s)
        self._courier = Courier(node, TRMP, peers, s_to_ns(parameters.stall_s), *resend)

    def serve(self, end_ns: int) -> Op[None]:
        """Begin, then answer until the time is over or nothing is left to be done here."""
        node = self._node
        yield from self._send([entry for vertex in self._vertices.values() for entry in vertex.start()])
        while not self._is_finished and node.now_ns < end_ns:
            arrived = yield from self._courier.receive(end_ns - node.now_ns)
            if arrived is None:
                return
            entries = self._taken(*arrived)
            yield from node.pause(int(node.rng("spread").random() * s_to_ns(self._parameters.spread_s)))
            while (arrived := (yield from self._courier.receive(0, asks=False))) is not None:
                entries += self._taken(*arrived)
            yield from self._send(entries)
        yield from self._linger(end_ns)

    @property
    def _is_finished(self) -> bool:
        return all(vertex.is_finished for vertex in self._vertices.values())

    def _linger(self, end_ns: int) -> Op[None]:
        """Stay within reach of those who may still lack a message: done, but not deaf."""
        linger_ns = 4 * s_to_ns(self._parameters.stall_s)
        yield from self._courier.receive(min(linger_ns, max(0, end_ns - self._node.now_ns)), asks=False)
        yield from self._courier.see_off()

    def _taken(self, message: Message, payload: bytes) -> list[Entry]:
        entries: list[Entry] = []
        for entry in decode(payload, self._parameters.payload):
            if self._fits(entry):
                entries += self._vertices[entry.destination].take(entry)
            else:
                self._node.log(f"message from vertex {entry.source} to {entry.destination} does not fit: left out")
        return entries

    def _fits(self, entry: Entry) -> bool:
        """Whether sender and receiver built their vertices from the same measurements, as far as the size tells."""
        vertex = self._vertices[entry.destination].vertex
        body = entry.body
        return not isinstance(body, TreeMessage) or len(body.log_message) == vertex.incoming_size(entry.source)

    def _send(self, entries: Sequence[Entry]) -> Op[None]:
        """Hand entries over here until only those for other nodes are left, then send these."""
        remote: list[Entry] = []
        waiting = list(entries)
        while waiting:
            ready, waiting = waiting, []
            self._count(ready)
            for entry in ready:
                if self._hosts[entry.destination] == self._node.id:
                    waiting += self._vertices[entry.destination].take(entry)
                else:
                    remote.append(entry)
        try:
            yield from self._node.compute(sum(vertex.spent() for vertex in self._vertices.values()))
        except NoEnergyError:
            return
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
            by_host.setdefault(self._hosts[entry.destination], []).append(entry)
        for host, together in sorted(by_host.items()):
            self._courier.send(host, encode(together, self._parameters.payload))

    def _count(self, entries: Iterable[Entry]) -> None:
        """Record graph messages by iteration; 0 is the growing of trees."""
        by_iteration: dict[int, list[Entry]] = {}
        for entry in entries:
            self._counts[_PHASES[type(entry.body)]] += 1
            number = 0 if isinstance(entry.body, Wave | Next | Go) else entry.body.iteration
            by_iteration.setdefault(number, []).append(entry)
        for number, together in sorted(by_iteration.items()):
            self._node.record(
                GraphMessages(
                    node=self._node.id,
                    round=number,
                    source=[entry.source for entry in together],
                    destination=[entry.destination for entry in together],
                    remote=[int(self._hosts[entry.destination] != self._node.id) for entry in together],
                    computed=len(together),
                    largest_change=1.0,  # every message is needed
                    is_synchronous=0,
                    late_ns=0,
                )
            )

    def report(self) -> None:
        """Record decisions, what was proved and what it took."""
        for vertex_id, hosted in sorted(self._vertices.items()):
            self._report_outcome(hosted)
            self._report_state(vertex_id, hosted)
        for vertex_id, hosted in sorted(self._vertices.items()):
            parents = [place.parent for place in hosted.builder.places]
            self._note("trmp_parents", {"vertex": vertex_id, "parents": parents})
        self._note("trmp_messages", {phase: self._counts[phase] for phase in sorted(set(_PHASES.values()))})

    def _report_outcome(self, hosted: _Vertex) -> None:
        inference, vertex = hosted.inference, hosted.vertex.id
        if inference is None or not hosted.is_finished:
            fields = {"vertex": vertex, "has_trees": inference is not None}
            self._note("trmp_unfinished", fields)
        elif inference.is_root and inference.verdict is not None:
            fields = {
                "root": vertex,
                "vertices": hosted.builder.component_size,
                "trees": len(hosted.builder.places),
                "iterations": inference.iteration,
                "proved": inference.verdict.proved,
            }
            self._note("trmp_component", fields)

    def _report_state(self, vertex_id: int, hosted: _Vertex) -> None:
        vertex, inference = hosted.vertex, hosted.inference
        state = vertex.choice({}).state if inference is None else inference.choice.state
        number = 0 if inference is None else inference.iteration
        if isinstance(vertex, SensorVertex):
            self._node.record(Association(self._node.id, list(state), number))
        elif not isinstance(vertex, FactorVertex | TargetVertex):
            weights = {} if inference is None else inference.weights
            marginal = vertex.belief(weights, Semiring.MAX)
            self._node.record(Marginals(self._node.id, vertex_id, np.exp(marginal), number, 1))

    def _note(self, kind: str, fields: Mapping[str, object]) -> None:
        self._node.record(AlgorithmRecord(self._node.id, kind, json.dumps(fields)))
