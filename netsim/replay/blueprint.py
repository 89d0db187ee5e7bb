"""How the replay is laid out: the map on the left; curves, radio time line and log on the right."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb

from netsim.replay import style
from netsim.replay.certainty import ENTROPY_ORIGIN, WIDTH_ORIGIN
from netsim.replay.energy import EnergyPlot
from netsim.replay.options import Pace
from netsim.replay.track import TIMELINE
from netsim.units import NS_PER_S

_RADIO_WINDOW_S = 0.1
_MOST_LANES = 7
_LANE_COLOURS = "orange sends, green receives, red collides"  # as in `style.RADIO_COLOURS`
# Heights in points, for a window of the usual height: a radio view shows whole lanes only.
_RIGHT_SIDE = 869.0
_LANE = 39.5
_LANES_FRAME = 53.0
_LOG = 203.0

_SHOWN_LEVELS = ["INFO", "WARN", "ERROR", "CRITICAL"]  # the others can be chosen in the viewer

_BAR, _BARS_FRAME = 34.0, 40.0
_MOST_BARS = 8

Ranges = tuple[tuple[float, float], tuple[float, float]]
View = rrb.View | rrb.Tabs


@dataclass(frozen=True)
class Curve:
    """A plot over time.

    Attributes:
        origin: Where its curves are.
        name: Its title.
        corner: Where its legend is.
        legend: Whether it has one.
    """

    origin: str
    name: str
    corner: rrb.Corner2D
    legend: bool = True


@dataclass(frozen=True)
class Left:
    """What is on the left.

    Attributes:
        map: Ranges of x and y of the map.
        graph: Those of the graphical model, if there is such a view.
        graph_first: Whether it is in front.
    """

    map: Ranges
    graph: Ranges | None
    graph_first: bool


@dataclass(frozen=True)
class Contents:
    """What there is to lay out.

    Attributes:
        present: First three parts of the entity paths that have data, such as `/plots/messages` or `/log`.
        energy: How to show the energy.
        clocks: Title of the curves of the clocks' errors.
        lanes: Entities of the radio time line, the most important first.
        left: Map and graph.
        identities: Ranges of x and y of the bars of who is who, if there are any.
    """

    present: Collection[str]
    energy: EnergyPlot
    clocks: str
    lanes: Sequence[str]
    left: Left
    identities: Ranges | None = None


def make_blueprint(contents: Contents, pace: Pace, *, follow: bool = False) -> rrb.Blueprint:
    """The layout for what a trace has.

    Args:
        contents: What there is.
        pace: Window and playback speed.
        follow: Whether the cursor keeps to the end while more comes.
    """
    right = [*_curve_rows(contents, pace)]
    if contents.lanes:
        right.append((_radio(contents.lanes), _lanes_height(contents)))
    if (log := _log(contents.present)) is not None:
        right.append((log, _log_height(contents)))
    layout = _left(contents.left) if not right else rrb.Horizontal(
        _left(contents.left),
        rrb.Vertical(*(view for view, _ in right), row_shares=[share for _, share in right]),
        column_shares=[3, 2],
    )  # fmt: skip
    time_panel = rrb.TimePanel(
        state="collapsed",
        timeline=TIMELINE,
        playback_speed=pace.speed,
        play_state="following" if follow else "paused",
        loop_mode="off",
    )
    panels = (rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"))
    return rrb.Blueprint(layout, *panels, time_panel, auto_layout=False, auto_views=False)


def _lanes_height(contents: Contents) -> float:
    return _LANES_FRAME + _LANE * min(_MOST_LANES, len(contents.lanes)) if contents.lanes else 0.0


def _log_height(contents: Contents) -> float:
    return _LOG if contents.lanes or len(_own(contents)) > 0 else 0.4 * _RIGHT_SIDE


def _curve_rows(contents: Contents, pace: Pace) -> list[tuple[View, float]]:
    """What suits the algorithm above what suits every run; all in one place where radio lanes need the room."""
    own: list[View] = [_series(curve, pace) for curve in _own(contents)]
    common: list[View] = [_series(curve, pace) for curve in _common(contents) if curve.origin in contents.present]
    height = _RIGHT_SIDE - _lanes_height(contents) - _log_height(contents)
    bars = [] if contents.identities is None else [(_bars(contents.identities), _bars_height(contents.identities))]
    if contents.lanes:
        views = [*own, *(view for view, _ in bars), *common]
        return [(_tabs(views), height)] if views else []
    rows = [row for row in (own, common) if row]
    each = (height - sum(share for _, share in bars)) / max(1, len(rows))
    curves = [(_tabs(row), each) for row in rows]
    return [*curves[:1], *bars, *curves[1:]]


def _bars_height(bounds: Ranges) -> float:
    top, bottom = bounds[1]
    return _BARS_FRAME + _BAR * min(_MOST_BARS, bottom - top)


def _left(left: Left) -> rrb.Spatial2DView | rrb.Tabs:
    """The map, with the graphical model in a tab beside it."""
    the_map = _plane("/map", "Map", left.map)
    if left.graph is None:
        return the_map
    graph = _plane("/graph", "Information flow in the graphical model", left.graph)
    return rrb.Tabs(the_map, graph, active_tab=int(left.graph_first))


def _plane(origin: str, name: str, bounds: Ranges) -> rrb.Spatial2DView:
    (left, right), (top, bottom) = bounds
    return rrb.Spatial2DView(
        origin=origin,
        contents=f"{origin}/**",
        name=name,
        background=style.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=(left, right), y_range=(top, bottom)),
    )


def _own(contents: Contents) -> list[Curve]:
    """Curves of what the algorithm does, those of what is in front on the left first."""
    right_top = rrb.Corner2D.RightTop
    rounds = Curve("/plots/senders", "Senders per round", right_top)
    known = [
        Curve("/plots/track", "Distance from target (m)", right_top),
        Curve(WIDTH_ORIGIN, "Certified intervals", right_top),
        rounds,
        Curve("/plots/accuracy", "Accuracy", rrb.Corner2D.RightBottom),
        Curve(ENTROPY_ORIGIN, "Entropy of beliefs (bit)", right_top),
        Curve("/plots/clock", contents.clocks, rrb.Corner2D.LeftTop),
    ]
    if contents.left.graph is not None and contents.left.graph_first:
        known = [rounds, *(curve for curve in known if curve is not rounds)]
    return [curve for curve in known if curve.origin in contents.present]


def _common(contents: Contents) -> list[Curve]:
    energy = contents.energy
    corner = rrb.Corner2D.LeftBottom if energy.falling else rrb.Corner2D.LeftTop
    return [
        Curve(energy.origin, energy.name, corner, energy.legend),
        Curve("/plots/messages", "Messages/s", rrb.Corner2D.RightTop),
    ]


def _series(curve: Curve, pace: Pace) -> rrb.TimeSeriesView:
    window = rr.TimeRange(
        start=rr.TimeRangeBoundary.absolute(seconds=pace.start_ns / NS_PER_S),
        end=rr.TimeRangeBoundary.absolute(seconds=pace.end_ns / NS_PER_S),
    )
    legend = rrb.PlotLegend(corner=curve.corner, visible=curve.legend)
    axis = rrb.TimeAxis(view_range=window)
    return rrb.TimeSeriesView(origin=curve.origin, name=curve.name, plot_legend=legend, axis_x=axis)


def _bars(bounds: Ranges) -> rrb.Spatial2DView:
    return _plane("/identity", "Who is who: how probable each target is, in its colour", bounds)


def _tabs(views: Sequence[View]) -> View:
    return views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0)


def _radio(lanes: Sequence[str]) -> View:
    """The busiest nodes' lanes as far as they fit; all of them in a tab behind."""
    if len(lanes) <= _MOST_LANES:
        return _lanes("/radio/**", f"Radios: {_LANE_COLOURS}")
    busiest = _lanes(list(lanes[:_MOST_LANES]), f"{_MOST_LANES} busiest radios: {_LANE_COLOURS}")
    return rrb.Tabs(busiest, _lanes("/radio/**", f"All {len(lanes)}"), active_tab=0)


def _lanes(contents: str | list[str], name: str) -> rrb.StateTimelineView:
    window = rr.TimeRange(
        start=rr.TimeRangeBoundary.cursor_relative(seconds=-_RADIO_WINDOW_S),
        end=rr.TimeRangeBoundary.cursor_relative(seconds=_RADIO_WINDOW_S),
    )
    axis = rrb.TimeAxis(view_range=window)
    return rrb.StateTimelineView(origin="/radio", contents=contents, name=name, time_view=axis)


def _log(present: Collection[str]) -> rrb.TextLogView | None:
    if not any(path.startswith("/log/") for path in present):
        return None
    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    rows = rrb.TextLogRows(filter_by_log_level=_SHOWN_LEVELS)
    return rrb.TextLogView(origin="/log", name="Log", columns=columns, rows=rows)
