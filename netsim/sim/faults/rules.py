"""The fault rules of a scenario.

Nodes are named by id, by name, or by the name of a group, which stands for all its nodes. Times are true time, intervals
half-open: a rule holds from `from_s` until just before `to_s`. What becomes of a frame is decided at its end, so that a
rule takes the frames that end while it holds.
"""

from typing import Annotated, Literal

from annotated_types import MinLen

from netsim.parameters import NonNegative, PointM, Positive, PositiveInt, Probability, parameters

NodeRef = int | str
"""A node's id or name, or a group's name."""
NodeRefs = Annotated[tuple[NodeRef, ...], MinLen(1)]


def _ordered(from_s: float, to_s: float | None) -> None:
    if to_s is not None and to_s <= from_s:
        message = "from_s below to_s"
        raise ValueError(message)


def _both_or_none(first: str, one: float | None, second: str, other: float | None) -> None:
    if (one is None) != (other is None):
        message = f"{first} and {second} together, or neither"
        raise ValueError(message)


@parameters
class CrashRule:
    """Nodes crash: everything they were doing is lost, and they are off until they reboot, if they do."""

    type: Literal["crash"] = "crash"
    nodes: NodeRefs | None = None
    """Which nodes; null for all."""
    at_s: Positive | None = None
    """When they crash, all of them. Give this or rate_per_h."""
    rate_per_h: Positive | None = None
    """How often each of them crashes, at random instants of its own (Poisson); a node that is down is spared."""
    reboot_after_s: Positive | None = None
    """How long a node stays down, from each crash; null for ever."""
    reboot: Literal["fixed", "exponential"] = "fixed"
    """Whether it stays down exactly that long, or at random with that mean."""

    def __post_init__(self) -> None:
        """Refuse a rule that says nothing, or both."""
        if (self.at_s is None) == (self.rate_per_h is None):
            message = "either at_s or rate_per_h"
            raise ValueError(message)


@parameters
class RoleCrashRule:
    """Whoever holds a role crashes, such as the leader of a group, whichever node that is by then.

    Who holds it is what the nodes' algorithms tell the trace. If nobody does at that time, who takes it next crashes as it
    takes it.
    """

    type: Literal["role-crash"] = "role-crash"
    role: Annotated[str, MinLen(1)]
    """Name of the role, as in the trace: `leader`."""
    at_s: Positive
    """When they crash, all that hold it then."""
    spread_s: NonNegative = 0.0
    """They crash at a random instant within this time after `at_s`, every instant alike; another one in every repetition."""
    reboot_after_s: Positive | None = None
    """How long a node stays down; null for ever."""
    most: PositiveInt | None = None
    """At most so many of those that hold it, the lowest first; null for all."""


@parameters
class OutageRule:
    """Links are cut: between pairs of nodes, or all links of some nodes."""

    type: Literal["outage"] = "outage"
    links: tuple[tuple[NodeRef, NodeRef], ...] = ()
    """Pairs [sender, listener] whose frames are lost; a group stands for each of its nodes."""
    both_directions: bool = True
    """Whether the pairs are cut in the other direction too."""
    nodes: tuple[NodeRef, ...] = ()
    """Nodes that nobody hears and that hear nobody."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""
    mean_up_s: Positive | None = None
    """With mean_down_s: the outage comes and goes at random, all links of the rule together; mean time without it."""
    mean_down_s: Positive | None = None
    """Mean time of an outage; both times are exponential."""

    def __post_init__(self) -> None:
        """Refuse a rule about nothing, and intervals that are none."""
        if not self.links and not self.nodes:
            message = "links or nodes"
            raise ValueError(message)
        _ordered(self.from_s, self.to_s)
        _both_or_none("mean_up_s", self.mean_up_s, "mean_down_s", self.mean_down_s)


@parameters
class PartitionRule:
    """Groups of nodes cannot hear each other; nodes that are named nowhere form one more group."""

    type: Literal["partition"] = "partition"
    groups: Annotated[tuple[NodeRefs, ...], MinLen(1)]
    """The parts, each a list of nodes."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class GilbertElliottRule:
    """Losses in bursts: every directed link changes between a good and a bad state, in continuous time.

    Gilbert, Bell System Technical Journal 39 (1960); Elliott, ibid. 42 (1963). Each link has a chain of its own, which
    starts in equilibrium and goes on whether or not anything is sent.
    """

    type: Literal["gilbert-elliott"] = "gilbert-elliott"
    links: tuple[tuple[NodeRef, NodeRef], ...] | None = None
    """Pairs [sender, listener], one direction each; a group stands for each of its nodes; null for all links."""
    mean_good_s: Positive
    """Mean time in the good state."""
    mean_bad_s: Positive
    """Mean time in the bad state."""
    loss_good: Probability = 0.0
    """Chance that a frame is lost that ends in the good state."""
    loss_bad: Probability = 1.0
    """Chance that a frame is lost that ends in the bad state."""


@parameters
class CorruptionRule:
    """Bits of received frames are flipped; the checksum tells, or does not."""

    type: Literal["corruption"] = "corruption"
    nodes: NodeRefs | None = None
    """At which receivers; null for all."""
    share: Probability
    """Share of the frames that would have been received."""
    undetected_share: Probability = 0.0
    """Share of the corrupted frames that pass the checksum all the same: the network layer gets wrong bytes.

    A 16-bit checksum passes one in 65,536 frames of random bytes (0.000015). Acknowledgements are corrupted only as far
    as the checksum tells, for they carry nothing else.
    """
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class DuplicationRule:
    """Received packets reach the network layer twice."""

    type: Literal["duplication"] = "duplication"
    nodes: NodeRefs | None = None
    """At which receivers; null for all."""
    share: Probability
    """Share of the packets."""
    mean_delay_s: NonNegative = 0.0
    """How much later the second copy comes, at random (exponential) with this mean."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class DelayRule:
    """Received packets reach the network layer late, and so perhaps out of order."""

    type: Literal["delay"] = "delay"
    nodes: NodeRefs | None = None
    """At which receivers; null for all."""
    share: Probability = 1.0
    """Share of the packets."""
    mean_s: Positive
    """How late, at random (exponential) with this mean."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class JammerRule:
    """A transmitter that disturbs: noise-like power at every node, by the medium's path loss without its shadowing.

    Its bandwidth is taken to be the receivers'. It reaches nodes where they stood when the run began.
    """

    type: Literal["jammer"] = "jammer"
    position_m: PointM
    """Where it stands."""
    power_dbm: float
    """Power it radiates in the receivers' band."""
    from_s: NonNegative = 0.0
    """When it begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""
    on_s: Positive | None = None
    """With off_s: it radiates so long, then pauses, again and again; by default it never pauses."""
    off_s: Positive | None = None
    """Length of its pauses."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)
        _both_or_none("on_s", self.on_s, "off_s", self.off_s)


@parameters
class SensorBiasRule:
    """Readings are off by a constant and a drift."""

    type: Literal["sensor-bias"] = "sensor-bias"
    nodes: NodeRefs
    """Whose sensors."""
    bias: float = 0.0
    """Added to every value, in the unit of the reading (tracking: of amplitudes, or radians of bearings)."""
    drift_per_h: float = 0.0
    """Added to the bias for every hour since the rule began, in the unit of the reading."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class SensorStuckRule:
    """Readings repeat the last one from before the rule began, or else the first one after."""

    type: Literal["sensor-stuck"] = "sensor-stuck"
    nodes: NodeRefs
    """Whose sensors."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class SensorNoiseRule:
    """Readings have noise that the node does not know of."""

    type: Literal["sensor-noise"] = "sensor-noise"
    nodes: NodeRefs
    """Whose sensors."""
    sd: Positive
    """Standard deviation of the normal noise of every value, in the unit of the reading."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


@parameters
class SensorDeadRule:
    """Readings hold no measurement: an array without rows. Reading takes its time and energy as ever."""

    type: Literal["sensor-dead"] = "sensor-dead"
    nodes: NodeRefs
    """Whose sensors."""
    from_s: NonNegative = 0.0
    """When the rule begins."""
    to_s: Positive | None = None
    """When it ends; null for the end of the run."""

    def __post_init__(self) -> None:
        """Refuse intervals that are none."""
        _ordered(self.from_s, self.to_s)


FrameRule = OutageRule | PartitionRule | GilbertElliottRule | CorruptionRule
PacketRule = CorruptionRule | DuplicationRule | DelayRule
SensorRule = SensorBiasRule | SensorStuckRule | SensorNoiseRule | SensorDeadRule
FaultRule = CrashRule | RoleCrashRule | FrameRule | DuplicationRule | DelayRule | JammerRule | SensorRule
