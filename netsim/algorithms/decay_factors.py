"""Factors between nodes: Oh 2010, Algorithm 4, over one list of vertices that travels with the request.

A node multiplies the factors of the vertices it owns, as long as they stand first in the list, and sends the rest of the
list, with all that is removed by then, to the owner of the next; the product comes back the way the request went. Requests
are served side by side: a node that waits for an answer serves others, so that they cannot wait for each other in a circle.
A request that stays without any sign of life is sent again; after some times the node stands in for the silent owner, with
what it knows itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from netsim.algorithms.decay_payload import (
    FactorRequest,
    VertexName,
    decode_answer,
    decode_request,
    encode_answer,
    encode_request,
)
from netsim.api import Message, NodeHandle, NoEnergyError, Op
from netsim.kernels.correlation_decay import DecayGraph

FACTORS = "factors"
PRODUCT = "product"
WORKING = "working"
_ATTEMPTS = 3
_NUMBERS = 1 << 31


def charge(node: NodeHandle, operations: int) -> Op[None]:
    """Occupy the CPU; what the node's energy allowance refuses is computed all the same, and said so."""
    try:
        yield from node.compute(operations)
    except NoEnergyError:
        node.log("too little energy to compute: it is charged to nobody")


@dataclass(frozen=True, eq=False)
class NamedGraph:
    """What a node knows of the association graph, by names that all nodes share.

    Attributes:
        graph: The graph.
        vertices: Its vertices by their names.
    """

    graph: DecayGraph
    vertices: Mapping[VertexName, int]

    def factor(self, name: VertexName, removed: Sequence[VertexName], depth: int) -> float:
        """Phi of a vertex; 1 for one of which no edge is known."""
        vertex = self.vertices.get(name)
        gone = [self.vertices[each] for each in removed if each in self.vertices]
        return 1.0 if vertex is None else self.graph.factor(vertex, depth, gone)


class Factors:
    """A node's part in products of factors, its own and others'.

    Args:
        node: The node.
        known: What it knows of the graph.
        depth: t.
        request_ns: How long it waits for a sign of life.
    """

    def __init__(self, node: NodeHandle, known: NamedGraph, depth: int, request_ns: int) -> None:
        self._node, self._known, self._depth, self._request_ns = node, known, depth, request_ns
        self._next = int(node.rng("factors").integers(_NUMBERS))  # other numbers than before a reboot
        self._served: dict[tuple[int, int], float | None] = {}
        self.requests = 0
        """Requests sent, repetitions left out."""
        self.stood_in = 0
        """Vertices whose owner stayed silent."""
        self.most_open = 0
        """Most requests of others that were open at once."""

    def product(self, removed: Sequence[VertexName], vertices: Sequence[VertexName]) -> Op[float]:
        """prod_i Phi_{G without removed, v_1 .. v_{i-1}}(v_i, t), with the owners' help."""
        product, gone, before = 1.0, list(removed), self._known.graph.operations
        for index, name in enumerate(vertices):
            if name.owner != self._node.id:
                yield from charge(self._node, self._known.graph.operations - before)
                rest = yield from self._ask(name.owner, gone, vertices[index:])
                if rest is not None:
                    return product * rest
                self.stood_in += 1
                before = self._known.graph.operations
            product *= self._known.factor(name, gone, self._depth)
            gone.append(name)
        yield from charge(self._node, self._known.graph.operations - before)
        return product

    def _ask(self, owner: int, removed: Sequence[VertexName], vertices: Sequence[VertexName]) -> Op[float | None]:
        """The rest of a chain from the owner of its first vertex; None if it gives no sign of life."""
        node, number = self._node, self._next
        self._next += 1
        self.requests += 1
        payload = encode_request(FactorRequest(number, tuple(removed), tuple(vertices)))

        def is_ours(message: Message) -> bool:
            return message.source == owner and decode_answer(message.payload)[0] == number

        silences = 0
        while silences < _ATTEMPTS:
            node.send(owner, FACTORS, payload, causes=())
            message = yield from node.receive(kinds={PRODUCT, WORKING}, match=is_ours, timeout_ns=self._request_ns)
            silences = silences + 1 if message is None else 0
            while message is not None and message.kind == WORKING:
                message = yield from node.receive(kinds={PRODUCT, WORKING}, match=is_ours, timeout_ns=self._request_ns)
            if message is not None:
                return decode_answer(message.payload)[1]
        node.log(f"node {owner} does not answer a request for factors: standing in for it")
        return None

    def serve(self, request: Message) -> None:
        """Begin to work on another node's request; one that came before is answered again, or with a sign of life."""
        number = decode_request(request.payload).number
        key = request.source, number
        if key not in self._served:
            self._served[key] = None
            self.most_open = max(self.most_open, sum(product is None for product in self._served.values()))
            self._node.spawn(self._work(request))
            return
        product = self._served[key]
        kind = WORKING if product is None else PRODUCT
        self._node.send(request.source, kind, encode_answer(number, product or 0.0), causes=[request])

    def _work(self, message: Message) -> Op[None]:
        request = decode_request(message.payload)
        product = yield from self.product(request.removed, request.vertices)
        self._served[message.source, request.number] = product
        self._node.send(message.source, PRODUCT, encode_answer(request.number, product), causes=[message])
