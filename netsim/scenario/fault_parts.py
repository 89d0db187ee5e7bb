"""From one fault rule to what it does at each layer."""

from collections.abc import Callable, Iterator, Sequence

from netsim.rng import Streams
from netsim.sim.clock import Clock
from netsim.sim.faults.announce import ALWAYS, Announcer, Span, named
from netsim.sim.faults.chance import KeyedUniforms, Means, TwoStates
from netsim.sim.faults.frames import Befalls, Bursts, Corruption, CutLinks, CutNodes, FrameFault, Partition
from netsim.sim.faults.packets import Garbled, Late, PacketChange, PacketFault, Repeated, undetected
from netsim.sim.faults.rules import (
    CorruptionRule,
    DelayRule,
    DuplicationRule,
    FaultRule,
    GilbertElliottRule,
    NodeRef,
    OutageRule,
    PartitionRule,
    SensorBiasRule,
    SensorDeadRule,
    SensorNoiseRule,
    SensorStuckRule,
)
from netsim.sim.faults.schedule import Announced
from netsim.sim.faults.sensors import Biased, Dead, Noisy, ReadingChange, SensorFault, Stuck
from netsim.trace.recorder import Recorder
from netsim.units import s_to_ns

Nodes = Callable[[Sequence[NodeRef] | None], set[int]]
Pairs = Callable[[Sequence[tuple[NodeRef, NodeRef]]], set[tuple[int, int]]]


def span_of(rule: FaultRule) -> Span:
    """When a rule holds."""
    to_s = getattr(rule, "to_s", None)
    return Span(s_to_ns(getattr(rule, "from_s", 0.0)), None if to_s is None else s_to_ns(to_s))


class FaultParts:
    """What one rule does to frames, packets and readings, and how it is told.

    Args:
        index: Position of the rule in the scenario.
        rule: The rule.
        clock: Simulated time.
        recorder: Where faults are told.
        streams: Random streams of the run.
        nodes: From references to nodes.
        pairs: From references to directed links.

    Attributes:
        name: Of the rule among the random streams.
        announcer: Tells the trace.
    """

    def __init__(
        self,
        index: int,
        rule: FaultRule,
        clock: Clock,
        recorder: Recorder,
        streams: Streams,
        nodes: Nodes,
        pairs: Pairs,
    ) -> None:
        self.index = index
        self.name = f"fault/{index}"
        self.announcer = Announcer(clock, recorder, index, rule.type)
        self._rule = rule
        self._clock = clock
        self._streams = streams
        self._nodes = nodes
        self._pairs = pairs
        self._span = span_of(rule)

    def announce(self) -> None:
        """Tell when the rule begins and ends."""
        coming, nodes = self._coming(), sorted(self._concerned())
        Announced(self._clock, self.announcer, self._span, nodes, self._words(nodes), coming)

    def frames(self) -> Iterator[FrameFault]:
        """What it does to frames at their listeners."""
        rule = self._rule
        if isinstance(rule, OutageRule):
            for befalls in self._cuts(rule):
                yield FrameFault("outage", befalls, self.announcer, self._span, self._coming())
        elif isinstance(rule, PartitionRule):
            parts = {node: part for part, group in enumerate(rule.groups, 1) for node in self._nodes(group)}
            yield FrameFault("outage", Partition(parts), self.announcer, self._span)
        elif isinstance(rule, GilbertElliottRule):
            means, loss = Means(rule.mean_good_s, rule.mean_bad_s), (rule.loss_good, rule.loss_bad)
            pairs = None if rule.links is None else self._pairs(rule.links)
            yield FrameFault("lost", Bursts(self._streams, self.name, means, loss, pairs), self.announcer, ALWAYS)
        elif isinstance(rule, CorruptionRule):
            detected = rule.share * (1.0 - rule.undetected_share)
            befalls = Corruption(self._uniforms("detected"), detected, self._nodes(rule.nodes))
            yield FrameFault("corrupted", befalls, self.announcer, self._span)

    def packets(self, node: int) -> Iterator[PacketFault]:
        """What it does to packets that came in at a node."""
        change = self._packet_change()
        if change is not None and node in self._concerned():
            yield PacketFault(change[0], self.announcer, self._span, change[1])

    def sensor(self, node: int) -> Iterator[SensorFault]:
        """What it does to the readings of a node."""
        change = self._reading_change(node)
        if change is not None and node in self._concerned():
            yield SensorFault(change, self.announcer, self._span)

    def _cuts(self, rule: OutageRule) -> Iterator[Befalls]:
        if rule.links:
            pairs = self._pairs(rule.links)
            yield CutLinks(pairs | {(listener, source) for source, listener in pairs if rule.both_directions})
        if rule.nodes:
            yield CutNodes(self._nodes(rule.nodes))

    def _packet_change(self) -> tuple[PacketChange, str] | None:
        rule = self._rule
        if isinstance(rule, CorruptionRule) and rule.undetected_share > 0.0:
            return Garbled(self._uniforms("undetected"), undetected(rule.share, rule.undetected_share)), "wrong bytes"
        if isinstance(rule, DuplicationRule):
            return Repeated(self._uniforms("packet"), rule.share, rule.mean_delay_s), "comes twice"
        if isinstance(rule, DelayRule):
            return Late(self._uniforms("packet"), rule.share, rule.mean_s), "comes late"
        return None

    def _reading_change(self, node: int) -> ReadingChange | None:
        rule = self._rule
        if isinstance(rule, SensorBiasRule):
            return Biased(rule.bias, rule.drift_per_h, self._span.from_ns)
        if isinstance(rule, SensorStuckRule):
            return Stuck()
        if isinstance(rule, SensorNoiseRule):
            return Noisy(self._streams, f"{self.name}/node/{node}", rule.sd)
        return Dead() if isinstance(rule, SensorDeadRule) else None

    def _uniforms(self, purpose: str) -> KeyedUniforms:
        return KeyedUniforms(self._streams, f"{self.name}/{purpose}")

    def _coming(self) -> TwoStates | None:
        """The process of an outage that comes and goes; the same one however often it is made."""
        rule = self._rule
        if not isinstance(rule, OutageRule) or rule.mean_up_s is None or rule.mean_down_s is None:
            return None
        return TwoStates(self._streams.generator(f"{self.name}/outage"), Means(rule.mean_up_s, rule.mean_down_s))

    def _concerned(self) -> set[int]:
        rule = self._rule
        if isinstance(rule, PartitionRule):
            return self._nodes([reference for group in rule.groups for reference in group])
        if isinstance(rule, OutageRule):
            ends = {node for pair in self._pairs(rule.links) for node in pair}
            return ends | (self._nodes(rule.nodes) if rule.nodes else set())
        if isinstance(rule, GilbertElliottRule):
            return self._nodes(None) if rule.links is None else {n for pair in self._pairs(rule.links) for n in pair}
        return self._nodes(getattr(rule, "nodes", None))

    def _words(self, nodes: Sequence[int]) -> str:
        """What the rule does, for people."""
        rule = self._rule
        if isinstance(rule, PartitionRule):
            return " | ".join(named(sorted(self._nodes(group))) for group in rule.groups) + " | the others"
        if isinstance(rule, OutageRule):
            words = [f"{a} to {b}" for a, b in sorted(self._pairs(rule.links))]
            words += [f"all links of {named(sorted(self._nodes(rule.nodes)))}"] if rule.nodes else []
            return "links cut: " + ", ".join(words[:6]) + (f" and {len(words) - 6} more" if len(words) > 6 else "")
        return named(nodes)
