"""What fault rules did to a run."""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from netsim.trace.events import EnergyLedger, Fault, NodeLife
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S


class Faults:
    """Counts crashes and reboots, and how often each rule struck."""

    def __init__(self) -> None:
        self._strikes: defaultdict[tuple[int, str], int] = defaultdict(int)
        self._crashes = 0
        self._reboots = 0
        self._down_since_ns: dict[int, int] = {}
        self._down_ns = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Fault: self._on_fault, NodeLife: self._on_life, EnergyLedger: self._on_end}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where no rule had anything to do and no node crashed.

        A strike is a node that crashed, or a frame, packet or reading that suffered, counted once a node;
        what a jammer did is among the outcomes of frames.
        """
        if not self._strikes and not self._crashes:
            return {}
        return {
            "crashes": self._crashes,
            "reboots": self._reboots,
            "crashed_time_s": self._down_ns / NS_PER_S,
            "fault_strikes_by_rule": {f"{rule} {kind}": count for (rule, kind), count in sorted(self._strikes.items())},
        }

    def _on_fault(self, event: Fault, _: int) -> None:
        if event.event == "strikes":
            self._strikes[event.rule, event.kind] += len(event.node)

    def _on_life(self, event: NodeLife, now_ns: int) -> None:
        if event.event == "crashed":
            self._crashes += 1
            self._down_since_ns[event.node] = now_ns
        elif event.event == "rebooted":
            self._reboots += 1
            self._down_ns += now_ns - self._down_since_ns.pop(event.node, now_ns)

    def _on_end(self, _: EnergyLedger, now_ns: int) -> None:
        self._down_ns += sum(now_ns - since_ns for since_ns in self._down_since_ns.values())
