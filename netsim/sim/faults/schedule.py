"""Faults that happen at an instant: crashes, jammers, and the beginning and end of rules.

Each asks the clock for its next instant only, and none of them keeps a run from ending.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from netsim.sim.clock import Clock
from netsim.sim.faults.announce import Announcer, Span, named
from netsim.sim.faults.chance import TwoStates
from netsim.units import NS_PER_S

Crash = Callable[[int, str, int | None], bool]
"""Lets a node crash for a reason, for so many ns (None for good); returns whether it was up."""
Draw = Callable[[], float]
"""Draws an exponential number of mean 1."""


class Jammable(Protocol):
    """A medium that can be disturbed."""

    def jam(self, powers_mw: Mapping[int, float]) -> int:
        """Noise-like power at some nodes, until `unjam` is given what this returns."""
        ...

    def unjam(self, token: int) -> None:
        """End of it."""
        ...


@dataclass(frozen=True, slots=True)
class Crashes:
    """When nodes crash, and for how long.

    Attributes:
        nodes: Which nodes.
        at_ns: When, all of them; None for a rate.
        mean_ns: Mean time between crashes of each, where they come at a rate.
        down_ns: How long a node is down; None for ever.
        is_random: Whether that is the mean of an exponential time.
    """

    nodes: Sequence[int]
    at_ns: int | None
    mean_ns: float
    down_ns: int | None
    is_random: bool


class CrashSchedule:
    """Lets nodes crash by one rule.

    Args:
        clock: Simulated time.
        rule: When and for how long.
        crash: Brings a node down.
        announcer: Tells the trace.
        generator: Each node's stream for this rule.
    """

    def __init__(
        self,
        clock: Clock,
        rule: Crashes,
        crash: Crash,
        announcer: Announcer,
        generator: Callable[[int], np.random.Generator],
    ) -> None:
        self._clock = clock
        self._rule = rule
        self._crash = crash
        self._announcer = announcer
        for node in rule.nodes:
            self._plan(node, generator(node).standard_exponential)

    def _plan(self, node: int, draw: Draw) -> None:
        at_ns = self._rule.at_ns
        delay_ns = max(1, round(draw() * self._rule.mean_ns)) if at_ns is None else at_ns - self._clock.now_ns
        self._clock.call_first(max(1, delay_ns), lambda _: self._strike(node, draw))

    def _strike(self, node: int, draw: Draw) -> None:
        down_ns = self._rule.down_ns
        if down_ns is not None and self._rule.is_random:
            down_ns = round(draw() * down_ns)
        bring_down(node, down_ns, self._crash, self._announcer)
        if self._rule.at_ns is None:
            self._plan(node, draw)


def bring_down(node: int, down_ns: int | None, crash: Crash, announcer: Announcer) -> None:
    """Let a node crash, for a time or for good, and say so if it was up."""
    back_ns = None if down_ns is None else max(1, down_ns)
    for_how_long = "for good" if back_ns is None else f"for {back_ns / NS_PER_S:g} s"
    if crash(node, f"fault rule, {for_how_long}", back_ns):
        announcer.crashes(node, f"node {node} is down {for_how_long}")


class Announced:
    """Says when a rule begins and ends.

    Args:
        clock: Simulated time.
        announcer: Tells the trace.
        span: When it holds.
        nodes: Whom it concerns.
        detail: What it does, in words.
        coming: Comes and goes within the span, being bad when the rule is on; None for always on.
    """

    def __init__(
        self,
        clock: Clock,
        announcer: Announcer,
        span: Span,
        nodes: Sequence[int],
        detail: str,
        coming: TwoStates | None = None,
    ) -> None:
        self._clock = clock
        self._announcer = announcer
        self._span = span
        self._nodes = nodes
        self._detail = detail
        self._coming = coming
        self._is_on = False
        _at(clock, span.from_ns, self._look)

    def _look(self) -> None:
        now_ns = self._clock.now_ns
        is_on = self._span.holds(now_ns) and (self._coming is None or self._coming.is_bad(now_ns))
        if is_on != self._is_on:
            self._is_on = is_on
            say = self._announcer.begins if is_on else self._announcer.ends
            say(self._nodes, self._detail)
        if self._span.holds(now_ns):
            self._look_again(now_ns)

    def _look_again(self, now_ns: int) -> None:
        times_ns = [] if self._coming is None else [self._coming.next_change_ns(now_ns)]
        times_ns += [] if self._span.to_ns is None else [self._span.to_ns]
        if times_ns:
            _at(self._clock, min(times_ns), self._look)


class JammerSchedule:
    """Turns a jammer on and off.

    Args:
        clock: Simulated time.
        medium: What it disturbs.
        announcer: Tells the trace.
        position_m: Where it stands.
        powers_mw: What arrives at each node it reaches.
        span: Between its first beginning and its last end.
        period_ns: (on, off) times that repeat; None for always on.
    """

    def __init__(
        self,
        clock: Clock,
        medium: Jammable,
        announcer: Announcer,
        position_m: tuple[float, float],
        powers_mw: Mapping[int, float],
        span: Span,
        period_ns: tuple[int, int] | None,
    ) -> None:
        self._clock = clock
        self._medium = medium
        self._announcer = announcer
        self._powers_mw = powers_mw
        self._span = span
        self._period_ns = period_ns
        reached = named(sorted(powers_mw)) if powers_mw else "nobody"
        self._detail = f"jammer at ({position_m[0]:g}, {position_m[1]:g}) m reaches {reached}"
        _at(clock, span.from_ns, self._on)

    def _on(self) -> None:
        token = self._medium.jam(self._powers_mw)
        self._announcer.begins(sorted(self._powers_mw), self._detail)
        now_ns, to_ns = self._clock.now_ns, self._span.to_ns
        ends_ns = [] if self._period_ns is None else [now_ns + self._period_ns[0]]
        ends_ns += [] if to_ns is None else [to_ns]
        if ends_ns:
            _at(self._clock, min(ends_ns), lambda: self._off(token))

    def _off(self, token: int) -> None:
        self._medium.unjam(token)
        self._announcer.ends(sorted(self._powers_mw), self._detail)
        if self._period_ns is None:
            return
        next_ns = self._clock.now_ns + self._period_ns[1]
        if self._span.holds(next_ns):
            _at(self._clock, next_ns, self._on)


def _at(clock: Clock, time_ns: int, action: Callable[[], None]) -> None:
    """Before everything else of that instant, so that a rule holds for all of it."""
    clock.call_first(time_ns - clock.now_ns, lambda _: action())
