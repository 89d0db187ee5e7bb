"""Records that use every kind of declaration, for the tests of reading."""

from typing import Annotated, Any, Literal

from annotated_types import MaxLen, MinLen

from netsim.parameters import (
    Name,
    NonNegative,
    NonNegativeInt,
    PointM,
    Positive,
    PositiveInt,
    Probability,
    parameters,
)


@parameters
class Disk:
    """Everything within a radius is received."""

    type: Literal["disk"]
    radius_m: Positive
    """Greatest distance of reception. Beyond it nothing arrives."""
    delay_s: NonNegative = 0.0
    """Time in the air."""


@parameters
class LogDistance:
    type: Literal["log-distance"]
    exponent: Positive = 3.0
    tx_power_dbm: float = 0.0


@parameters
class Battery:
    capacity_mah: Positive = 1000.0
    low_v: Positive = 1.8
    high_v: Positive = 3.0

    def __post_init__(self) -> None:
        if self.low_v >= self.high_v:
            raise ValueError("low_v below high_v")


@parameters
class Sourced:
    value: Positive
    """In the unit of the key above."""


@parameters
class Group:
    count: PositiveInt
    """How many nodes."""
    origin_m: PointM = (0.0, 0.0)
    tags: Annotated[tuple[Name, ...], MinLen(1), MaxLen(3)] = ("all",)
    role: Literal["sensor", "sink"] = "sensor"
    battery: Battery | None = None
    algorithm: Any = None


@parameters
class Root:
    """A scenario for tests."""

    seed: int
    """Seed of every stream."""
    medium: Disk | LogDistance
    """The shared air."""
    nodes: tuple[Group, ...] = ()
    loss: Probability = 0.0
    note: str | None = None
    debug: bool = False
    limit: PositiveInt | Literal["none"] = "none"
    weights: dict[Name, float] | None = None
    supply_v: Sourced | None = None
    rate_bit_per_s: NonNegative = 0.0
    retries: NonNegativeInt = 3


@parameters
class Gossip:
    type: Literal["gossip"] = "gossip"
    rounds: PositiveInt = 1


@parameters
class Untagged:
    period_s: Positive = 1.0
