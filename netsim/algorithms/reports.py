"""What a node of message passing puts into the trace: its graph messages, and what it believes after each round."""

from collections.abc import Collection, Mapping

import numpy as np

from netsim.algorithms.hosted import Hosted
from netsim.algorithms.message_passing_parameters import MessagePassingParameters
from netsim.api import NodeHandle
from netsim.kernels.communication import RoundOutput
from netsim.kernels.factor_vertices import FactorVertex
from netsim.kernels.listed_vertex import ListedVertex
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.kernels.vertex import Vertex
from netsim.trace.events import Association, GraphMessages, Marginals


class Reports:
    """Records for one node.

    Args:
        node: The node.
        hosted: What it hosts.
        parameters: Of the algorithm.
        semiring: Max-product or sum-product.
    """

    def __init__(
        self, node: NodeHandle, hosted: Hosted, parameters: MessagePassingParameters, semiring: Semiring
    ) -> None:
        self._node = node
        self._hosted = hosted
        self._parameters = parameters
        self._semiring = semiring

    def messages(
        self, number: int, outputs: Mapping[int, RoundOutput], edges: Collection[tuple[int, int]], late_ns: int
    ) -> None:
        """Record the graph messages of a round.

        Args:
            number: The round.
            outputs: What each vertex computed in it.
            edges: (Source, destination) of what was sent.
            late_ns: By how much the node came late to the round.
        """
        if not outputs:
            return
        hosts = self._hosted.hosting.hosts
        self._node.record(
            GraphMessages(
                node=self._node.id,
                round=number,
                source=[source for source, _ in edges],
                destination=[to for _, to in edges],
                remote=[int(hosts[to] != self._node.id) for _, to in edges],
                computed=sum(output.computed for output in outputs.values()),
                largest_change=max(output.largest_change for output in outputs.values()),
                is_synchronous=int(self._parameters.schedule == "synchronous"),
                late_ns=late_ns,
            )
        )

    def beliefs(self, number: int) -> None:
        """Record what the node believes after a round."""
        for vertex_id, sender in sorted(self._hosted.senders.items()):
            vertex: Vertex = sender.vertex
            incoming = self._hosted.incoming[vertex_id]
            if isinstance(vertex, SensorVertex):
                decision = vertex.decide(incoming, self._semiring)
                self._node.record(Association(self._node.id, decision.tolist(), number))
                if number == self._parameters.rounds:
                    self._origins(vertex, incoming)
            elif not isinstance(vertex, FactorVertex | ListedVertex):
                belief = np.exp(vertex.belief(incoming, self._semiring))
                is_max = int(self._semiring is Semiring.MAX)
                self._node.record(Marginals(self._node.id, vertex_id, belief, number, is_max))

    def _origins(self, vertex: SensorVertex, incoming: Mapping[int, FloatArray]) -> None:
        """Record where a sensor believes in the end that its measurements came from; max-product has only its decision."""
        if self._semiring is Semiring.SUM and vertex.measurement_count:
            belief = np.exp(vertex.belief(incoming, self._semiring))
            self._node.record(Marginals(self._node.id, vertex.id, belief, self._parameters.rounds, 0))
