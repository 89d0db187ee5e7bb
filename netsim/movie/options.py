"""How a movie is made: its size and length, and which instant each of its pictures shows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.replay.options import ReplayOptions, decide

LONGEST_S = 20.0
"""A movie is at most so long if nothing else is asked for."""
_HOLD_WALL_S = 0.4  # an arrow is in several pictures, or it would be taken for a flicker
_FPS_RANGE = (1.0, 50.0)  # a GIF counts in hundredths of a second, and viewers slow down what is quicker than two
_WIDTH_RANGE = (320, 3840)
_MOST_PICTURES = 20_000


@dataclass(frozen=True, kw_only=True)
class MovieOptions:
    """What a movie looks like.

    Attributes:
        width_px: Width of a picture, rounded down to an even number; None for what suits the format. The height follows.
        fps: Pictures a second; None for what suits the format.
        seconds: How long the movie takes; None for the replay's pace, but at most 20 s. Not together with a speed.
        light: Dark on white, for print and light slides; otherwise light on black.

    Raises:
        ScenarioError: If a number is out of its range.
    """

    width_px: int | None = None
    fps: float | None = None
    seconds: float | None = None
    light: bool = False

    def __post_init__(self) -> None:
        for name, value, (low, high) in (("fps", self.fps, _FPS_RANGE), ("width", self.width_px, _WIDTH_RANGE)):
            if value is not None and not low <= value <= high:
                msg = f"{name}: expected a number from {low:g} to {high:g}, got {value:g}"
                raise ScenarioError(msg)
        if self.seconds is not None and not 0 < self.seconds < math.inf:
            msg = f"seconds: expected a finite number > 0, got {self.seconds:g}"
            raise ScenarioError(msg)


@dataclass(frozen=True, kw_only=True)
class Reel:
    """The pictures of a movie: the k-th one, counted from 0, shows the instant `start_ns + k * step_ns`.

    Attributes:
        start_ns: Simulated time of the first picture.
        end_ns: End of the window, at which the last picture is or just before.
        step_ns: From one picture to the next.
        count: How many there are.
        hold_ns: How long an arrow takes from sender to receiver.
        bin_ns: Width of a bar of "messages per second".
        fps: Pictures a second.
    """

    start_ns: int
    end_ns: int
    step_ns: int
    count: int
    hold_ns: int
    bin_ns: int
    fps: float

    @property
    def times_ns(self) -> NDArray[np.int64]:
        """The instants of all pictures."""
        return self.start_ns + self.step_ns * np.arange(self.count, dtype=np.int64)

    @property
    def speed(self) -> float:
        """Simulated seconds a second of the movie."""
        return self.step_ns * self.fps / 1e9


def plan(options: ReplayOptions, look: MovieOptions, fps: float, last_ns: int) -> Reel:
    """Which instants are shown.

    Args:
        options: Window, speed and hold; where no speed is given it is the replay's, or more so that the movie takes no
            more than `LONGEST_S`.
        look: Length of the movie, if one is asked for.
        fps: Pictures a second.
        last_ns: When the last event of the trace is.

    Raises:
        ScenarioError: If speed and length are both given, or there would be too many pictures.
    """
    pace = decide(options, last_ns)
    length_ns = max(pace.end_ns - pace.start_ns, 1)
    seconds = _seconds(options, look, length_ns / 1e9, pace.speed)
    if seconds * fps > _MOST_PICTURES:
        msg = (
            f"speed: expected a movie of at most {_MOST_PICTURES} pictures, got one of {seconds:.0f} s at {fps:g} a "
            "second; give a greater --speed, or a window by --start and --end"
        )
        raise ScenarioError(msg)
    count = max(2, round(seconds * fps))
    step_ns = max(1, length_ns // (count - 1))
    hold_ns = pace.hold_ns if options.hold_s else round(_HOLD_WALL_S * step_ns * fps)
    return Reel(
        start_ns=pace.start_ns,
        end_ns=pace.end_ns,
        step_ns=step_ns,
        count=count,
        hold_ns=max(hold_ns, step_ns),
        bin_ns=pace.bin_ns,
        fps=fps,
    )


def _seconds(options: ReplayOptions, look: MovieOptions, length_s: float, usual_speed: float) -> float:
    """How long the movie takes."""
    if look.seconds is not None and options.speed is not None:
        msg = "seconds: expected either a speed or a length, got both; leave out --speed or --seconds"
        raise ScenarioError(msg)
    if look.seconds is not None:
        return look.seconds
    if options.speed is not None:
        return length_s / options.speed
    return min(LONGEST_S, length_s / usual_speed)
