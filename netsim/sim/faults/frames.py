"""What may befall a frame at a listener that would have decoded it."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from netsim.rng import Streams
from netsim.sim.faults.announce import ALWAYS, Announcer, Span
from netsim.sim.faults.chance import KeyedUniforms, Means, TwoStates
from netsim.sim.frames import LinkFrame
from netsim.trace.events import OUTCOME_CODE, OUTCOMES

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
PASSES = -1


class Befalls(Protocol):
    """Decides which listeners lose a frame. It must not depend on what it was asked before."""

    def struck(self, source: int, listeners: Ints, now_ns: int) -> Mask:
        """Which of the listeners lose the frame of `source` that ends now."""
        ...


@dataclass(frozen=True, slots=True)
class FrameFault:
    """A rule about frames, ready for use.

    Attributes:
        outcome: What a struck frame's outcome is called.
        befalls: Which frames are struck.
        announcer: Tells the trace.
        span: When it holds.
        coming: Whether it is on inside the span (its bad state); None where it always is.
    """

    outcome: str
    befalls: Befalls
    announcer: Announcer
    span: Span = ALWAYS
    coming: TwoStates | None = None

    def holds(self, now_ns: int) -> bool:
        """Whether it strikes at all now."""
        return self.span.holds(now_ns) and (self.coming is None or self.coming.is_bad(now_ns))


class FrameFaults:
    """The rules of a scenario about frames; the first that strikes gives the outcome.

    Args:
        rules: In the order of the scenario.
    """

    def __init__(self, rules: Sequence[FrameFault]) -> None:
        self._rules = rules

    def verdict(self, source: int, listener: int, frame: LinkFrame, now_ns: int) -> str | None:
        """The outcome of a frame at one listener; None where it passes. See `verdicts`."""
        code = int(self.verdicts(source, np.array([listener]), frame, now_ns)[0])
        return None if code == PASSES else OUTCOMES[code]

    def verdicts(self, source: int, listeners: Ints, frame: LinkFrame, now_ns: int) -> Ints:
        """Codes in `netsim.trace.events.OUTCOMES`, one a listener; -1 where the frame passes.

        Args:
            source: Node that sent the frame.
            listeners: Node ids, ascending, of those who would have decoded it.
            frame: What was sent.
            now_ns: The end of the frame.
        """
        codes = np.full(len(listeners), PASSES, np.int64)
        for rule in self._rules:
            if not rule.holds(now_ns):
                continue
            struck = (codes == PASSES) & rule.befalls.struck(source, listeners, now_ns)
            if struck.any():
                codes[struck] = OUTCOME_CODE[rule.outcome]
                self._announce(rule, listeners[struck].tolist(), frame)
        return codes

    def _announce(self, rule: FrameFault, struck: Sequence[int], frame: LinkFrame) -> None:
        """Only what was lost to those it was meant for is worth an event; the frame's own record has the others."""
        meant = [node for node in struck if frame.is_for(node)]
        if meant:
            what = "acknowledgement" if frame.is_ack else "frame"
            rule.announcer.strikes(meant, f"{what} from node {frame.source}: {rule.outcome}")


class CutLinks:
    """Directed links that carry nothing.

    Args:
        pairs: (sender, listener).
    """

    def __init__(self, pairs: Set[tuple[int, int]]) -> None:
        listeners: dict[int, list[int]] = {}
        for source, listener in sorted(pairs):
            listeners.setdefault(source, []).append(listener)
        self._listeners = {source: np.array(nodes, np.int64) for source, nodes in listeners.items()}

    def struck(self, source: int, listeners: Ints, now_ns: int) -> Mask:
        """See `Befalls.struck`."""
        cut = self._listeners.get(source)
        return np.zeros(len(listeners), bool) if cut is None else np.isin(listeners, cut)


class CutNodes:
    """Nodes that nobody hears and that hear nobody."""

    def __init__(self, nodes: Set[int]) -> None:
        self._nodes = frozenset(nodes)
        self._array = np.array(sorted(nodes), np.int64)

    def struck(self, source: int, listeners: Ints, now_ns: int) -> Mask:
        """See `Befalls.struck`."""
        return np.ones(len(listeners), bool) if source in self._nodes else np.isin(listeners, self._array)


class Partition:
    """Parts of a network that do not hear each other.

    Args:
        parts: The part of every node that is named; the others are in part 0.
    """

    def __init__(self, parts: Mapping[int, int]) -> None:
        self._parts = np.zeros(max(parts) + 1, np.int64)
        for node, part in parts.items():
            self._parts[node] = part

    def struck(self, source: int, listeners: Ints, now_ns: int) -> Mask:
        """See `Befalls.struck`."""
        struck: Mask = self._of(listeners) != self._of(np.array([source]))
        return struck

    def _of(self, nodes: Ints) -> Ints:
        known = nodes < len(self._parts)
        return np.where(known, self._parts[np.where(known, nodes, 0)], 0)


class Bursts:
    """A Gilbert-Elliott chain for every directed link, made when it is first asked for and independent of when that is.

    Args:
        streams: Random streams of the run.
        name: Of the rule among them.
        means: Mean time in either state.
        loss: Chance of loss in the good and in the bad state.
        pairs: The links it is about; None for all.
    """

    def __init__(
        self,
        streams: Streams,
        name: str,
        means: Means,
        loss: tuple[float, float],
        pairs: Set[tuple[int, int]] | None = None,
    ) -> None:
        self._streams = streams
        self._name = name
        self._means = means
        self._loss = loss
        self._pairs = pairs
        self._chains: dict[tuple[int, int], TwoStates] = {}
        self._uniforms = KeyedUniforms(streams, f"{name}/loss")

    def struck(self, source: int, listeners: Ints, now_ns: int) -> Mask:
        """See `Befalls.struck`."""
        return np.array([self._strikes(source, listener, now_ns) for listener in listeners.tolist()], bool)

    def _strikes(self, source: int, listener: int, now_ns: int) -> bool:
        if self._pairs is not None and (source, listener) not in self._pairs:
            return False
        loss = self._loss[self._chain(source, listener).is_bad(now_ns)]
        return loss > 0.0 and self._uniforms.of(source, listener, now_ns) < loss

    def _chain(self, source: int, listener: int) -> TwoStates:
        chain = self._chains.get((source, listener))
        if chain is None:
            generator = self._streams.generator(f"{self._name}/link/{source}/{listener}")
            chain = self._chains[source, listener] = TwoStates(generator, self._means)
        return chain


class Corruption:
    """A share of the frames has wrong bits.

    Args:
        uniforms: Chance by sender, listener and time.
        share: Of the frames at each listener.
        nodes: The listeners it is about; None for all.
    """

    def __init__(self, uniforms: KeyedUniforms, share: float, nodes: Set[int] | None = None) -> None:
        self._uniforms = uniforms
        self._share = share
        self._nodes = nodes

    def struck(self, source: int, listeners: Ints, now_ns: int) -> Mask:
        """See `Befalls.struck`."""
        chances = [
            (self._nodes is None or listener in self._nodes)
            and self._uniforms.of(source, listener, now_ns) < self._share
            for listener in listeners.tolist()
        ]
        return np.array(chances, bool)
