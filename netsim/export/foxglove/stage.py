"""What is common to everything in a scene: where the nodes are, how large things are drawn."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf.message import Message

from netsim.export.foxglove.shapes import Place
from netsim.export.foxglove.writer import SceneFile
from netsim.export.job import Job
from netsim.trace.events import FieldInfo, NodePositions, NodeTable
from netsim.trace.reader import read_trace

_NOBODY = NodeTable([], [], [], [], [], [], [], [], [])


@dataclass
class Stage:
    """The scene as it is now.

    Attributes:
        file: Where it goes.
        job: What is exported.
        nodes: Who takes part.
        places: Where each node is.
        is_past: Whether what happens now is before the window: it counts, but is not shown.
        unit_m: A length that fits the map: an eighth of the distance between neighbours on a grid of so many nodes.
    """

    file: SceneFile
    job: Job
    nodes: NodeTable
    places: dict[int, Place]
    unit_m: float = 1.0
    is_past: bool = False

    def show(self, topic: str, message: Message, time_ns: int) -> None:
        """Show something."""
        if not self.is_past:
            self.file.send(topic, message, time_ns)

    def tell(self, topic: str, name: str, properties: Mapping[str, Any], value: Any, time_ns: int) -> None:
        """Tell figures; see `SceneFile.send_figures`."""
        if not self.is_past:
            self.file.send_figures(topic, name, properties, value, time_ns)

    def name(self, node: int) -> str:
        """The name of a node."""
        return self._names.get(node, str(node))

    def move(self, event: NodePositions) -> None:
        """Nodes went elsewhere."""
        self.places |= _places(event)

    def now_ns(self, time_ns: int) -> int:
        """When something is shown: what was told before the window, at its start."""
        return max(time_ns, self.job.selection.start_ns)

    def __post_init__(self) -> None:
        self._names = dict(zip(map(int, self.nodes.node), self.nodes.name, strict=True))


def load_stage(file: SceneFile, job: Job) -> Stage:
    """The scene at the start of a trace.

    Raises:
        TraceError: If the trace cannot be read.
    """
    nodes, area = _NOBODY, None
    for _, event in read_trace(job.trace, {NodeTable.topic, FieldInfo.topic}, end_ns=1):
        if isinstance(event, NodeTable):
            nodes = event
        elif isinstance(event, FieldInfo):
            area = event
    return Stage(file, job, nodes, _places(nodes), _unit_m(nodes, area))


def _places(event: NodeTable | NodePositions) -> dict[int, Place]:
    rows = zip(map(int, event.node), map(float, event.x_m), map(float, event.y_m), strict=True)
    return {node: (x_m, y_m) for node, x_m, y_m in rows}


def _unit_m(nodes: NodeTable, area: FieldInfo | None) -> float:
    if area is not None:
        width_m, height_m = area.width_m, area.height_m
    else:
        width_m, height_m = (float(np.ptp(each)) if len(each) else 0.0 for each in (nodes.x_m, nodes.y_m))
    larger_m = max(width_m, height_m) or 1.0
    surface_m2 = larger_m * max(min(width_m, height_m), larger_m / 10.0)
    return math.sqrt(surface_m2 / max(len(nodes.node), 1)) / 8.0
