"""One instant of several tracks: a map with particles, groups and leaders, and below it bars of who is who."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from netsim.flow import look as flow_look
from netsim.snapshots import look
from netsim.snapshots.group_moment import GroupMoment, GroupTrack
from netsim.snapshots.load import Place, TrackRun
from netsim.snapshots.moment import in_seconds
from netsim.snapshots.panel import columns, frame

_SENSOR: dict[str, Any] = {"marker": "s", "ls": "", "ms": 2.2, "mew": 0}
_LEADER: dict[str, Any] = {"marker": "s", "ls": "", "ms": 10.0, "mew": 2.0, "mfc": "none"}
_DOWN: dict[str, Any] = {"marker": "x", "ls": "", "ms": 5, "mew": 1.2, "color": look.DOWN}
_PARTICLE: dict[str, Any] = {"marker": ".", "ls": "", "ms": 2.6, "mew": 0, "alpha": 0.6}
_HEAVIEST_PT2 = 60.0
"""Area of the particle with the greatest weight; the others' areas are as their weights, unless smaller than a dot."""
_WORD: dict[str, Any] = {
    "arrowstyle": "-|>", "color": look.WORD, "lw": 1.8, "shrinkA": 6, "shrinkB": 6, "mutation_scale": 11
}  # fmt: skip
_WRITTEN = 0.12
"""From which probability on a part of a bar holds its number."""


def draw_map(axes: Axes, run: TrackRun, moment: GroupMoment) -> None:
    """Draw an instant; the axes are in metres."""
    _draw_groups(axes, run, moment)
    _draw_sensors(axes, run, moment)
    for target, way_m in moment.ways_m.items():
        axes.plot(*columns(way_m), color=look.track_colour(target), lw=1.0, alpha=0.35, zorder=2)
    for track in moment.tracks.values():
        _draw_track(axes, run, track)
    for target, (x_m, y_m) in moment.targets.items():
        axes.plot(x_m, y_m, marker="+", color="white", ms=14, mew=4.6, zorder=8)
        axes.plot(x_m, y_m, marker="+", color=look.track_colour(target), ms=12, mew=2.4, zorder=9)
    for here, there in moment.words_m:
        axes.annotate("", there, here, arrowprops=_WORD, zorder=10)
    frame(axes, run)
    axes.set_title(in_seconds(moment.time_ns), loc="left")
    axes.set_title(said(moment), loc="right", fontsize=8, fontweight="normal", color=flow_look.SOFT)


def said(moment: GroupMoment) -> str:
    """Who is tracked together."""
    groups = sorted({track.mates for track in moment.tracks.values()})
    joint = [each for each in groups if len(each) > 1]
    if not groups:
        return "nobody leads"
    if not joint:
        return f"{len(groups)} group{'s' if len(groups) > 1 else ''}"
    return "joint: " + "; ".join("tracks " + " and ".join(map(str, each)) for each in joint)


def _colour(track: GroupTrack) -> str:
    return look.JOINT if len(track.mates) > 1 else look.track_colour(track.number)


def _draw_groups(axes: Axes, run: TrackRun, moment: GroupMoment) -> None:
    """Sensors within the sensing range of a track are in its group (Liu et al. 2004, section 5)."""
    for track in moment.tracks.values():
        if run.range_m is not None:
            style = {"fc": _colour(track), "ec": "none", "alpha": 0.14, "zorder": 0.5}
            axes.add_patch(Circle(track.place_m, run.range_m, **style))


def _draw_sensors(axes: Axes, run: TrackRun, moment: GroupMoment) -> None:
    up = {node: place_m for node, place_m in run.places_m.items() if node not in moment.down}
    centres_m = np.array([track.place_m for track in moment.tracks.values()]).reshape(-1, 2)
    members: list[Place] = []
    others: list[Place] = []
    for place_m in up.values():
        near = run.range_m is not None and (np.hypot(*(centres_m - place_m).T) <= run.range_m).any()
        (members if near else others).append(place_m)
    axes.plot(*columns(others), mfc=look.QUIET_SENSOR, zorder=1, **_SENSOR)
    axes.plot(*columns(members), mfc=look.SENSOR_EDGE, zorder=1, **_SENSOR)
    axes.plot(*columns([run.places_m[node] for node in sorted(moment.down)]), zorder=4, **_DOWN)


def _draw_track(axes: Axes, run: TrackRun, track: GroupTrack) -> None:
    colour = look.track_colour(track.number)
    axes.plot(*track.particles_m.T, mfc=colour, zorder=3, **_PARTICLE)
    areas = _HEAVIEST_PT2 * track.weights / max(float(track.weights.max()), 1e-300)
    axes.scatter(track.particles_m[:, 0], track.particles_m[:, 1], s=areas, color=colour, alpha=0.6, lw=0, zorder=4)
    axes.plot(*columns(track.trail_m), color=colour, lw=0.9, marker=".", ms=3.0, mew=0, zorder=5)
    axes.plot(*track.place_m, marker="o", ms=5.5, mfc="white", mec=colour, mew=1.6, ls="", zorder=7)
    if track.leader in run.places_m:
        axes.plot(*run.places_m[track.leader], mec=_colour(track), zorder=6, **_LEADER)


def draw_bars(axes: Axes, moment: GroupMoment) -> None:
    """A bar a track: how probable each target is."""
    known = {number: track.row for number, track in moment.tracks.items() if track.row}
    for place, row in enumerate(known.values()):
        begin = 0.0
        for target, chance in enumerate(row):
            axes.barh(place, chance, left=begin, height=0.72, color=look.track_colour(target), lw=0)
            if chance >= _WRITTEN:
                axes.text(
                    begin + chance / 2, place, f"{chance:.2f}", color="white", fontsize=7, ha="center", va="center"
                )
            begin += chance
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(max(len(known), 1) - 0.5, -0.5)
    axes.set_yticks(range(len(known)), [f"track {number}" for number in known], fontsize=8)
    for label, number in zip(axes.get_yticklabels(), known, strict=True):
        label.set_color(look.track_colour(number))
    axes.set_xticks([])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def group_handles(run: TrackRun, moments: Sequence[GroupMoment]) -> list[Line2D | Patch]:
    """What the signs mean; only those that some panel has."""
    tracks = [track for each in moments for track in each.tracks.values()]
    colour = look.track_colour(0)
    entries: list[tuple[bool, str, dict[str, Any]]] = [
        (bool(tracks), "particles, larger by weight", {**_PARTICLE, "mfc": colour, "ms": 6, "alpha": 1.0}),
        (bool(tracks), "estimate and its trail", _line(colour, "o", ms=5.5, mfc="white", mew=1.6)),
        (any(each.targets for each in moments), "target and its way", _line(colour, "+", ms=10, mew=2.2)),
        (bool(tracks), "leader", {**_LEADER, "ms": 9, "mec": colour}),
        (True, "sensor in no group", {**_SENSOR, "mfc": look.QUIET_SENSOR, "ms": 4}),
        (run.range_m is not None, "sensor in a group", {**_SENSOR, "mfc": look.SENSOR_EDGE, "ms": 4}),
        (any(each.words_m for each in moments), "word on identities", _line(look.WORD, ">", ms=5)),
        (any(each.down for each in moments), "node that is down", _DOWN),
    ]
    lines: list[Line2D | Patch] = [
        Line2D([0, 1], [0, 0], label=label, **style) for there, label, style in entries if there
    ]
    if run.range_m is not None:
        lines.append(Patch(fc=colour, alpha=0.3, label="group of one track"))
        if any(len(track.mates) > 1 for track in tracks):
            lines.append(Patch(fc=look.JOINT, alpha=0.3, label="joint group"))
    return lines


def _line(colour: str, marker: str, **more: Any) -> dict[str, Any]:
    return {"color": colour, "lw": 1.1, "marker": marker, "markevery": (1, 2), **more}
