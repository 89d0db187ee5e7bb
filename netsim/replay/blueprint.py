"""How the replay is laid out: the map on the left; curves, radio time line and log on the right."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb

from netsim.replay import style
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
_BAR, _BARS_FRAME = 34.0, 40.0
_MOST_BARS = 8

_SHOWN_LEVELS = ["INFO", "WARN", "ERROR", "CRITICAL"]  # the others can be chosen in the viewer

_TRACK_ORIGIN, _TRACK = "/plots/track", "Distance from target (m)"
_ROUNDS_ORIGIN, _ROUNDS = "/plots/senders", "Senders per round"
_IDENTITIES_ORIGIN = "/identity"
_IDENTITIES = "Who is who: how probable each target is, in its colour"

Ranges = tuple[tuple[float, float], tuple[float, float]]


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
        identities: Ranges of x and y of the bars of who is who.
    """

    present: Collection[str]
    energy: EnergyPlot
    clocks: str
    lanes: Sequence[str]
    left: Left
    identities: Ranges


def make_blueprint(contents: Contents, pace: Pace) -> rrb.Blueprint:
    """The layout for what a trace has.

    Args:
        contents: What there is.
        pace: Window and playback speed.
    """
    views = (_curves(contents, pace), _identities(contents), _radio(contents.lanes), _log(contents.present))
    right = [(view, share) for view, share in zip(views, _shares(contents), strict=True) if view is not None]
    layout = _left(contents.left) if not right else rrb.Horizontal(
        _left(contents.left),
        rrb.Vertical(*(view for view, _ in right), row_shares=[share for _, share in right]),
        column_shares=[3, 2],
    )  # fmt: skip
    time_panel = rrb.TimePanel(
        state="collapsed", timeline=TIMELINE, playback_speed=pace.speed, play_state="paused", loop_mode="off"
    )
    panels = (rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"))
    return rrb.Blueprint(layout, *panels, time_panel, auto_layout=False, auto_views=False)


def _shares(contents: Contents) -> tuple[float, float, float, float]:
    """Heights of curves, bars of identities, radio time line and log."""
    top, bottom = contents.identities[1]
    bars = _BARS_FRAME + _BAR * min(_MOST_BARS, bottom - top) if _IDENTITIES_ORIGIN in _views(contents.present) else 0.0
    lanes = _LANES_FRAME + _LANE * min(_MOST_LANES, len(contents.lanes)) if contents.lanes else 0.0
    log = _LOG if lanes else 0.4 * _RIGHT_SIDE
    return _RIGHT_SIDE - bars - lanes - log, bars, lanes, log


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


def _curves(contents: Contents, pace: Pace) -> rrb.Tabs | None:
    energy = contents.energy
    corner = rrb.Corner2D.LeftBottom if energy.falling else rrb.Corner2D.LeftTop
    known = (
        (energy.origin, energy.name, corner, energy.legend),
        ("/plots/messages", "Messages/s", rrb.Corner2D.RightTop, True),
        (_ROUNDS_ORIGIN, _ROUNDS, rrb.Corner2D.RightTop, True),
        (_TRACK_ORIGIN, _TRACK, rrb.Corner2D.RightTop, True),
        ("/plots/accuracy", "Accuracy", rrb.Corner2D.RightBottom, True),
        ("/plots/clock", contents.clocks, rrb.Corner2D.LeftTop, True),
    )
    window = rr.TimeRange(
        start=rr.TimeRangeBoundary.absolute(seconds=pace.start_ns / NS_PER_S),
        end=rr.TimeRangeBoundary.absolute(seconds=pace.end_ns / NS_PER_S),
    )
    whole = rrb.TimeAxis(view_range=window)
    views = [
        rrb.TimeSeriesView(
            origin=origin, name=name, plot_legend=rrb.PlotLegend(corner=corner, visible=legend), axis_x=whole
        )
        for origin, name, corner, legend in known
        if origin in contents.present
    ]
    names = [view.name for view in views]
    return rrb.Tabs(*views, active_tab=names.index(_first(contents) or names[0])) if views else None


def _first(contents: Contents) -> str | None:
    """The curves that belong to what the map or the graphical model shows, if they are more than energy."""
    if _graph_first(contents):
        return _ROUNDS
    beliefs = {"/map/beliefs", "/map/particles"} & {*contents.present}
    return _TRACK if beliefs and _TRACK_ORIGIN in contents.present else None


def _graph_first(contents: Contents) -> bool:
    return contents.left.graph is not None and contents.left.graph_first and _ROUNDS_ORIGIN in contents.present


def _views(present: Collection[str]) -> set[str]:
    """First parts of the entity paths that have data."""
    return {f"/{path.split('/')[1]}" for path in present}


def _identities(contents: Contents) -> rrb.Spatial2DView | None:
    if _IDENTITIES_ORIGIN not in _views(contents.present):
        return None
    return _plane(_IDENTITIES_ORIGIN, _IDENTITIES, contents.identities)


def _radio(lanes: Sequence[str]) -> rrb.StateTimelineView | rrb.Tabs | None:
    """The busiest nodes' lanes as far as they fit; all of them in a tab behind."""
    if not lanes:
        return None
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
