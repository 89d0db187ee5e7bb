"""Settings that every kind of network has, and the frozen records for finding neighbours."""

from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.parameters import NonNegative, NonNegativeInt, Positive, PositiveInt, Probability, parameters

HopLimit = Annotated[int, Ge(1), Le(255)]


@parameters
class GivenNeighbours:
    """Neighbours, their distance and the quality of their links are known from the start, as if surveyed beforehand."""

    type: Literal["given"] = "given"


@parameters
class BeaconDiscovery:
    """Neighbours are found by beacons: real frames that are charged. At the start a node knows of nobody.

    Links are estimated as by the four-bit estimator of TinyOS (Fonseca et al. 2007; its weights and windows are the
    defaults): the share of a neighbour's beacons that came, by gaps in their numbers, what it reports of ours, and how
    many transmissions data took until it was acknowledged.
    """

    type: Literal["beacons"] = "beacons"
    period_s: Positive = 10.0
    """Mean time between a node's beacons (GPSR, Karp and Kung 2000)."""
    jitter: Probability = 0.5
    """Each interval is drawn from period_s x (1 - jitter) to period_s x (1 + jitter)."""
    validity_periods: Annotated[float, Ge(1)] = 4.5
    """A neighbour that was not heard for so many periods is forgotten (GPSR)."""
    positions: bool = True
    """Whether beacons carry the sender's position (8 bytes); geographic routing and geocast need it."""
    most_neighbours: PositiveInt = 32
    """Size of the neighbour table; when full, a new neighbour replaces one above `evict_etx`, or is ignored."""
    ewma_weight: Annotated[float, Ge(0), Le(0.99)] = 0.9
    """Weight of the past in every estimate."""
    beacon_window: PositiveInt = 3
    """Beacons, heard or missed, that make one estimate."""
    data_window: PositiveInt = 5
    """Transmissions of data that make one estimate."""
    largest_gap: PositiveInt = 10
    """A neighbour that missed more beacons is estimated from scratch."""
    evict_etx: Positive = 6.5
    """Expected transmissions above which a neighbour gives way to a new one."""


Discovery = GivenNeighbours | BeaconDiscovery


@parameters
class NetworkSettings:
    """What does not depend on the kind of routing."""

    discovery: Discovery = GivenNeighbours()
    """How nodes come to know their neighbours."""
    reassembly_timeout_s: Positive = 30.0
    """How long after its first fragment a message is waited for (RFC 791 proposes 15 s, RFC 8200 60 s)."""
    reassembly_messages: PositiveInt = 64
    """How many incomplete messages a node keeps; a fragment of one more is dropped as `reassembly_full`."""
    memory_s: Positive = 60.0
    """How long a node remembers what it received or forwarded, to tell copies; longer than any packet is under way."""
    hop_limit: HopLimit = 255
    """Packets that have made so many hops are dropped."""
    forward_delay_s: NonNegative = 0.02
    """A flooded packet is passed on after a random time up to this, so that not all neighbours speak at once."""
    waiting_packets: PositiveInt = 64
    """Packets that wait in the network layer, to be flooded on or tried again; more are dropped as `queue_full`."""
    retries: NonNegativeInt = 0
    """How often a packet that the link layer gave up, or that found no way, is routed anew."""
    retry_delay_s: Positive = 0.1
    """A new try is made after a random time up to this."""

    def __post_init__(self) -> None:
        """A message is remembered for longer than its fragments are waited for."""
        if self.memory_s <= self.reassembly_timeout_s:
            message = "memory_s above reassembly_timeout_s"
            raise ValueError(message)
