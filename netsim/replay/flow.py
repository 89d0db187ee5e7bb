"""The graphical model as a view of its own: who sends in each round, who fell silent, who wakes and after what.

Drawn at the end of the conversion, since a message's colour depends on whether its receiver wakes in the next round.
Where nodes count rounds of their own there are no common rounds, and the view is left out.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.flow.layout import GraphLayout, lay_out
from netsim.flow.rounds import Round, RoundLog, State, waking
from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import GraphMessages, TruthTargets

Ranges = tuple[tuple[float, float], tuple[float, float]]

_MAP = np.array([1.0, -1.0])  # 2-D views point y down
_MARK = 0.62  # diameter of a vertex, of the gap between vertices
_ROW = 1.3  # height of a line of text, in gaps
_LEGEND: tuple[tuple[State, str], ...] = (
    ("sends", "sends"),
    ("wakes", "wakes: sends again"),
    ("fell silent", "falls silent"),
    ("silent", "silent"),
)
_NAMED = 3
_MOST_LABELS = 150


class FlowTrack:
    """Collects the rounds; the view is made at the end."""

    topics = (GraphMessages.topic, TruthTargets.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._log = RoundLog()
        self._truth: TruthTargets | None = None
        self.bounds: Ranges | None = None
        """Ranges of x and y that show the whole view; None until it is made, and where there is nothing to show."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep the messages, and the first positions of targets."""
        if batch.topic == GraphMessages.topic:
            self._take_messages(batch)
        elif self._truth is None:
            target, lengths = batch.rows("target")
            first = slice(0, int(lengths[0]))
            self._truth = TruthTargets(target[first], batch.rows("x_m")[0][first], batch.rows("y_m")[0][first])
        yield from ()

    def _take_messages(self, batch: Batch) -> None:
        source, lengths = batch.rows("source")
        pairs = np.column_stack([source, batch.rows("destination")[0]]).astype(np.int64)
        stops = np.cumsum(lengths)[:-1]
        remote = np.split(batch.rows("remote")[0], stops)
        columns = (batch.numbers("round"), batch.time_ns, np.split(pairs, stops), remote, batch.flags("is_synchronous"))
        for number, time_ns, edges, over_air, shared in zip(*columns, strict=True):
            messages = [(int(a), int(b)) for a, b in edges]
            self._log.note(int(number), int(time_ns), messages, int(over_air.sum()), bool(shared))

    def finish(self) -> Iterator[Chunk]:
        """The graph, and one row a round of everything that changes."""
        model, rounds = self._setting.scene.model, self._log.rounds()
        if model is None or not self._log.is_synchronous or not any(each.messages for each in rounds):
            return
        layout = lay_out(model, self._setting.scene.nodes, self._truth)
        unknown = {vertex for each in rounds for edge in each.messages for vertex in edge} - set(layout.row_of)
        if unknown:
            return
        self.bounds = _bounds(layout)
        yield from _still(layout)
        yield from _legend(layout)
        yield from self._rows(layout, rounds)

    def _rows(self, layout: GraphLayout, rounds: Sequence[Round]) -> Iterator[Chunk]:
        start_ns = self._setting.pace.start_ns
        begun = [number for number, each in enumerate(rounds) if each.time_ns <= start_ns]
        shown = [each for each in rounds[begun[-1] if begun else 0 :] if each.time_ns < self._setting.pace.end_ns]
        if not shown:
            return
        time_ns = np.maximum(np.array([each.time_ns for each in shown], np.int64), start_ns)
        colours = [style.FLOW_COLOURS[each.state_of(vertex)] for each in shown for vertex in layout.row_of]
        count = [len(layout.row_of)] * len(shown)
        yield timed("/graph/vertices", time_ns, rr.Points2D.columns(colors=colours).partition(count))
        captions = [_caption(each, layout) for each in shown]
        yield timed("/graph/caption", time_ns, rr.Points2D.columns(labels=captions).partition([1] * len(shown)))
        wakes = [waking(each, rounds[each.number + 1] if each.number + 1 < len(rounds) else None) for each in shown]
        plain = [[edge for edge in each.messages if edge not in wake] for each, wake in zip(shown, wakes, strict=True)]
        waking_edges = [sorted(wake) for wake in wakes]
        for path, edges, colour in (
            ("/graph/messages", plain, style.FLOW_COLOURS["sends"]),
            ("/graph/wakes", waking_edges, style.FLOW_WAKES),
        ):
            if any(edges) or start_ns > 0:  # of a live view there may be arrows from before
                yield from _arrows(path, time_ns, layout, edges, colour)


def _bounds(layout: GraphLayout) -> Ranges:
    """All vertices, with room for the caption above and the legend below."""
    place, gap = layout.place_m * _MAP, layout.gap_m
    (left, top), (right, bottom) = place.min(axis=0) - gap, place.max(axis=0) + gap
    return (float(left), float(right)), (float(top - _ROW * gap), float(bottom + 1.6 * _ROW * gap))


def _still(layout: GraphLayout) -> Iterator[Chunk]:
    """Edges, names, and how vertices look but for their colour."""
    place = np.asarray(layout.place_m * _MAP, np.float32)
    radius = 0.5 * _MARK * layout.gap_m
    if len(layout.edges):
        lines = rr.LineStrips2D(list(place[layout.edges]), colors=[style.FLOW_EDGE], radii=[-0.7], draw_order=0.0)
        yield static("/graph/edges", lines)
    if layout.is_square.any():
        outlines = rr.LineStrips2D(
            _squares(place[layout.is_square], radius), colors=[style.LABEL], radii=[-1.0], draw_order=30.0
        )
        yield static("/graph/squares", outlines)
    radii = np.where(layout.is_square, 0.8, 1.0) * radius
    names = list(layout.label)
    yield static("/graph/vertices", rr.Points2D(place, radii=radii, labels=names, show_labels=False, draw_order=20.0))
    if len(names) <= _MOST_LABELS:
        below = place + np.array([0.0, style.FLOW_LABEL_DROP * radius], np.float32)
        labels = rr.Points2D(below, radii=[0.0], colors=[style.LABEL], labels=names, show_labels=True, draw_order=40.0)
        yield static("/graph/labels", labels)
    (left, right), (top, _) = _bounds(layout)
    caption = rr.Points2D.from_fields(
        positions=[[0.5 * (left + right), top + 0.6 * layout.gap_m]],
        colors=[style.LABEL],
        radii=[0.0],
        show_labels=True,
        draw_order=40.0,
    )
    yield static("/graph/caption", caption)


def _squares(middles: NDArray[np.float32], half_m: float) -> NDArray[np.float32]:
    """Closed outlines of upright squares; shape (n, 5, 2)."""
    corners = half_m * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    return np.asarray(middles[:, None] + corners, np.float32)


def _legend(layout: GraphLayout) -> Iterator[Chunk]:
    """What the colours mean, in a row below the graph."""
    (left, right), (_, bottom) = _bounds(layout)
    at = left + (right - left) * (np.arange(len(_LEGEND)) + 0.5) / len(_LEGEND)
    place = np.column_stack([at, np.full(len(at), bottom - 1.1 * layout.gap_m)])
    discs = rr.Points2D(
        place,
        colors=[style.FLOW_COLOURS[state] for state, _ in _LEGEND],
        radii=[0.25 * layout.gap_m],
        draw_order=20.0,
    )
    yield static("/graph/legend", discs)
    labels = rr.Points2D(
        place + np.array([0.0, 0.45 * layout.gap_m]),
        colors=[style.LABEL],
        radii=[0.0],
        labels=[word for _, word in _LEGEND],
        show_labels=True,
        draw_order=40.0,
    )
    yield static("/graph/legend/labels", labels)


def _arrows(
    path: str,
    time_ns: NDArray[np.int64],
    layout: GraphLayout,
    messages: Sequence[Sequence[tuple[int, int]]],
    colour: style.Rgba,
) -> Iterator[Chunk]:
    """One row of arrows a round, empty where there are none."""
    drawn = [layout.arrows(each, _MARK * layout.gap_m) for each in messages]
    tails = np.concatenate([tail for tail, _ in drawn]) * _MAP
    ways = np.concatenate([way for _, way in drawn]) * _MAP
    look = rr.Arrows2D.from_fields(colors=[colour], radii=[-1.6], show_labels=False, draw_order=10.0)
    yield static(path, look)
    columns = rr.Arrows2D.columns(origins=tails, vectors=ways)
    yield timed(path, time_ns, columns.partition([len(tail) for tail, _ in drawn]))


def _caption(this: Round, layout: GraphLayout) -> str:
    """The round in words."""
    name = dict(zip(layout.row_of, layout.label, strict=True))
    told = [
        name[vertex] + (f" after {', '.join(name[by] for by in sources)}" if sources and len(this.woken) <= 2 else "")
        for vertex, sources in this.woken.items()
    ]
    more = f" and {len(told) - _NAMED} more" if len(told) > _NAMED else ""
    wakes = f"; wake: {', '.join(told[:_NAMED])}{more}" if told else ""
    start = "start round" if this.number == 0 else f"round {this.number}"
    return f"{start}: {len(this.senders)} send, {len(this.fell_silent)} fall silent{wakes}"
