"""When beliefs are ready, and how many readings a centre had to make them of."""

import json
from collections.abc import Mapping
from typing import Any, Final

from netsim.trace.events import AlgorithmRecord
from netsim.trace.recorder import Handler

FUSED: Final = "fused"


class Fusion:
    """How many readings a centre got in time."""

    def __init__(self) -> None:
        self._readings: list[int] = []
        self._late = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {AlgorithmRecord: self._on_record}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where no centre fused anything."""
        if not self._readings:
            return {}
        return {
            "fused_steps": len(self._readings),
            "fused_readings_mean": sum(self._readings) / len(self._readings),
            "fused_readings_least": min(self._readings),
            "readings_late": self._late,
        }

    def _on_record(self, event: AlgorithmRecord, _: int) -> None:
        if event.kind == FUSED:
            fields = json.loads(event.fields_json)
            self._readings.append(int(fields["readings"]))
            self._late += int(fields["late"])
