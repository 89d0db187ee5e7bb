"""`selection: all`: at every step all neighbours sense too and send the leader their readings, who uses them all.

What information-driven selection saves is measured against it. The leader names its neighbours in a broadcast `query`; each
senses, and answers with a `reading` at a random time, so that they do not all speak at once. What has not come in time is
left out.
"""

import math
import struct
from collections.abc import Callable, Collection, Mapping
from typing import Final

from netsim.algorithms.idsq_station import Station
from netsim.algorithms.tracking_readings import STEPS, decode_reading, encode_reading, own_reading
from netsim.api import Message, Op
from netsim.codec import Record
from netsim.kernels.fusion import likelihoods_operations, updated_by
from netsim.kernels.gating import tail_operations
from netsim.kernels.grid_belief import GridBelief
from netsim.units import s_to_ns

QUERY: Final = "query"
READING: Final = "reading"
ANSWERED_BY: Final = 0.5
"""Nodes answer within this share of the time that the leader waits; the rest is for retries."""
WIDTH: Final = "float32"
"""Precision of readings on the air."""
_STEP = Record("H")  # modulo 65,536
_NODE = Record("H")


class Neighbourhood:
    """A leader's neighbours as further sensors, and this node as one of another leader's.

    Args:
        station: This node.
    """

    def __init__(self, station: Station) -> None:
        self._station = station

    def ask(self, step: int) -> tuple[int, ...]:
        """Ask all neighbours for their readings; returns who was asked: nobody under another rule of selection."""
        station = self._station
        if station.parameters.selection != "all":
            return ()
        asked = station.knowledge.neighbours(station.sensor.position_m)
        if asked:
            station.node.broadcast(QUERY, encode_query(step, asked))
        return asked

    def answers(self, step: int, asked: Collection[int]) -> Op[dict[int, float]]:
        """The readings of those asked that come in time."""
        station, told = self._station, dict[int, float]()
        until_ns = station.node.now_ns + s_to_ns(station.parameters.gather_s)
        while len(told) < len(asked):
            left_ns = max(0, until_ns - station.node.now_ns)
            message = yield from station.node.receive(kinds={READING}, match=_answers(step, asked), timeout_ns=left_ns)
            if message is None:
                break
            told[message.source] = decode_reading(message.payload, WIDTH)[1]
        return told

    def updated(
        self, predicted: GridBelief, readings: Mapping[int, float], *, gated: bool
    ) -> Op[tuple[GridBelief, bool]]:
        """The belief after the readings of this node and its neighbours, and whether its own was used.

        What the processor is charged for is what the neighbours' readings add.
        """
        station, me = self._station, self._station.node.id
        sensors = {**station.knowledge.others, me: station.sensor}
        others = {node: reading for node, reading in readings.items() if node != me}
        cells, gates = len(predicted.cells), station.filtering.gate > 0.0
        gating = sum(tail_operations(cells, sensors[node]) for node in others) if gates else 0
        yield from station.node.compute(gating + likelihoods_operations(predicted, sensors, others))
        belief, used = updated_by(predicted, sensors, readings, station.filtering, gated=gated)
        return belief, me in used

    def heed(self, query: Message) -> None:
        """Sense for a leader that asks this node, and send it the reading.

        Raises:
            struct.error: For a query that makes no sense.
        """
        step, asked = decode_query(query.payload)
        if self._station.node.id in asked:
            self._station.node.spawn(self._answer(step, query.source))

    def _answer(self, step: int, leader: int) -> Op[None]:
        station, node = self._station, self._station.node
        with station.waking.needed():
            reading = yield from own_reading(node, station.knowledge)
            if reading is not None and not math.isnan(reading):
                wait_s = ANSWERED_BY * station.parameters.gather_s * float(node.rng("answer").random())
                yield from node.pause(s_to_ns(wait_s))
                station.answer(leader, READING, encode_reading(step, reading, WIDTH))


def _answers(step: int, asked: Collection[int]) -> Callable[[Message], bool]:
    def fits(message: Message) -> bool:
        try:
            code, _ = decode_reading(message.payload, WIDTH)
        except (ValueError, struct.error):
            return False
        return message.source in asked and code == step % STEPS

    return fits


def encode_query(step: int, asked: Collection[int]) -> bytes:
    """Which reading is asked for, and of whom."""
    return _STEP.pack(step % STEPS) + b"".join(_NODE.pack(node) for node in asked)


def decode_query(data: bytes) -> tuple[int, tuple[int, ...]]:
    """Step, modulo 65,536, and who is asked.

    Raises:
        struct.error: If it is too short.
    """
    (step,) = _STEP.unpack(data)
    return int(step), tuple(int(_NODE.unpack(data, at)[0]) for at in range(_STEP.size_byte, len(data), _NODE.size_byte))
