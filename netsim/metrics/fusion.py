"""When beliefs are ready, and how many readings a centre had to make them of."""

import json
from collections.abc import Mapping
from typing import Any, Final

from netsim.trace.events import AlgorithmRecord, Belief, Problem
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S, s_to_ns

FUSED: Final = "fused"


class BeliefLatency:
    """From the instant of a reading to the belief after it."""

    def __init__(self) -> None:
        self._step_ns = 0
        self._latencies_ns: list[int] = []

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, Belief: self._on_belief}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty without a belief after a reading."""
        if not self._latencies_ns:
            return {}
        mean_ns = sum(self._latencies_ns) / len(self._latencies_ns)
        return {
            "belief_latency_mean_s": mean_ns / NS_PER_S,
            "belief_latency_max_s": max(self._latencies_ns) / NS_PER_S,
        }

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "tracking":
            self._step_ns = s_to_ns(json.loads(event.content_json).get("reading_s", 0.0))

    def _on_belief(self, event: Belief, now_ns: int) -> None:
        if event.step > 0 and self._step_ns:
            self._latencies_ns.append(now_ns - event.step * self._step_ns)


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
