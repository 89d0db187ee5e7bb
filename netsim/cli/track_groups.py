"""`netsim track` for groups that hold their beliefs as particles."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from netsim.cli.console import counted, say, show
from netsim.cli.tables import plain_table
from netsim.cli.track_times import chosen_times_ns, draw
from netsim.snapshots.group_moment import GroupTrack, group_moment, joint_groups, settled_ns, usual_group_times_ns
from netsim.snapshots.load import TrackRun
from netsim.units import NS_PER_S


def show_groups(run: TrackRun, out: Path | None, at_s: Sequence[float] | None, *, as_json: bool) -> None:
    """Print how each track stands, at all instants or at some, and draw some if a picture is asked for."""
    told_ns = [cloud.time_ns for cloud in run.clouds]
    times_ns = [settled_ns(run, time_ns) for time_ns in chosen_times_ns(told_ns, at_s)] if at_s else None
    drawn_ns = times_ns or usual_group_times_ns(run)
    shown_ns = sorted(set(told_ns)) if times_ns is None and out is None else drawn_ns
    tracks = _tracks_at(run, shown_ns)
    if as_json:
        say(json.dumps([plain_track(run, track) for track in tracks], indent=1))
    else:
        _print(run, tracks)
    if out is not None:
        from netsim.snapshots.group_picture import write_group_picture

        draw(lambda: write_group_picture(run, drawn_ns, out), drawn_ns, out, quiet=as_json)


def plain_track(run: TrackRun, track: GroupTrack) -> dict[str, Any]:
    """A track at an instant for JSON, nodes by name."""
    return {
        "time_s": track.told_ns / NS_PER_S,
        "track": track.number,
        "node": run.names.get(track.leader, str(track.leader)),
        "group": list(track.mates),
        "estimate_m": list(track.place_m),
        "error_m": run.truth.nearest_m(track.told_ns, track.place_m),
        "spread_m": _spread_m(track),
        "identity": list(track.row),
    }


def _tracks_at(run: TrackRun, times_ns: Sequence[int]) -> list[GroupTrack]:
    """Each track as last told at these instants, each telling once."""
    found = [track for time_ns in times_ns for track in group_moment(run, time_ns).tracks.values()]
    return list({(track.told_ns, track.number): track for track in found}.values())


def _spread_m(track: GroupTrack) -> float:
    """Root of the trace of the particles' covariance, weighted."""
    offsets_m = track.particles_m - np.average(track.particles_m, axis=0, weights=track.weights)
    return math.sqrt(float(np.average((offsets_m**2).sum(axis=1), weights=track.weights)))


def _print(run: TrackRun, tracks: Sequence[GroupTrack]) -> None:
    table = plain_table(f"Tracks: {run.title}", ("s", "leader"), ("track", "with", "error m", "spread m", "identity"))
    for track in tracks:
        off_m = run.truth.nearest_m(track.told_ns, track.place_m)
        table.add_row(
            f"{track.told_ns / NS_PER_S:.3f}",
            run.names.get(track.leader, str(track.leader)),
            str(track.number),
            " ".join(str(mate) for mate in track.mates if mate != track.number) or "-",
            "-" if off_m is None else f"{off_m:.2f}",
            f"{_spread_m(track):.2f}",
            " ".join(f"{chance:.2f}" for chance in track.row) or "-",
        )
    show(table)
    groups = joint_groups(run)
    when = "; ".join(
        f"tracks {' '.join(map(str, tracks))} from {begin_ns / NS_PER_S:.1f} to {end_ns / NS_PER_S:.1f} s"
        for tracks, begin_ns, end_ns in groups
    )
    say(f"{counted(len(groups), 'joint group')}{f': {when}' if groups else ''}")
    say("identity: probability of each target; spread: of the weighted particles")
