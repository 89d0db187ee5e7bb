"""Delivery ratios that were measured, to be replayed: the chance of a frame on a link at a time, whatever the cause.

The rows of a K7 file are grouped into rounds: a sender's frames on a channel, and who received which share of them. A
listener without a row in a round received nothing. A round holds until the sender's next one, and the first one before it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from netsim.models.k7 import K7
from netsim.units import NS_PER_S

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class DeliveryRatios(Protocol):
    """What a trace says of the frames of one sender; interference comes on top."""

    def ratios(self, source: int, now_ns: int) -> Floats:
        """Chance that a frame of `source` sent now arrives, at each node it reaches (ascending by id, as its links)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Rounds:
    """One sender's measurements on one channel.

    Attributes:
        listeners: (L,) ids of the nodes that ever received something from it, ascending.
        start_s: (R,) start of each round in the recording, ascending.
        ratio: (R, L) share of the frames that arrived.
        rssi_dbm: (L,) received power: mean over the rounds in which something arrived, in dB. Frames that were lost are not
            in it, so poor links look stronger than they are.
    """

    listeners: Ints
    start_s: Floats
    ratio: Floats
    rssi_dbm: Floats

    def at(self, time_s: float) -> Floats:
        """(L,) ratios that hold at a time of the recording."""
        found: Floats = self.ratio[max(0, int(np.searchsorted(self.start_s, time_s, side="right")) - 1)]
        return found


def rounds_of(k7: K7, channel: int, nodes: Iterable[int]) -> dict[int, Rounds]:
    """The measurements of every sender that was ever heard on a channel, among some nodes.

    A row belongs to its sender's running round unless it begins more than twice a round's length after the round's first
    row, or its listener is in the round already (rows of a round are not all stamped with one instant).

    Args:
        k7: The recording.
        channel: Which channel.
        nodes: Ids of the senders and listeners that count.
    """
    known = np.fromiter(nodes, np.int64)
    counts = (k7.channel == channel) & np.isin(k7.source, known) & np.isin(k7.destination, known)
    counts &= k7.source != k7.destination
    rows = np.flatnonzero(counts)
    rows = rows[np.lexsort((k7.destination[rows], k7.time_s[rows], k7.source[rows]))]
    senders, first = np.unique(k7.source[rows], return_index=True)
    parts = np.split(rows, first[1:]) if len(rows) else []
    power_dbm = k7.power_dbm()
    return {int(sender): _rounds(k7, power_dbm, part) for sender, part in zip(senders, parts, strict=True)}


def _rounds(k7: K7, power_dbm: Floats, rows: NDArray[np.intp]) -> Rounds:
    """The rounds of one sender's rows, ascending by time."""
    starts: list[float] = []
    number = np.empty(len(rows), np.intp)
    present: set[int] = set()
    for place, (time_s, listener) in enumerate(
        zip(k7.time_s[rows].tolist(), k7.destination[rows].tolist(), strict=True)
    ):
        if not starts or time_s > starts[-1] + 2.0 * k7.round_s or listener in present:
            starts.append(time_s)
            present.clear()
        present.add(listener)
        number[place] = len(starts) - 1
    listeners, column = np.unique(k7.destination[rows], return_inverse=True)
    ratio = np.zeros((len(starts), len(listeners)))
    ratio[number, column] = k7.pdr[rows]
    rssi = np.bincount(column, power_dbm[rows]) / np.bincount(column)
    return Rounds(listeners, np.array(starts), ratio, rssi)


@dataclass(frozen=True, slots=True, eq=False)
class ReplayedRatios:
    """The rounds of a recording as simulated time goes by.

    Attributes:
        rounds: By sender.
        start_s: Time of the recording at simulated time 0.
        speed: Seconds of the recording in a simulated second.
        loop_s: Length after which the recording begins anew; None to hold its last rounds.
    """

    rounds: Mapping[int, Rounds]
    start_s: float = 0.0
    speed: float = 1.0
    loop_s: float | None = None

    def ratios(self, source: int, now_ns: int) -> Floats:
        """See `DeliveryRatios.ratios`."""
        rounds = self.rounds.get(source)
        if rounds is None:
            return np.empty(0)
        time_s = self.start_s + self.speed * (now_ns / NS_PER_S)
        return rounds.at(time_s if self.loop_s is None else time_s % self.loop_s)
