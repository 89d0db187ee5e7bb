"""A target that manoeuvres at random: the Gauss-Markov mobility model (Liang and Haas 1999), in speed and turning rate.

Both wander around their means with a memory: after a step of dt, v' = a v + (1 - a) v_mean + sqrt(1 - a^2) v_sd w with a =
exp(-dt / memory) and w standard normal, and so does the turning rate around 0. Their spread is the same at all times. At
the border the target is reflected like light.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.parameters import NonNegative, PointM, Positive, parameters
from netsim.units import NS_PER_S, s_to_ns

Box = tuple[float, float, float, float]


@parameters
class ManoeuvreTrack:
    """Random speed and turns, within the field."""

    type: Literal["manoeuvre"] = "manoeuvre"
    """Kind of track."""
    start_m: PointM | None = None
    """Where it enters; null for anywhere in the field."""
    heading_deg: float | None = None
    """Where it heads at first, from north clockwise; null for anywhere."""
    speed_m_per_s: Positive = 7.0
    """Mean speed."""
    speed_sd_m_per_s: NonNegative = 2.0
    """Standard deviation of the speed, which is never below 0."""
    turn_sd_deg_per_s: NonNegative = 10.0
    """Standard deviation of the turning rate, whose mean is 0."""
    memory_s: Positive = 5.0
    """After this time a share of 1/e of a deviation is left."""
    step_s: Annotated[float, Ge(0.01)] = 0.5
    """Time between two changes of speed and heading."""
    enters_s: NonNegative = 0.0
    """When it enters."""
    duration_s: Positive = 60.0
    """How long it is there."""


def manoeuvred(
    parameters: ManoeuvreTrack, field_m: Box, rng: np.random.Generator
) -> tuple[tuple[int, ...], tuple[tuple[float, float], ...]]:
    """Draw a way.

    Args:
        parameters: How it moves.
        field_m: Low x, low y, high x, high y.
        rng: Where chance comes from; a longer way begins as a shorter one does.

    Returns:
        Times in ns, and the places at them in metres.

    Raises:
        ScenarioError: If it starts outside the field.
    """
    begin_ns = s_to_ns(parameters.enters_s)
    end_ns = begin_ns + max(1, s_to_ns(parameters.duration_s))
    times_ns = (*range(begin_ns, end_ns, s_to_ns(parameters.step_s)), end_ns)
    state = _begun(parameters, field_m, rng)
    states = [state]
    for begins_ns, ends_ns in pairwise(times_ns):
        state = _next(state, parameters, (ends_ns - begins_ns) / NS_PER_S, field_m, rng.standard_normal(2))
        states.append(state)
    return times_ns, tuple(state.place_m for state in states)


@dataclass(frozen=True, slots=True)
class _State:
    """Place, heading, and the deviations of speed and turning rate in standard deviations."""

    place_m: tuple[float, float]
    heading_rad: float
    speeding: float
    turning: float


def _begun(parameters: ManoeuvreTrack, field_m: Box, rng: np.random.Generator) -> _State:
    low_x, low_y, high_x, high_y = field_m
    anywhere_m = float(rng.uniform(low_x, high_x)), float(rng.uniform(low_y, high_y))
    anywhere_rad, (speeding, turning) = float(rng.uniform(0.0, 2.0 * math.pi)), rng.standard_normal(2).tolist()
    x_m, y_m = place_m = parameters.start_m or anywhere_m
    if not (low_x <= x_m <= high_x and low_y <= y_m <= high_y):
        text = (
            f"a target that manoeuvres stays in the field, but start_m is ({x_m:g}, {y_m:g}), outside; start within it"
        )
        raise ScenarioError(text)
    heading = anywhere_rad if parameters.heading_deg is None else math.radians(parameters.heading_deg)
    return _State(place_m, heading, speeding, turning)


def _next(
    state: _State, parameters: ManoeuvreTrack, step_s: float, field_m: Box, chance: NDArray[np.float64]
) -> _State:
    speed = max(0.0, parameters.speed_m_per_s + parameters.speed_sd_m_per_s * state.speeding)
    heading = state.heading_rad + math.radians(parameters.turn_sd_deg_per_s) * state.turning * step_s
    ways = math.sin(heading), math.cos(heading)
    (x_m, flips_x), (y_m, flips_y) = (
        _folded(place + speed * step_s * way, low, high)
        for place, way, low, high in zip(state.place_m, ways, field_m[:2], field_m[2:], strict=True)
    )
    memory = math.exp(-step_s / parameters.memory_s)
    fresh = math.sqrt(1.0 - memory**2) * chance
    speeding, turning = memory * state.speeding + float(fresh[0]), memory * state.turning + float(fresh[1])
    return _State((x_m, y_m), math.atan2(ways[0] * flips_x, ways[1] * flips_y), speeding, turning)


def _folded(place: float, low: float, high: float) -> tuple[float, int]:
    """A coordinate reflected into an interval, and -1 if that turns it round, 1 if not."""
    extent = high - low
    along = (place - low) % (2.0 * extent)
    return (low + along, 1) if along <= extent else (high - (along - extent), -1)
