"""Figures over time, for plots: the nodes' energy, the traffic of each second; and those of the whole run at its end."""

import json
import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

from netsim.export.foxglove.stage import Stage
from netsim.export.metric_table import METRICS_FILE
from netsim.trace.events import OUTCOMES, Event, Frame, NodeEnergy
from netsim.trace.reader import trace_attachments
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

ENERGY_TOPIC, TRAFFIC_TOPIC, METRICS_TOPIC = "/energy", "/traffic", "/metrics"
_NUMBER, _COUNT = {"type": "number"}, {"type": "integer"}
_ENERGY = {
    "total_consumed_j": _NUMBER,
    "least_left_j": {"type": "number", "description": "Of the nodes with a battery; missing where none has one"},
    "nodes": {
        "type": "array",
        "items": {
            "type": "object",
            "properties": {"node": _COUNT, "name": {"type": "string"}, "consumed_j": _NUMBER, "left_j": _NUMBER},
        },
    },
}
_TRAFFIC = {
    "frames": {"type": "integer", "description": "Frames that ended in this second of simulated time"},
    "byte": _COUNT,
    "airtime_s": _NUMBER,
    "acknowledgements": _COUNT,
    "retries": _COUNT,
    "outcomes": {"type": "object", "description": "Receptions by what became of them", "additionalProperties": _COUNT},
    "kinds": {"type": "object", "description": "Frames by message kind", "additionalProperties": _COUNT},
}


class Figures:
    """Tells energy as it is sampled, traffic once a second in which there is any."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._second = 0
        self._traffic = Traffic()
        self._last_ns = 0

    def handlers(self) -> Mapping[type[Event], Handler]:
        """Energy and frames."""
        return {NodeEnergy: self._on_energy, Frame: self._on_frame}

    def close(self) -> None:
        """Tell the traffic of the last second, and the figures of the run."""
        self._tell_traffic()
        content = trace_attachments(self._stage.job.trace).get(METRICS_FILE)
        if content is not None:
            end_ns = max(self._last_ns, self._stage.job.selection.start_ns)
            self._stage.tell(METRICS_TOPIC, "netsim.Metrics", {}, _finite(content), end_ns)

    def _on_energy(self, event: NodeEnergy, time_ns: int) -> None:
        self._pass(time_ns)
        rows = zip(map(int, event.node), map(float, event.consumed_j), map(float, event.left_j), strict=True)
        nodes = [_node_energy(self._stage, *row) for row in rows if self._stage.job.selection.has_node(row[0])]
        figures: dict[str, Any] = {"total_consumed_j": math.fsum(node["consumed_j"] for node in nodes), "nodes": nodes}
        left_j = [node["left_j"] for node in nodes if "left_j" in node]
        if left_j:
            figures["least_left_j"] = min(left_j)
        self._stage.tell(ENERGY_TOPIC, "netsim.Energy", _ENERGY, figures, time_ns)

    def _on_frame(self, frame: Frame, time_ns: int) -> None:
        self._pass(time_ns)
        if self._stage.job.selection.has_frame(frame):
            self._traffic.add(frame)

    def _pass(self, time_ns: int) -> None:
        """Time has come so far; a second that is over is told."""
        self._last_ns = time_ns
        if time_ns // NS_PER_S != self._second:
            self._tell_traffic()
            self._second = time_ns // NS_PER_S

    def _tell_traffic(self) -> None:
        if self._traffic.frames:
            end_ns = (self._second + 1) * NS_PER_S
            self._stage.tell(TRAFFIC_TOPIC, "netsim.Traffic", _TRAFFIC, self._traffic.plain(), end_ns)
        self._traffic = Traffic()


class Traffic:
    """What was on the air in some time."""

    def __init__(self) -> None:
        self.frames = self._byte = self._airtime_ns = self._acknowledgements = self._retries = 0
        self._outcomes: Counter[int] = Counter()
        self._kinds: Counter[str] = Counter()

    def add(self, frame: Frame) -> None:
        """One frame more."""
        self.frames += 1
        self._byte += frame.size_byte
        self._airtime_ns += frame.t_end_ns - frame.t_start_ns
        self._acknowledgements += frame.is_ack
        self._retries += frame.attempt > 0
        self._outcomes.update(map(int, frame.rx_outcome))
        self._kinds[frame.kind] += 1

    def plain(self) -> dict[str, Any]:
        """As an object for JSON."""
        return {
            "frames": self.frames,
            "byte": self._byte,
            "airtime_s": self._airtime_ns / NS_PER_S,
            "acknowledgements": self._acknowledgements,
            "retries": self._retries,
            "outcomes": {OUTCOMES[code]: count for code, count in sorted(self._outcomes.items())},
            "kinds": dict(sorted(self._kinds.items())),
        }


def _finite(content: bytes) -> Any:
    """Figures without what JSON, as viewers read it, has no number for."""
    return json.loads(content, parse_constant=lambda word: None)


def _node_energy(stage: Stage, node: int, consumed_j: float, left_j: float) -> dict[str, Any]:
    found = {"node": node, "name": stage.name(node), "consumed_j": consumed_j}
    return found | ({"left_j": left_j} if math.isfinite(left_j) else {})
