"""What the sensors of a tracking problem measure: a coloured rim around their nodes."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import Scene, static
from netsim.trace.events import Problem
from netsim.trace.reader import read_trace

_RIM = 1.5  # node radii


def sensor_chunks(trace: Path, scene: Scene) -> Iterator[Chunk]:
    """A rim in the colour of the kind of sensor; static, so only where nodes do not move."""
    if not scene.motion.is_still:
        return
    measures = _measures(trace)
    for kind, colour in style.SENSOR_COLOURS.items():
        nodes = np.array([node for node, what in measures.items() if what == kind], np.int64)
        rows = scene.rows(nodes)
        if len(rows):
            rims = rr.Points2D(
                scene.place[rows[rows >= 0]],
                colors=[colour],
                radii=[_RIM * scene.radius_m],
                draw_order=style.ORDER["sensors"],
            )
            yield static(f"/map/{kind}_sensors", rims)


def _measures(trace: Path) -> dict[int, str]:
    """What each sensor measures; empty for another kind of problem."""
    for _, event in read_trace(trace, {Problem.topic}, end_ns=1):
        if isinstance(event, Problem) and event.kind == "tracking":
            return {int(each["node"]): each["measures"] for each in json.loads(event.content_json)["sensors"]}
    return {}
