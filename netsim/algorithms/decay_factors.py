"""Factors between nodes: Oh 2010, Algorithm 4, over one list of vertices that travels with the request.

A node multiplies the factors of the vertices it owns, as long as they stand first in the list, and sends the rest of the
list, with all that is removed by then, to the owner of the next; the product comes back the way the request went. Requests
are served side by side: a node that waits for an answer serves others, so that they cannot wait for each other in a circle.
Who does not know yet what its factors depend on, since its part of the flood goes on, says that it will, and so does who has
to wait for others. A request that stays without any sign of life is sent again; after some times the node stands in for the
silent owner, with what it knows itself, and from then on until it hears from that owner.
"""

import struct
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from netsim.algorithms.charging import charge
from netsim.algorithms.decay_payload import (
    FactorRequest,
    VertexName,
    decode_answer,
    decode_request,
    encode_answer,
    encode_request,
)
from netsim.api import Message, NodeHandle, Op
from netsim.kernels.correlation_decay import DecayGraph
from netsim.kernels.scaled_product import Product

FACTORS = "factors"
PRODUCT = "product"
WORKING = "working"
_NUMBERS = 1 << 31


def _number_of(answer: Message) -> int | None:
    """The number of the request that is answered; None where that cannot be read."""
    try:
        return decode_answer(answer.payload)[0]
    except (ValueError, struct.error):
        return None


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
        others: Nodes that there are; messages that seem to come from others are ignored, and no others are asked.
        request_ns: How long it waits for a sign of life.
        attempts: How often it sends a request without one.
    """

    def __init__(self, node: NodeHandle, others: Collection[int], request_ns: int, attempts: int) -> None:
        self._node, self._others, self._request_ns, self._attempts = node, others, request_ns, attempts
        self._known: NamedGraph | None = None
        self._next = int(node.rng("factors").integers(_NUMBERS))  # other numbers than before a reboot
        self._served: dict[tuple[int, int], Product | None] = {}
        self._early: list[Message] = []
        self._silent: set[int] = set()
        self.requests = 0
        """Requests sent, repetitions left out."""
        self.stood_in = 0
        """Vertices whose owner stayed silent."""
        self.most_open = 0
        """Most requests of others that were open at once."""

    def begin(self, known: NamedGraph) -> None:
        """From now on the node knows the graph; begin with what was asked before."""
        self._known = known
        for request in self._early:
            self._node.spawn(self._work(known, request))
        self._early.clear()

    def product(
        self, known: NamedGraph, removed: Sequence[VertexName], vertices: Sequence[VertexName], depth: int
    ) -> Op[Product]:
        """prod_i Phi_{G without removed, v_1 .. v_{i-1}}(v_i, t), with the owners' help.

        Args:
            known: What the node knows of the graph.
            removed: Missing vertices.
            vertices: The list.
            depth: t.
        """
        product, gone, before = Product(), list(removed), known.graph.operations
        for index, name in enumerate(vertices):
            if name.owner != self._node.id:
                yield from charge(self._node, known.graph.operations - before)
                rest = yield from self._asked(name.owner, FactorRequest(0, depth, tuple(gone), tuple(vertices[index:])))
                if rest is not None:
                    return product.and_all_of(rest)
                self.stood_in += 1
                before = known.graph.operations
            product = product.times(known.factor(name, gone, depth))
            known.graph.operations += 1
            gone.append(name)
        yield from charge(self._node, known.graph.operations - before)
        return product

    def _asked(self, owner: int, request: FactorRequest) -> Op[Product | None]:
        """The rest of a chain from the owner of its first vertex; None if it gives no sign of life, now or before."""
        if owner in self._silent or owner not in self._others:
            return None
        product = yield from self._ask(owner, replace(request, number=self._next))
        if product is None:
            self._silent.add(owner)
            self._node.log(f"node {owner} does not answer a request for factors: standing in for it")
        return product

    def _ask(self, owner: int, request: FactorRequest) -> Op[Product | None]:
        node, number, payload = self._node, request.number, encode_request(request)
        self._next += 1
        self.requests += 1

        def is_ours(message: Message) -> bool:
            return message.source == owner and _number_of(message) == number

        silences = 0
        while silences < self._attempts:
            node.send(owner, FACTORS, payload, causes=())
            message = yield from node.receive(kinds={PRODUCT, WORKING}, match=is_ours, timeout_ns=self._request_ns)
            silences = silences + 1 if message is None else 0
            while message is not None and message.kind == WORKING:
                message = yield from node.receive(kinds={PRODUCT, WORKING}, match=is_ours, timeout_ns=self._request_ns)
            if message is not None:
                return decode_answer(message.payload)[1]
        return None

    def serve(self, request: Message) -> None:
        """Begin to work on another node's request; one that came before is answered again, or with a sign of life."""
        if request.source not in self._others:
            return
        try:
            number = decode_request(request.payload).number
        except (ValueError, struct.error) as error:
            self._node.log(f"a request of node {request.source} that cannot be read: {error}")
            return
        key = request.source, number
        self._silent.discard(request.source)
        if key not in self._served:
            self._served[key] = None
            self.most_open = max(self.most_open, sum(product is None for product in self._served.values()))
            if self._known is not None:
                self._node.spawn(self._work(self._known, request))
                self._node.spawn(self._show_life(request, number))
                return
            self._early.append(request)
        product = self._served[key]
        kind = WORKING if product is None else PRODUCT
        self._node.send(request.source, kind, encode_answer(number, product or Product()), causes=[request])

    def _show_life(self, request: Message, number: int) -> Op[None]:
        """Once, if the answer takes long; who asks again then hears it again."""
        yield from self._node.pause(self._request_ns // 2)
        if self._served[request.source, number] is None:
            self._node.send(request.source, WORKING, encode_answer(number, Product()), causes=[request])

    def _work(self, known: NamedGraph, message: Message) -> Op[None]:
        request = decode_request(message.payload)
        product = yield from self.product(known, request.removed, request.vertices, request.depth)
        self._served[message.source, request.number] = product
        self._node.send(message.source, PRODUCT, encode_answer(request.number, product), causes=[message])
