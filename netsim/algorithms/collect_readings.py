"""Data collection: every node with a sensor reads it regularly and sends the reading to a sink."""

from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.codec import FloatWidth, encode_floats
from netsim.parameters import NonNegative, Positive, PositiveInt, parameters
from netsim.trace.events import AlgorithmRecord
from netsim.units import s_to_ns

READING = "reading"


@parameters
class CollectReadingsParameters:
    """Each node but the sinks, once a period at its own random phase, senses and sends what it read to a sink.

    Every node ends at the same time, whatever became of its messages, and records how many readings it sent and how many
    its link layer gave up; a sink records how many came from how many nodes. A reading for which the node's energy allowance
    does not suffice is left out, and so are those of periods in which the node was down.
    """

    type: Literal["collect-readings"] = "collect-readings"
    start_s: NonNegative = 10.0
    """When the first period begins: time for nodes to find each other."""
    period_s: Positive = 10.0
    """Time between a node's readings."""
    rounds: PositiveInt = 10
    """How many readings each node sends."""
    drain_s: NonNegative = 5.0
    """Time after the last period for what is under way."""
    padding_byte: Annotated[int, Ge(0), Le(10_000)] = 16
    """Bytes that each message carries besides the numbers the sensor gave (without a problem it gives none)."""
    payload: FloatWidth = "float32"
    """Precision of readings on the air."""


class CollectReadings:
    """See `CollectReadingsParameters`."""

    def __init__(self, parameters: CollectReadingsParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        parameters = self._parameters
        end_ns = s_to_ns(parameters.start_s + parameters.rounds * parameters.period_s + parameters.drain_s)
        if node.role == "sink":
            yield from self._take(node, end_ns)
        else:
            yield from self._report(node, end_ns)

    def _report(self, node: NodeHandle, end_ns: int) -> Op[None]:
        parameters = self._parameters
        period_ns = s_to_ns(parameters.period_s)
        phase_ns = s_to_ns(parameters.start_s) + int(node.rng("phase").random() * period_ns)
        tickets = []
        for number in range(parameters.rounds):
            if node.now_ns >= phase_ns + (number + 1) * period_ns:
                continue  # the node was down in that period
            yield from node.pause_until(phase_ns + number * period_ns)
            try:
                observation = yield from node.sense()
            except NoEnergyError:
                continue
            payload = encode_floats(observation.values.ravel(), parameters.payload) + bytes(parameters.padding_byte)
            tickets.append(node.send_to_sink(READING, payload))
        yield from node.pause_until(end_ns)
        refused = 0
        for ticket in tickets:
            delivery = yield from ticket.wait()
            refused += not delivery.acknowledged
        node.record(AlgorithmRecord(node.id, "readings_sent", f'{{"count": {len(tickets)}, "refused": {refused}}}'))

    def _take(self, node: NodeHandle, end_ns: int) -> Op[None]:
        sources: list[int] = []
        while (message := (yield from node.receive(kinds={READING}, timeout_ns=end_ns - node.now_ns))) is not None:
            sources.append(message.source)
        fields = f'{{"count": {len(sources)}, "sources": {len(set(sources))}}}'
        node.record(AlgorithmRecord(node.id, "readings_taken", fields))
