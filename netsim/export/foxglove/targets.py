"""Targets where they are, and where the nodes think that they are: a dot, and the ellipse of two standard deviations."""

import math
from collections.abc import Mapping

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from netsim.export.foxglove.shapes import Place, disk, entity, sphere, text
from netsim.export.foxglove.stage import Stage
from netsim.replay import style
from netsim.trace.events import Estimate, Event, NodeTable, TruthTargets
from netsim.trace.recorder import Handler

TRUTH_TOPIC, ESTIMATES_TOPIC, ERROR_TOPIC = "/scene/targets", "/scene/estimates", "/error"
_SIGMAS = 2.0
_ERROR = {
    "track": {"type": "integer"},
    "thread": {"type": "integer"},
    "node": {"type": "integer"},
    "error_m": {"type": "number", "description": "Distance to the nearest target"},
    "spread_m": {"type": "number", "description": "Root of the trace of the covariance; missing where unknown"},
}


class Targets:
    """Shows all targets, and the latest estimate of each track, whenever one of them changes."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._truth: dict[int, Place] = {}
        self._latest: dict[tuple[int, int], Estimate] = {}

    def handlers(self) -> Mapping[type[Event], Handler]:
        """Truth and estimates; at the start what is known by then."""
        return {NodeTable: self._on_start, TruthTargets: self._on_truth, Estimate: self._on_estimate}

    def _on_start(self, event: NodeTable, time_ns: int) -> None:
        now_ns = self._stage.now_ns(time_ns)
        if self._truth:
            self._draw_truth(now_ns)
        if self._latest:
            self._draw_estimates(now_ns)

    def _on_truth(self, event: TruthTargets, time_ns: int) -> None:
        rows = zip(map(int, event.target), map(float, event.x_m), map(float, event.y_m), strict=True)
        self._truth = {target: (x_m, y_m) for target, x_m, y_m in rows}
        self._draw_truth(time_ns)

    def _on_estimate(self, event: Estimate, time_ns: int) -> None:
        if self._stage.job.selection.has_node(event.node):
            self._latest[event.target, event.thread] = event
            self._draw_estimates(time_ns)
            self._tell_error(event, time_ns)

    def _draw_truth(self, time_ns: int) -> None:
        unit_m, entities = self._stage.unit_m, []
        for target, place in self._truth.items():
            made = entity(f"target/{target}", time_ns, notes={"target": str(target)})
            made.spheres.append(sphere(place, unit_m, 1.4 * unit_m, style.TARGET))
            label = (place[0], place[1] + 1.4 * unit_m)
            made.texts.append(text(label, 2.0 * unit_m, unit_m, style.TARGET, f"target {target}"))
            entities.append(made)
        self._stage.show(TRUTH_TOPIC, SceneUpdate(entities=entities), time_ns)

    def _draw_estimates(self, time_ns: int) -> None:
        unit_m, entities = self._stage.unit_m, []
        for (track, thread), latest in self._latest.items():
            place = (latest.x_m, latest.y_m)
            notes = {"track": str(track), "node": self._stage.name(latest.node)}
            made = entity(f"estimate/{track}/{thread}", time_ns, notes=notes)
            made.spheres.append(sphere(place, 1.5 * unit_m, unit_m, style.ESTIMATE))
            if len(latest.covariance_m2):
                long_m, wide_m, yaw_rad = ellipse(latest.covariance_m2)
                size_m = (2.0 * _SIGMAS * long_m, 2.0 * _SIGMAS * wide_m, 0.05 * unit_m)
                made.cylinders.append(disk(place, -0.5 * unit_m, size_m, (*style.ESTIMATE[:3], 70), yaw_rad))
            entities.append(made)
        self._stage.show(ESTIMATES_TOPIC, SceneUpdate(entities=entities), time_ns)

    def _tell_error(self, event: Estimate, time_ns: int) -> None:
        if not self._truth:
            return
        figures: dict[str, float] = {"track": event.target, "thread": event.thread, "node": event.node}
        figures["error_m"] = min(math.dist((event.x_m, event.y_m), place) for place in self._truth.values())
        if len(event.covariance_m2):
            figures["spread_m"] = math.sqrt(event.covariance_m2[0] + event.covariance_m2[2])
        self._stage.tell(ERROR_TOPIC, "netsim.Error", _ERROR, figures, time_ns)


def ellipse(covariance_m2: object) -> tuple[float, float, float]:
    """Standard deviations along the two axes of a covariance (xx, xy, yy), larger first, and where the first points."""
    xx, xy, yy = np.asarray(covariance_m2, float)
    values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    wide_m, long_m = np.sqrt(np.maximum(values, 0.0)).tolist()
    return long_m, wide_m, math.atan2(vectors[1, 1], vectors[0, 1])
