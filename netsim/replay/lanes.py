"""The radio time line: what every node's radio does, from frames, the radios' own announcements, and crashes."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, timed
from netsim.trace.events import OUTCOME_CODE, OUTCOMES, RADIO_STATES, Frame, NodeLife, RadioState

_FAILED_RECEPTIONS = ("collided", "captured", "jammed", "outage", "corrupted")
_STATES = (*RADIO_STATES, *_FAILED_RECEPTIONS, "crashed")
_CODE = {name: code for code, name in enumerate(_STATES)}
_NAMES = np.array(_STATES)
# State of a listener while it takes in a frame of each outcome; -1 where its radio did not.
_STATE_OF_OUTCOME = np.full(len(OUTCOMES), -1)
for _name in ("received", "overheard"):
    _STATE_OF_OUTCOME[OUTCOME_CODE[_name]] = _CODE["receive"]
for _name in _FAILED_RECEPTIONS:
    _STATE_OF_OUTCOME[OUTCOME_CODE[_name]] = _CODE[_name]
_LIFE_STATES = {"rebooted": _CODE["listen"], "crashed": _CODE["crashed"]}

_States = tuple[NDArray[np.integer], NDArray[np.int64], NDArray[np.int64]]
"""Node, instant and state as columns."""


class LaneTrack:
    """One lane a node: transmit and receive from the frames, sleep and death as announced."""

    topics = (Frame.topic, RadioState.topic, NodeLife.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._announced: list[_States] = []
        self._lives: list[tuple[int, int, int]] = []
        self._left = _Left()
        self._begun = False
        self._transmissions = np.zeros(len(setting.scene.place), np.int64)

    def busiest(self) -> list[str]:
        """The entities of all lanes, those of the nodes that transmitted most first."""
        rows = np.flatnonzero(self._setting.shown)
        order = rows[np.argsort(-self._transmissions[rows], kind="stable")]
        return [self._entity(row) for row in order.tolist()]

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Frames at once; announcements are kept for the end, so that they prevail over a frame that ends just then."""
        if not self._begun:
            self._begun = True
            yield from self._beginning()
        if batch.topic == RadioState.topic:
            self._announced.append((batch.numbers("node"), batch.time_ns, batch.numbers("state").astype(np.int64)))
        elif batch.topic == NodeLife.topic:
            parts = zip(batch.numbers("node").tolist(), batch.time_ns.tolist(), batch.texts("event"), strict=True)
            self._lives += [(node, at_ns, _LIFE_STATES[event]) for node, at_ns, event in parts if event in _LIFE_STATES]
        else:
            row = self._setting.scene.rows(batch.numbers("source")[batch.time_ns >= self._setting.pace.start_ns])
            self._transmissions += np.bincount(row[row >= 0], minlength=len(self._transmissions))
            states = _frame_states(batch)
            self._left.add(*_left_receptions(batch))
            self._left.follow(states, int(batch.numbers("t_start_ns").min()))
            yield from self._lanes(*states)

    def finish(self) -> Iterator[Chunk]:
        """The announcements; at one instant those of crashes prevail, and those of reboots yield."""
        up, down = (
            [life for life in self._lives if (life[2] == _CODE["crashed"]) == is_crash] for is_crash in (False, True)
        )
        announced = _joined([_columns(up), *self._announced, _columns(down)])
        self._left.follow(announced, 0)
        yield from self._lanes(*_joined([self._left.ends(), announced]))

    def _entity(self, row: int) -> str:
        return entity("radio", self._setting.scene.nodes.name[row])

    def _beginning(self) -> Iterator[Chunk]:
        values = list(_STATES)
        colours = [style.RADIO_COLOURS[name] for name in values]
        start = np.array([self._setting.pace.start_ns], np.int64)
        for row in np.flatnonzero(self._setting.shown).tolist():
            yield static(self._entity(row), rr.StateConfiguration(values=values, labels=values, colors=colours))
            yield timed(self._entity(row), start, rr.StateChange.columns(state=["listen"]))

    def _lanes(
        self, node: NDArray[np.integer], time_ns: NDArray[np.int64], state: NDArray[np.int64]
    ) -> Iterator[Chunk]:
        """One chunk a node that has something new; rows of one instant keep the order in which they come."""
        row = self._setting.scene.rows(node)
        order = np.lexsort((time_ns, row))
        order = order[(row[order] >= 0) & self._setting.shown[row[order]]]
        row, time_ns, state = row[order], time_ns[order], state[order]
        keep = self._holds(row, time_ns)
        row, time_ns, state = row[keep], np.maximum(time_ns[keep], self._setting.pace.start_ns), state[keep]
        starts = np.flatnonzero(np.diff(row, prepend=-1))
        for begin, end in pairwise([*starts, len(row)]):
            names = rr.StateChange.columns(state=list(_NAMES[state[begin:end]]))
            yield timed(self._entity(row[begin]), time_ns[begin:end], names)

    def _holds(self, row: NDArray[np.int64], time_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
        """What is in the window, and each node's last state before it."""
        old = time_ns < self._setting.pace.start_ns
        followed = np.append((row[1:] == row[:-1]) & old[1:], False)
        return np.asarray(~(old & followed[: len(old)]))


class _Left:
    """Receptions left for a stronger frame, of which nothing is known to have followed before the frame's own end."""

    def __init__(self) -> None:
        self._open: list[tuple[int, int, int]] = []  # node, start, end
        self._over: list[tuple[int, int, int]] = []

    def add(self, node: NDArray[np.integer], begin_ns: NDArray[np.int64], end_ns: NDArray[np.int64]) -> None:
        self._open += zip(node.tolist(), begin_ns.tolist(), end_ns.tolist(), strict=True)

    def follow(self, states: _States, since_ns: int) -> None:
        """Forget those that these states follow; no state of before `since_ns` is among them."""
        if since_ns:
            self._over += [left for left in self._open if left[2] < since_ns]
            self._open = [left for left in self._open if left[2] >= since_ns]
        else:
            self._open, self._over = self._open + self._over, []
        if self._open:
            node, time_ns, _ = states
            order = np.lexsort((time_ns, node))
            node, time_ns = node[order], time_ns[order]
            self._open = [left for left in self._open if not _followed(node, time_ns, *left)]

    def ends(self) -> _States:
        """They end with the frame."""
        return _columns([(node, end_ns, _CODE["listen"]) for node, _, end_ns in self._open + self._over])


def _followed(
    sorted_node: NDArray[np.integer], time_ns: NDArray[np.int64], node: int, begin_ns: int, end_ns: int
) -> bool:
    """Whether the node does something after the begin and up to the end; sorted by node, then by time."""
    first, last = np.searchsorted(sorted_node, [node, node + 1])
    times = time_ns[first:last]
    return bool(np.searchsorted(times, end_ns, "right") > np.searchsorted(times, begin_ns, "right"))


def _joined(parts: list[_States]) -> _States:
    node, time_ns, state = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return node, time_ns, state


def _columns(lives: list[tuple[int, int, int]]) -> _States:
    node, time_ns, state = np.array(lives, np.int64).reshape(-1, 3).T
    return node, time_ns, state


def _frame_states(batch: Batch) -> _States:
    """Node, instant and state of every start and end of a transmission or reception; ends come first.

    A reception that was left for a stronger frame has no end of its own: the other frame's follows.
    """
    begin_ns, end_ns = batch.numbers("t_start_ns"), batch.numbers("t_end_ns")
    listener, lengths = batch.rows("rx_node")
    receiving = _STATE_OF_OUTCOME[batch.rows("rx_outcome")[0]]
    locked = receiving >= 0
    frame = np.repeat(np.arange(len(lengths)), lengths)[locked]
    node = np.concatenate([batch.numbers("source"), listener[locked]]).astype(np.int64)
    state = np.concatenate([np.full(len(begin_ns), _CODE["transmit"]), receiving[locked]])
    ends_ns = np.concatenate([end_ns, end_ns[frame]])
    ends = state != _CODE["captured"]
    return (
        np.concatenate([node[ends], node]),
        np.concatenate([ends_ns[ends], begin_ns, begin_ns[frame]]),
        np.concatenate([np.full(int(ends.sum()), _CODE["listen"]), state]),
    )


def _left_receptions(batch: Batch) -> _States:
    """Node, start and end of each frame that a listener left for a stronger one."""
    listener, lengths = batch.rows("rx_node")
    left = batch.rows("rx_outcome")[0] == OUTCOME_CODE["captured"]
    frame = np.repeat(np.arange(len(lengths)), lengths)[left]
    return listener[left], batch.numbers("t_start_ns")[frame], batch.numbers("t_end_ns")[frame]
