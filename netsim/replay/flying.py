"""Which frame flies from whom to whom and how it is shown: the rules for arrows, without a viewer.

A frame to one node is shown on its way to that node. A broadcast is shown to those that received it, that lost it to
interference, or that should have heard it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from netsim.replay import style
from netsim.replay.flights import Flights, Ints, Rows
from netsim.replay.motion import Motion, Places
from netsim.trace.events import BROADCAST, OUTCOME_CODE, OUTCOMES, LinkTable

LOST, INTERFERED, LOST_ACKS, ACKS, FIRST_KIND = range(5)
"""Layers; each message kind has two from `FIRST_KIND` on, the second one for broadcasts."""
INTERFERENCE = tuple(OUTCOME_CODE[name] for name in style.INTERFERENCE)
"""Outcomes of frames that were lost to another signal."""
UNHEARD = len(OUTCOMES)
"""Outcome of a frame whose addressee was no listener at all."""
_ALWAYS_SHOWN = (OUTCOME_CODE["received"], *INTERFERENCE)
_LOSS_REACH = 0.6  # lost frames stop on the way


@dataclass(frozen=True)
class Frames:
    """Frames as columns, with their listeners in a row.

    Attributes:
        start_ns: Start of each transmission.
        source: Id of the sender.
        destination: Id of the next hop, or `BROADCAST`.
        kind: Number of the message kind; -1 for kinds that are not wanted.
        carries_nothing: Whether it is an acknowledgement or a wake-up frame.
        lengths: How many listeners each frame has.
        listener: Ids of the listeners of all frames in turn.
        outcome: What became of it at each listener.
    """

    start_ns: Ints
    source: Ints
    destination: Ints
    kind: Ints
    carries_nothing: NDArray[np.bool_]
    lengths: Ints
    listener: Ints
    outcome: Ints


@dataclass(frozen=True)
class Audience:
    """Who can be shown sending and listening.

    Attributes:
        rows: Rows of the node table for node ids; -1 for unknown ones.
        shown: Whether each row is to be shown.
        good_links: See `good_links`.
    """

    rows: Callable[[NDArray[np.integer]], Ints]
    shown: NDArray[np.bool_]
    good_links: Ints

    def flights(self, frames: Frames) -> Flights:
        """The flights of some frames that are to be shown, in the order of the frames."""
        frame, listener, outcome = _ways(frames)
        destination = frames.destination[frame]
        unicast = destination != BROADCAST
        tail, head = self.rows(frames.source)[frame], self.rows(listener)
        layer = _layers(frames, frame, outcome)
        addressed = ~unicast | (listener == destination)
        meant = addressed & (unicast | self._missed(tail, head, outcome))
        flights = Flights(frames.start_ns[frame], layer, tail, head, outcome)
        return flights.pick(meant & (layer >= 0) & self._visible(tail, head))

    def _missed(self, tail: Ints, head: Ints, outcome: Ints) -> NDArray[np.bool_]:
        """Broadcasts to show: those received, those lost to interference, and those lost over a good link."""
        key = tail * len(self.shown) + head
        return np.isin(outcome, _ALWAYS_SHOWN) | np.isin(key, self.good_links)

    def _visible(self, tail: Ints, head: Ints) -> NDArray[np.bool_]:
        return (tail >= 0) & (head >= 0) & (self.shown[tail] | self.shown[head])


def _ways(frames: Frames) -> tuple[Ints, Ints, Ints]:
    """Number of the frame, listener and outcome of every way; an addressee that did not listen is told of too."""
    frame = np.repeat(np.arange(len(frames.lengths)), frames.lengths)
    heard = np.zeros(len(frames.lengths), bool)
    heard[frame[frames.listener == frames.destination[frame]]] = True
    unheard = np.flatnonzero((frames.destination != BROADCAST) & ~heard)
    listener = np.concatenate([frames.listener, frames.destination[unheard]])
    outcome = np.concatenate([frames.outcome, np.full(len(unheard), UNHEARD)])
    return np.concatenate([frame, unheard]), listener, outcome


def _layers(frames: Frames, frame: Ints, outcome: Ints) -> Ints:
    """The layer of each flight; -1 for kinds that are not wanted."""
    kind, carries_nothing = frames.kind[frame], frames.carries_nothing[frame]
    lost = np.where(carries_nothing, LOST_ACKS, np.where(np.isin(outcome, INTERFERENCE), INTERFERED, LOST))
    broadcast = frames.destination[frame] == BROADCAST
    arrived = np.where(carries_nothing, ACKS, FIRST_KIND + 2 * kind + broadcast)
    layer = np.where(outcome == OUTCOME_CODE["received"], arrived, lost)
    return np.where(kind >= 0, layer, -1)


def good_links(links: LinkTable | None, rows: Callable[[NDArray[np.integer]], Ints], motion: Motion) -> Ints:
    """Links worth expecting something of, each as row of its source times the number of nodes plus row of its end.

    Those of nodes that move are known for the start only, so nothing is expected of them.
    """
    if links is None:
        return np.empty(0, np.int64)
    source, destination = (rows(np.asarray(ids)) for ids in (links.source, links.destination))
    moving = motion.moving
    good = (np.asarray(links.prr) >= style.EXPECTED_PRR) & ~moving[source] & ~moving[destination]
    return np.asarray((source * len(motion.start) + destination)[good])


def shafts(motion: Motion, radius_m: float, rows: Rows) -> tuple[Places, Places]:
    """Origins and vectors: from rim to rim, a little aside of the line so that both directions are seen.

    The ends are where the nodes were when the frame began.
    """
    begun_ns = rows.flights.start_ns
    origin, target = (motion.places(row, begun_ns) for row in (rows.flights.tail, rows.flights.head))
    way = target - origin
    distance = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    unit = way / distance
    gap = np.minimum(1.3 * radius_m, 0.3 * distance)
    aside = 0.3 * radius_m * np.column_stack([-unit[:, 1], unit[:, 0]])
    reach = rows.reach * (_LOSS_REACH if rows.layer < ACKS else 1.0)
    return origin + unit * gap + aside, unit * (distance - 2 * gap) * reach[:, None]
