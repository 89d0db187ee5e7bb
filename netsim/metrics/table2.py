"""The cost models of Table 2 of Liu, Reich, Zhao 2002, evaluated on what happened in a run of tracking."""

import json
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.kernels.table2 import Cost, centralised, distributed
from netsim.trace.events import Belief, FieldInfo, Handoff, MessageSent, NodeTable, Problem
from netsim.trace.recorder import Handler

READING: Final = "reading"
"""Kind of the messages that carry a reading to a sink."""
_BITS = 8


class Table2:
    """Adds up the costs of the steps."""

    def __init__(self) -> None:
        self._places_m: dict[int, tuple[float, float]] = {}
        self._sinks: list[int] = []
        self._sensors: list[int] = []
        self._centre_m = (0.0, 0.0)
        self._cells: dict[int, int] = {}  # of the latest belief, by node
        self._handed = self._belief_sized = self._read = Cost()
        self._operations = 0.0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            FieldInfo: self._on_field,
            NodeTable: self._on_nodes,
            Problem: self._on_problem,
            Belief: self._on_belief,
            Handoff: self._on_handoff,
            MessageSent: self._on_sent,
        }

    def figures(self) -> dict[str, Any]:
        """The metrics; empty without a problem of tracking or a belief, each part where there is nothing of it."""
        if not self._sensors or not self._cells:
            return {}
        figures: dict[str, Any] = {"table2_centralised_operations": self._operations}
        if self._handed.bit:
            figures |= {
                "table2_distributed_operations": self._handed.operations,
                "table2_distributed_bit": self._handed.bit,
                "table2_distributed_j": self._handed.joules,
                "table2_centralised_bit": self._belief_sized.bit,
                "table2_centralised_j": self._belief_sized.joules,
            }
        if self._read.bit:
            figures |= {"table2_readings_bit": self._read.bit, "table2_readings_j": self._read.joules}
        return figures

    def _on_field(self, event: FieldInfo, _: int) -> None:
        self._centre_m = (event.x_m + event.width_m / 2.0, event.y_m + event.height_m / 2.0)

    def _on_nodes(self, event: NodeTable, _: int) -> None:
        places = zip(map(float, event.x_m), map(float, event.y_m), strict=True)
        self._places_m = dict(zip(map(int, event.node), places, strict=True))
        roles = zip(map(int, event.node), event.role, strict=True)
        self._sinks = sorted(node for node, role in roles if role == "sink")
        if self._sinks:
            self._centre_m = self._places_m[self._sinks[0]]

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "tracking":
            self._sensors = [int(sensor["node"]) for sensor in json.loads(event.content_json).get("sensors", ())]

    def _on_belief(self, event: Belief, _: int) -> None:
        self._cells[event.node] = len(event.cell)
        if event.step > 0 and self._sensors:
            self._operations += centralised(len(event.cell), 0.0, self._to_centre_m()).operations

    def _on_handoff(self, event: Handoff, _: int) -> None:
        if not self._sensors:
            return
        cells, bit = self._cells.get(event.node, 0), float(_BITS * event.payload_byte)
        hop_m = math.dist(self._places_m[event.node], self._places_m[event.destination])
        self._handed += distributed(cells, len(event.candidate), bit, hop_m)
        self._belief_sized += centralised(cells, bit, self._to_centre_m())

    def _on_sent(self, event: MessageSent, _: int) -> None:
        if event.kind == READING and event.destination in self._sinks:
            bit = float(_BITS * event.size_byte)
            hop_m = math.dist(self._places_m[event.source], self._places_m[event.destination])
            self._read += centralised(0, bit, np.array([hop_m]))

    def _to_centre_m(self) -> FloatArray:
        offsets_m = np.array([self._places_m[node] for node in self._sensors]) - np.asarray(self._centre_m)
        return np.asarray(np.hypot(offsets_m[:, 0], offsets_m[:, 1]))
