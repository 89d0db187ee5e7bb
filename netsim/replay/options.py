"""What a replay shows, and how fast."""

import math
from dataclasses import dataclass

from netsim.errors import ScenarioError

_REPLAY_WALL_S = 60.0  # a replay is paced to take about this long
_SPEED_RANGE = (0.05, 2.0)
_HOLD_S = 0.15  # long enough to see an arrow grow, short enough not to pile up
_LONGEST_HOLD_WALL_S = 0.75
_TICK_WALL_S = 0.1
_TICKS_A_HOLD = (3, 8)


@dataclass(frozen=True, kw_only=True)
class ReplayOptions:
    """What to show of a trace.

    Attributes:
        start_s: Show from here, simulated seconds.
        end_s: Show up to here; None for the end of the trace.
        speed: Simulated seconds a second of playback; None for a pace fit for the length.
        hold_s: How long an arrow takes to grow from sender to receiver, simulated seconds (true airtimes are too short
            to be seen); None for 0.15 s, less in slow motion.
        tick_s: Arrows move in steps of this many simulated seconds; None for a third to an eighth of `hold_s`.
        kinds: Show frames of these message kinds only; None for all.
        nodes: Show frames from and to these nodes only, and their radios and batteries; None for all.
        graph: Open with the graphical model and its messages in front, not with the map.
        detail_nodes: Above this many nodes energy is plotted as least, mean and most, and no radio time line is made.

    Raises:
        ScenarioError: If a number is not finite or a speed or duration is not positive.
    """

    start_s: float = 0.0
    end_s: float | None = None
    speed: float | None = None
    hold_s: float | None = None
    tick_s: float | None = None
    kinds: frozenset[str] | None = None
    nodes: frozenset[int] | None = None
    graph: bool = False
    detail_nodes: int = 50

    def __post_init__(self) -> None:
        for name, value in (("speed", self.speed), ("hold", self.hold_s), ("tick", self.tick_s)):
            if value is not None and not 0 < value < math.inf:
                msg = f"{name}: expected a finite number > 0, got {value:g}"
                raise ScenarioError(msg)
        for name, value in (("start", self.start_s), ("end", self.end_s)):
            if value is not None and not math.isfinite(value):
                msg = f"{name}: expected a finite number of seconds, got {value:g}"
                raise ScenarioError(msg)


@dataclass(frozen=True, kw_only=True)
class Pace:
    """The options that depend on how long a trace is, decided: a window and its steps, in nanoseconds."""

    start_ns: int
    end_ns: int
    hold_ns: int
    tick_ns: int
    bin_ns: int
    """Width of a bar of "messages per second"."""
    first_bar_ns: int
    """Where the first bar begins: at the start of what was asked for, so that every bar counts all of its time."""
    speed: float


def decide(options: ReplayOptions, last_ns: int) -> Pace:
    """The window and steps for a trace whose last event is at `last_ns`."""
    start_s = max(0.0, options.start_s)
    end_s = min(last_ns / 1e9, math.inf if options.end_s is None else options.end_s)
    length_s = max(end_s - start_s, 1e-3)
    low, high = _SPEED_RANGE
    speed = options.speed or min(high, max(low, nice(length_s / _REPLAY_WALL_S)))
    hold_s = options.hold_s or min(_HOLD_S, _LONGEST_HOLD_WALL_S * speed)
    fewest, most = _TICKS_A_HOLD
    tick_s = options.tick_s or min(hold_s / fewest, max(hold_s / most, _TICK_WALL_S * speed))
    return Pace(
        start_ns=round(start_s * 1e9),
        end_ns=round(max(end_s, start_s) * 1e9) + (options.end_s is None),
        hold_ns=round(hold_s * 1e9),
        tick_ns=max(1, round(tick_s * 1e9)),
        bin_ns=round(nice(length_s / _REPLAY_WALL_S) * 1e9),
        first_bar_ns=round(start_s * 1e9),
        speed=speed,
    )


def nice(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `value`."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(next(step * power for step in (5, 2, 1) if step * power <= value * (1 + 1e-9)))
