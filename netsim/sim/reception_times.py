"""How long receivers spent on which frames, for the ledger.

Radios that draw other power while they receive, or whose every state is recorded, are told of each reception as it begins
and ends. For the others the times are only summed up, in arrays over the nodes, and taken from their listening time when
somebody asks: the same figures for less work.
"""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from netsim.sim.air import label_of
from netsim.sim.frames import Transmission
from netsim.sim.radio import Radio
from netsim.sim.signals import Indices, Ints
from netsim.trace.events import BROADCAST


class ReceptionTimes:
    """See the module.

    Args:
        radios: The radios by array index; None where none has joined yet.
    """

    def __init__(self, radios: Sequence[Radio | None]) -> None:
        size = len(radios)
        self._radios = radios
        self._follows = np.zeros(size, bool)
        self._heard_ns: defaultdict[tuple[str, str], Ints] = defaultdict(lambda: np.zeros(size, np.int64))

    def join(self, index: int, radio: Radio) -> None:
        """A radio takes part."""
        self._follows[index] = radio.follows_receptions

    def begun(self, listeners: Indices) -> None:
        """Receivers locked on a frame."""
        for index in listeners[self._follows[listeners]].tolist():
            self._radio(index).locked()

    def broken(self, transmission: Transmission, index: int, node: int, now_ns: int) -> None:
        """A receiver left a frame before its end."""
        label, kind = label_of(transmission, node), transmission.frame.kind
        if self._follows[index]:
            self._radio(index).reception_broken(label, kind)
        else:
            self._heard_ns[label, kind][index] += now_ns - transmission.start_ns

    def ended(self, transmission: Transmission, listeners: Indices, nodes: Ints) -> None:
        """A frame is over at the receivers that were locked on it.

        Args:
            transmission: The frame.
            listeners: Their array indices.
            nodes: Their ids.
        """
        kind, time_ns = transmission.frame.kind, transmission.end_ns - transmission.start_ns
        follows = self._follows[listeners]
        for index, node in zip(listeners[follows].tolist(), nodes[follows].tolist(), strict=True):
            self._radio(index).reception_ended(label_of(transmission, node), kind)
        quiet, quiet_nodes = listeners[~follows], nodes[~follows]
        destination = transmission.frame.destination
        mine = (quiet_nodes == destination) | (destination == BROADCAST)
        if mine.any():
            self._heard_ns[label_of(transmission, int(quiet_nodes[mine][0])), kind][quiet[mine]] += time_ns
        self._heard_ns["overhear", kind][quiet[~mine]] += time_ns

    def settle(self, index: int) -> None:
        """Tell a radio what it heard since the last time."""
        for (label, kind), times_ns in self._heard_ns.items():
            if times_ns[index]:
                self._radio(index).heard(label, kind, int(times_ns[index]))
                times_ns[index] = 0

    def _radio(self, index: int) -> Radio:
        radio = self._radios[index]
        if radio is None:
            message = f"node at index {index} has not joined the medium"
            raise LookupError(message)
        return radio
