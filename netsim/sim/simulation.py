"""A run: nodes, the clock, and what ends it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from netsim.api import Algorithm, NodeHandle
from netsim.errors import AlgorithmError
from netsim.sim.clock import Clock
from netsim.sim.node import Node
from netsim.trace.events import EnergyHarvest, EnergyLedger, Event, NodeClocks, NodeEnergy
from netsim.trace.recorder import Recorder
from netsim.units import NS_PER_S

STEPS_BETWEEN_LOOKS = 512
STEPS_AT_ONE_INSTANT = 300_000
"""More than this is an algorithm that waits without letting time pass."""
Progress = Callable[[int], bool]
"""Called now and then with the simulated time in nanoseconds; False ends the run there."""


@dataclass(frozen=True, slots=True)
class Member:
    """A node and what it runs."""

    node: Node
    handle: NodeHandle
    algorithm: Algorithm


class Simulation:
    """One run. Two of them in one process share nothing.

    It ends when every algorithm has ended and the air is quiet, or at the horizon, whichever comes first.

    Args:
        clock: Simulated time.
        recorder: Where events go.
        horizon_ns: The latest end.
        opening: Events that describe the run, recorded at time 0.
        energy_interval_ns: How often the nodes' energy and clocks are sampled, where somebody observes them.
        air_is_quiet: Whether nothing is under way between the nodes.
    """

    def __init__(
        self,
        clock: Clock,
        recorder: Recorder,
        horizon_ns: int,
        opening: Sequence[Event],
        energy_interval_ns: int,
        air_is_quiet: Callable[[], bool] = lambda: True,
    ) -> None:
        self._clock = clock
        self._recorder = recorder
        self.horizon_ns = horizon_ns
        self._opening = opening
        self._energy_interval_ns = energy_interval_ns
        self._air_is_quiet = air_is_quiet
        self._members: dict[int, Member] = {}
        self._active = 0

    @property
    def nodes(self) -> Mapping[int, Node]:
        """The nodes by id."""
        return {node_id: member.node for node_id, member in self._members.items()}

    @property
    def now_ns(self) -> int:
        """How far the run has come."""
        return self._clock.now_ns

    def add(self, member: Member) -> None:
        """Let a node take part."""
        self._members[member.node.identity.id] = member

    def node_ended(self, node: Node) -> None:
        """A node's algorithm is over."""
        self._active -= 1

    def crash(self, node_id: int, reason: str, reboot_after_ns: int | None = None) -> bool:
        """Let a node crash now.

        Until it is back the run goes on; a crash for good, or beyond the horizon, is an end of its algorithm like others.

        Args:
            node_id: Which node.
            reason: What brought it down, for the trace.
            reboot_after_ns: When it comes up again, at least 1; None for never.

        Returns:
            Whether it was up: a node that is down cannot crash.
        """
        member = self._members[node_id]
        if not member.node.crash(reason):
            return False
        if reboot_after_ns is not None and self._clock.now_ns + reboot_after_ns < self.horizon_ns:
            self._active += 1
            self._clock.call_first(reboot_after_ns, lambda _: self._reboot(member))
        return True

    def run(self, progress: Progress | None = None) -> None:
        """Run to the end.

        Raises:
            InvariantError: If the simulation breaks one of its laws, such as the closure of energy.
        """
        self._active = len(self._members)
        for event in self._opening:
            self._recorder.record(event)
        self._sample(None)
        for member in self._members.values():
            member.node.start(member.algorithm, member.handle)
        self._loop(progress or (lambda now_ns: True))

    def conclude(self) -> None:
        """Close every node's energy account at the present instant and check that it balances."""
        for node_id, member in self._members.items():
            parts = member.node.parts
            parts.settle()
            parts.battery.check_closure(parts.account, node_id)
        self._record_samples()
        self._record_harvest()
        self._recorder.record(self._ledger())

    def abandon(self) -> None:
        """End what still runs, unrecorded: the run is over, whatever its algorithms do while they are cleaned up."""
        self._recorder.close()
        for member in self._members.values():
            member.node.abandon()

    def _record_harvest(self) -> None:
        batteries = {number: member.node.parts.battery for number, member in self._members.items()}
        harvested = {number: battery for number, battery in batteries.items() if battery.is_harvested}
        if not harvested:
            return
        for battery in harvested.values():
            battery.settle()
        offered_j = [battery.harvested_j for battery in harvested.values()]
        spilled_j = [battery.spilled_j for battery in harvested.values()]
        self._recorder.record(EnergyHarvest(list(harvested), offered_j, spilled_j))

    def _reboot(self, member: Member) -> None:
        if not member.node.reboot(member.algorithm, member.handle):
            self._active -= 1

    def _ledger(self) -> EnergyLedger:
        rows = [
            (node_id, *key, entry.energy_j, entry.time_ns / NS_PER_S)
            for node_id, member in self._members.items()
            for key, entry in sorted(member.node.parts.account.entries.items())
        ]
        columns = list(zip(*rows, strict=True)) if rows else [()] * 6
        return EnergyLedger(*columns)

    def _loop(self, progress: Progress) -> None:
        environment = self._clock.environment
        step = 0
        looked_ns, still_since_step = -1, 0
        while not self._is_over():
            if environment.peek() >= self.horizon_ns:
                self._clock.run_out(self.horizon_ns)
                break
            environment.step()
            step += 1
            if step % STEPS_BETWEEN_LOOKS == 0:
                now_ns = self._clock.now_ns
                if now_ns != looked_ns:
                    looked_ns, still_since_step = now_ns, step
                elif step - still_since_step > STEPS_AT_ONE_INSTANT:
                    raise AlgorithmError(_stands_still(now_ns))
                if not progress(now_ns):
                    break

    def _is_over(self) -> bool:
        if self._active > 0:
            return False
        return self._air_is_quiet() and all(member.node.parts.is_quiet for member in self._members.values())

    def _sample(self, _: object) -> None:
        """Record what is sampled, again and again where somebody observes it."""
        if self._record_samples():
            self._clock.call_after(self._energy_interval_ns, self._sample)

    def _record_samples(self) -> bool:
        """Record every node's energy and, where clocks drift, its clock; returns whether anything is observed."""
        parts = {node_id: member.node.parts for node_id, member in self._members.items()}
        samples_energy = self._recorder.wants(NodeEnergy)
        if samples_energy:
            batteries = [part.battery for part in parts.values()]
            used_j, left_j = [battery.used_j for battery in batteries], [battery.left_j for battery in batteries]
            self._recorder.record(NodeEnergy(list(parts), used_j, left_j))
        samples_clocks = self._recorder.wants(NodeClocks) and any(part.clock.drifts for part in parts.values())
        if samples_clocks:
            ahead_s = [part.clock.ahead_ns / NS_PER_S for part in parts.values()]
            self._recorder.record(NodeClocks(list(parts), ahead_s))
        return samples_energy or samples_clocks


def _stands_still(now_ns: int) -> str:
    return (
        f"time stands still at {now_ns / NS_PER_S:g} s: an algorithm waits again and again without letting time pass, as "
        "with pause(0) in a loop"
    )
