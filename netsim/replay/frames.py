"""Frames as growing arrows, one entity a message kind; what is lost goes to entities of its own, with the reason."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.flights import NO_FLIGHTS, Air, Flights, Rows
from netsim.replay.legend import Met
from netsim.replay.scene import Scene, static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, timed
from netsim.trace.events import BROADCAST, OUTCOME_CODE, OUTCOMES, Frame

_LOST, _INTERFERED, _LOST_ACKS, _ACKS, _FIRST_KIND = range(5)
_FIXED_LAYERS = ("/map/losses/lost", "/map/losses/interference", "/map/losses/acks", "/map/acks")
_INTERFERENCE = [OUTCOME_CODE[name] for name in style.INTERFERENCE]
_ALWAYS_SHOWN = [OUTCOME_CODE["received"], *_INTERFERENCE]
_UNHEARD = len(OUTCOMES)
_REASONS = np.array([name.replace("_", " ") for name in OUTCOMES] + ["out of reach"])
_LOSS_REACH = 0.6  # lost frames stop on the way
_WIDTHS = {
    _LOST: style.LOST_WIDTH,
    _INTERFERED: style.COLLIDED_WIDTH,
    _LOST_ACKS: style.ACK_WIDTH,
    _ACKS: style.ACK_WIDTH,
}
_COLOURS = {
    _LOST: style.LOST,
    _INTERFERED: style.COLLIDED,
    _LOST_ACKS: style.LOST,
    _ACKS: style.ACKNOWLEDGEMENT,
}
_MANY_LISTENERS = 0.4  # width of the arrows of one broadcast where they are many
_EXPLAINED = (_LOST, _INTERFERED)
_CROWDED = 0.5
_MOST_REASONS = 8  # of more losses at once the reasons are seen by pointing only


class FrameTrack:
    """Every frame to every listener that it was meant for."""

    topics = (Frame.topic,)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        pace = setting.pace
        self._air = Air(pace.start_ns, pace.tick_ns, pace.hold_ns)
        self._longest_ns = 0
        self._styled: set[int] = set()
        self._good_links = _good_links(setting.scene)
        self._interference: set[int] = set()
        self._has_strobes = False

    def met(self) -> Met:
        """What has been met of what the legend tells apart."""
        interference = [str(_REASONS[code]) for code in _INTERFERENCE if code in self._interference]
        return Met(self._setting.kinds.names, interference, self._has_strobes)

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Arrows of all ticks that no later frame can touch, taking none to be longer than those seen so far."""
        started_ns = batch.numbers("t_start_ns")
        self._longest_ns = max(self._longest_ns, int((batch.numbers("t_end_ns") - started_ns).max()))
        horizon_ns = int(batch.time_ns[-1]) - self._longest_ns
        for rows in self._air.advance(self._flights(batch), min(horizon_ns, self._setting.pace.end_ns)):
            yield from self._chunks(rows)

    def finish(self) -> Iterator[Chunk]:
        """The arrows of the last ticks."""
        pace = self._setting.pace
        for rows in self._air.advance(NO_FLIGHTS, pace.end_ns + pace.hold_ns + 2 * pace.tick_ns):
            yield from self._chunks(rows)

    def _flights(self, batch: Batch) -> Flights:
        listener, lengths = batch.rows("rx_node")
        frame = np.repeat(np.arange(len(lengths)), lengths)
        outcome = batch.rows("rx_outcome")[0].astype(np.int64)
        destination = batch.numbers("destination")
        unicast = destination != BROADCAST
        heard = np.zeros(len(lengths), bool)
        heard[frame[listener == destination[frame]]] = True
        unheard = np.flatnonzero(unicast & ~heard)
        frame = np.concatenate([frame, unheard])
        listener = np.concatenate([listener, destination[unheard]])
        outcome = np.concatenate([outcome, np.full(len(unheard), _UNHEARD)])
        tail = self._setting.scene.rows(batch.numbers("source"))[frame]
        head = self._setting.scene.rows(listener)
        layer = self._layers(batch, frame, outcome)
        addressed = ~unicast[frame] | (listener == destination[frame])
        meant = addressed & (unicast[frame] | self._missed(tail, head, outcome))
        flights = Flights(batch.numbers("t_start_ns")[frame], layer, tail, head, outcome)
        return flights.pick(meant & (layer >= 0) & self._visible(tail, head))

    def _layers(self, batch: Batch, frame: NDArray[np.int64], outcome: NDArray[np.int64]) -> NDArray[np.int64]:
        """The layer of each flight; -1 for kinds that are not wanted."""
        codes, words = batch.words("kind")
        kind = self._setting.kinds.numbers(words)[codes]
        strobes = batch.flags("is_strobe")
        self._has_strobes |= bool(strobes.any())
        carries_nothing = (batch.flags("is_ack") | strobes)[frame]
        lost = np.where(carries_nothing, _LOST_ACKS, np.where(np.isin(outcome, _INTERFERENCE), _INTERFERED, _LOST))
        broadcast = batch.numbers("destination")[frame] == BROADCAST
        arrived = np.where(carries_nothing, _ACKS, _FIRST_KIND + 2 * kind[frame] + broadcast)
        layer = np.where(outcome == OUTCOME_CODE["received"], arrived, lost)
        return np.where(kind[frame] >= 0, layer, -1)

    def _missed(
        self, tail: NDArray[np.int64], head: NDArray[np.int64], outcome: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Broadcasts to show: those received, those lost to interference, and those lost over a good link."""
        key = tail * len(self._setting.scene.place) + head
        return np.isin(outcome, _ALWAYS_SHOWN) | np.isin(key, self._good_links)

    def _visible(self, tail: NDArray[np.int64], head: NDArray[np.int64]) -> NDArray[np.bool_]:
        shown = self._setting.shown
        return (tail >= 0) & (head >= 0) & (shown[tail] | shown[head])

    def _chunks(self, rows: Rows) -> Iterator[Chunk]:
        path = self._entity(rows.layer)
        if rows.layer not in self._styled:
            self._styled.add(rows.layer)
            yield static(path, self._style(rows.layer))
            if rows.layer in _EXPLAINED:
                colour = _COLOURS[rows.layer]
                look = rr.Points2D.from_fields(
                    colors=[colour], radii=[0.0], show_labels=True, draw_order=style.ORDER["losses"]
                )
                yield static(f"{path}/reasons", look)
        origins, vectors = _shafts(self._setting.scene, rows)
        columns = rr.Arrows2D.columns(origins=origins, vectors=vectors).partition(rows.lengths)
        parts = list(columns)
        if rows.layer == _INTERFERED:
            self._interference |= set(np.unique(rows.flights.outcome).tolist())
        if rows.layer in _EXPLAINED:
            parts += rr.Arrows2D.columns(labels=list(_REASONS[rows.flights.outcome])).partition(rows.lengths)
        yield timed(path, rows.time_ns, parts)
        if rows.layer in _EXPLAINED and self._setting.scene.roomy:
            yield _reasons(rows, origins + vectors)

    def _entity(self, layer: int) -> str:
        if layer < _FIRST_KIND:
            return _FIXED_LAYERS[layer]
        kind, is_broadcast = divmod(layer - _FIRST_KIND, 2)
        path = entity("map", "messages", self._setting.kinds.names[kind])
        return f"{path}/broadcast" if is_broadcast else path

    def _style(self, layer: int) -> rr.Arrows2D:
        kind, is_broadcast = divmod(layer - _FIRST_KIND, 2)
        order = "messages" if layer >= _FIRST_KIND else "acks" if layer in (_ACKS, _LOST_ACKS) else "losses"
        below = layer >= _FIRST_KIND and is_broadcast
        width = _WIDTHS.get(layer, style.KIND_WIDTH) * (1.0 if self._setting.scene.roomy else _CROWDED)
        return rr.Arrows2D.from_fields(
            colors=[_COLOURS.get(layer) or self._setting.kinds.colour(kind)],
            radii=[width * (_MANY_LISTENERS if below and self._setting.scene.crowded else 1.0)],
            draw_order=style.ORDER[order] - (1.0 if below else 0.0),
            show_labels=False,
        )


def _reasons(rows: Rows, heads: NDArray[np.float64]) -> Chunk:
    """Why frames were lost, where their arrows end: one label a sender and row, none where there would be many.

    That a frame collided needs no label: what it collided with is seen.
    """
    row = np.repeat(np.arange(len(rows.lengths)), rows.lengths)
    told = np.flatnonzero(rows.flights.outcome != OUTCOME_CODE["collided"])
    senders = int(rows.flights.tail.max(initial=0)) + 1
    first = np.sort(told[np.unique((row * senders + rows.flights.tail)[told], return_index=True)[1]])
    first = first[(np.bincount(row[first], minlength=len(rows.lengths)) <= _MOST_REASONS)[row[first]]]
    labels = rr.Points2D.columns(positions=heads[first], labels=list(_REASONS[rows.flights.outcome[first]]))
    lengths = np.bincount(row[first], minlength=len(rows.lengths))
    return timed(f"{_FIXED_LAYERS[rows.layer]}/reasons", rows.time_ns, labels.partition(lengths))


def _good_links(scene: Scene) -> NDArray[np.int64]:
    """Links worth expecting something of, each as row of its source times the number of nodes plus row of its end.

    Those of nodes that move are known for the start only, so nothing is expected of them.
    """
    if scene.links is None:
        return np.empty(0, np.int64)
    source, destination = (scene.rows(np.asarray(ids)) for ids in (scene.links.source, scene.links.destination))
    moving = scene.motion.moving
    good = (np.asarray(scene.links.prr) >= style.EXPECTED_PRR) & ~moving[source] & ~moving[destination]
    return np.asarray((source * len(scene.place) + destination)[good])


def _shafts(scene: Scene, rows: Rows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origins and vectors: from rim to rim, a little to the right of the line so that both directions are seen.

    The ends are where the nodes were when the frame began.
    """
    begun_ns = rows.flights.start_ns
    origin, target = (scene.motion.places(row, begun_ns) for row in (rows.flights.tail, rows.flights.head))
    way = target - origin
    distance = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    unit = way / distance
    gap = np.minimum(1.3 * scene.radius_m, 0.3 * distance)
    aside = 0.3 * scene.radius_m * np.column_stack([-unit[:, 1], unit[:, 0]])
    reach = rows.reach * (_LOSS_REACH if rows.layer < _ACKS else 1.0)
    return origin + unit * gap + aside, unit * (distance - 2 * gap) * reach[:, None]
