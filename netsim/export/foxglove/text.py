"""The log: what the run logged, and what befell nodes and messages."""

from collections.abc import Mapping
from typing import Any, cast

from foxglove_schemas_protobuf.Log_pb2 import Log as FoxgloveLog

from netsim.export.foxglove.shapes import stamp
from netsim.export.foxglove.stage import Stage
from netsim.trace.events import Event, Fault, Log, MessageDropped, NodeLife, Role
from netsim.trace.recorder import Handler

TOPIC = "/log"
_INFO, _WARNING, _ERROR = FoxgloveLog.INFO, FoxgloveLog.WARNING, FoxgloveLog.ERROR
_LIFE = {"failed": _ERROR, "died": _WARNING, "crashed": _WARNING}


class Lines:
    """Tells each event as a line."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage

    def handlers(self) -> Mapping[type[Event], Handler]:
        """What is worth a line."""
        return {
            Log: self._on_log,
            NodeLife: self._on_life,
            MessageDropped: self._on_dropped,
            Fault: self._on_fault,
            Role: self._on_role,
        }

    def _on_log(self, event: Log, time_ns: int) -> None:
        self._tell(time_ns, event.level, event.name, event.message)

    def _on_life(self, event: NodeLife, time_ns: int) -> None:
        if self._stage.job.selection.has_node(event.node):
            reason = f": {event.reason}" if event.reason else ""
            name = self._stage.name(event.node)
            self._tell(time_ns, _LIFE.get(event.event, _INFO), name, f"{event.event}{reason}")

    def _on_dropped(self, event: MessageDropped, time_ns: int) -> None:
        if self._stage.job.selection.has_message(event):
            message = f"message {event.message_id} ({event.kind}) dropped: {event.reason}"
            self._tell(time_ns, _WARNING, self._stage.name(event.node), message)

    def _on_fault(self, event: Fault, time_ns: int) -> None:
        nodes = ", ".join(self._stage.name(int(node)) for node in event.node)
        self._tell(time_ns, _WARNING, "faults", f"{event.kind} {event.event}: {event.detail or nodes}")

    def _on_role(self, event: Role, time_ns: int) -> None:
        if self._stage.job.selection.has_node(event.node):
            verb = "becomes" if event.holds else "is no longer"
            self._tell(time_ns, _INFO, self._stage.name(event.node), f"{verb} {event.role}")

    def _tell(self, time_ns: int, level: int, name: str, message: str) -> None:
        line = FoxgloveLog(timestamp=stamp(time_ns), level=cast(Any, level), name=name, message=message)
        self._stage.show(TOPIC, line, time_ns)
