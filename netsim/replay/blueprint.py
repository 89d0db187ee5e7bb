"""How the replay is laid out: the map on the left; curves, radio time line and log on the right."""

from collections.abc import Collection

import rerun as rr
import rerun.blueprint as rrb

from netsim.replay import style
from netsim.replay.options import Pace
from netsim.replay.scene import Scene
from netsim.replay.track import TIMELINE
from netsim.units import NS_PER_S

_RADIO_WINDOW_S = 0.25
_LEGEND_LINES = 8


def make_blueprint(
    scene: Scene, pace: Pace, present: Collection[str], on_battery: bool, energy_curves: int
) -> rrb.Blueprint:
    """The layout for what a trace has.

    Args:
        scene: The still parts, for the bounds of the map.
        pace: Playback speed.
        present: First two parts of the entity paths that have data, such as `/plots/energy` or `/log`.
        on_battery: Whether the energy curves are of energy left.
        energy_curves: How many there are.
    """
    right = [
        view
        for view in (_curves(present, on_battery, energy_curves, pace), *_radio(present), *_log(present))
        if view is not None
    ]
    shares = [3, 3, 2][: len(right)]
    layout = _map(scene) if not right else rrb.Horizontal(
        _map(scene), rrb.Vertical(*right, row_shares=shares), column_shares=[3, 2]
    )  # fmt: skip
    time_panel = rrb.TimePanel(
        state="collapsed", timeline=TIMELINE, playback_speed=pace.speed, play_state="paused", loop_mode="off"
    )
    panels = (rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"))
    return rrb.Blueprint(layout, *panels, time_panel, auto_layout=False, auto_views=False)


def _map(scene: Scene) -> rrb.Spatial2DView:
    (left, right), (top, bottom) = scene.bounds()
    return rrb.Spatial2DView(
        origin="/map",
        contents="/map/**",
        name="Map",
        background=style.BACKGROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=(left, right), y_range=(top, bottom)),
    )


def _curves(present: Collection[str], on_battery: bool, curves: int, pace: Pace) -> rrb.Tabs | None:
    known = (
        (
            "/plots/energy",
            "Energy left (J)" if on_battery else "Energy used (J)",
            *_energy_legend(on_battery, curves),
        ),
        ("/plots/messages", "Messages/s", rrb.Corner2D.RightTop, True),
        ("/plots/senders", "Senders per round", rrb.Corner2D.RightTop, True),
        ("/plots/accuracy", "Accuracy", rrb.Corner2D.RightBottom, True),
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
        if origin in present
    ]
    return rrb.Tabs(*views, active_tab=0) if views else None


def _energy_legend(on_battery: bool, curves: int) -> tuple[rrb.Corner2D, bool]:
    """Where the legend hides least, and whether it fits at all."""
    return (rrb.Corner2D.LeftBottom if on_battery else rrb.Corner2D.LeftTop), curves <= _LEGEND_LINES


def _radio(present: Collection[str]) -> list[rrb.StateTimelineView]:
    if not any(path.startswith("/radio") for path in present):
        return []
    window = rr.TimeRange(
        start=rr.TimeRangeBoundary.cursor_relative(seconds=-_RADIO_WINDOW_S),
        end=rr.TimeRangeBoundary.cursor_relative(seconds=_RADIO_WINDOW_S),
    )
    name = f"Radio (cursor \u00b1 {_RADIO_WINDOW_S:g} s)"
    return [rrb.StateTimelineView(origin="/radio", name=name, time_view=rrb.TimeAxis(view_range=window))]


def _log(present: Collection[str]) -> list[rrb.TextLogView]:
    if "/log" not in present:
        return []
    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    return [rrb.TextLogView(origin="/log", name="Log", columns=columns)]
