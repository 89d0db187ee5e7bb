"""Plain traffic: each node regularly tells every neighbour something. It exercises radio, MAC and battery."""

from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.api import NodeHandle, Op
from netsim.parameters import Positive, PositiveInt, parameters
from netsim.units import s_to_ns

PING = "ping"


@parameters
class NeighbourTrafficParameters:
    """Each node, once a period at its own random phase, sends one message to each of those nearest to it then."""

    type: Literal["neighbour-traffic"] = "neighbour-traffic"
    period_s: Positive = 1.0
    """Time between a node's bursts."""
    payload_byte: Annotated[int, Ge(0), Le(100_000)] = 50
    """Size of each message."""
    neighbours: PositiveInt = 4
    """How many of the neighbours that it knows at that moment are told, the nearest first."""
    rounds: PositiveInt = 10
    """How many bursts."""


class NeighbourTraffic:
    """See `NeighbourTrafficParameters`."""

    def __init__(self, parameters: NeighbourTrafficParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        parameters = self._parameters
        period_ns = s_to_ns(parameters.period_s)
        phase_ns = int(node.rng("phase").random() * period_ns)
        for burst in range(parameters.rounds):
            if node.now_ns >= (burst + 1) * period_ns + phase_ns:
                continue  # the node was down in that period
            yield from node.pause_until(burst * period_ns + phase_ns)
            nearest = sorted(node.neighbours, key=lambda neighbour: (neighbour.distance_m, neighbour.id))
            for neighbour in sorted(neighbour.id for neighbour in nearest[: parameters.neighbours]):
                node.send(neighbour, PING, bytes(parameters.payload_byte))
        yield from node.pause_until((parameters.rounds + 1) * period_ns)
