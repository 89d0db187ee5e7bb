"""Settings of the IDSQ tracker."""

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le, Lt

from netsim.algorithms.idsq_payload import BeliefForms
from netsim.codec import Precision
from netsim.kernels.selection import BIT_PER_JOULE, SelectionRule
from netsim.parameters import NonNegative, NonNegativeInt, Positive, PositiveInt, Probability, parameters


@parameters
class IdsqSleep:
    """Radios sleep between windows at the reading instants.

    Leaders, their guards and those who elect one stay awake. With `robust`, leaders claim their tracks at the beginning of
    a window too, and nodes that know the leader or are near the target stay awake for the hand-off; without, the window must
    hold all of it.
    """

    window_s: Positive = 0.05
    """How long all nodes listen after each reading instant."""
    guard_s: NonNegative = 0.005
    """How much sooner they wake and later they sleep: for the radio's start and for clocks that disagree."""
    near_m: NonNegative = 30.0
    """`robust`: nodes within this distance of an estimate are near."""


@parameters
class IdsqWatch:
    """How tracks begin and end by themselves."""

    false_alarm: Annotated[float, Gt(0), Lt(0.5)] = 1e-6
    """Probability that noise alone makes a watchdog raise the alarm at one reading; sets the threshold of detection."""
    detection_amplitude: Positive | None = None
    """Amplitude from which on watchdogs raise the alarm, if above the threshold that follows from `false_alarm` and the
    noise that the sensors assume; null for that threshold. Those who hear a target so loud had better be in radio reach of
    each other, lest several begin a track of it."""
    election_s: Positive = 0.15
    """How long those in reach elect the loudest of them, who begins the track."""
    square_m: Positive = 50.0
    """A track begins with a uniform belief in a square around its first leader, this far to each side (section 5.2.3)."""
    inhibit_m: Positive = 60.0
    """Watchdogs within this distance of a track's estimate are quiet."""
    lost_after: NonNegativeInt = 6
    """A track ends after so many readings in a row that may be noise, or with most of the belief in the outermost cells;
    0 for never. The track of a first leader that was told to lead ends so only where another track is heard of."""
    same_m: Positive = 25.0
    """Of two tracks whose estimates come closer than this, the younger ends."""


@parameters
class IdsqCost:
    """What a hand-off costs and what energy is worth, for the rules that weigh information against it."""

    joule_per_byte: Positive = 3.5e-6
    """Energy to send a byte and to receive it; the default is the CC2420's: 17.4 mA and 18.8 mA at 3 V, 250 kbit/s."""
    bit_per_joule: NonNegative = BIT_PER_JOULE
    """`information_less_cost`: price of energy, in bits of information; handing over 200 cells takes some 5 mJ."""


@parameters
class IdsqParameters:
    """Information-driven tracking: one leader holds the belief, senses, and hands it to the most informative neighbour."""

    type: Literal["idsq"] = "idsq"
    selection: SelectionRule = "mutual_information"
    """How the next leader is chosen (see `netsim.kernels.selection.utilities`); under `all`, all neighbours sense too, and
    send the leader their readings."""
    cost: IdsqCost = IdsqCost()
    """For `information_less_cost` and `information_per_joule`."""
    gather_s: Positive = 0.1
    """`selection: all`: how long a leader waits for its neighbours' readings after its own."""
    exact_information: bool = False
    """Whether mutual information goes through every cell of the belief instead of ranges or bearings (section 4.3)."""
    excludes_previous: bool = True
    """The triplet rule: who led before the leader is not among its neighbours."""
    first_step: Literal["senses", "hands_over"] = "senses"
    """What the first leader, whose belief is uniform, does with it: `senses` first at the next reading instant, as anybody
    whom a belief reaches does; `hands_over` at once to the most informative neighbour. The paper does not say."""
    least_probability: NonNegative = 2e-5
    """Cells of the belief below this are dropped after every reading."""
    payload: Precision = "float32"
    """Precision of probabilities on the air."""
    belief: BeliefForms = BeliefForms()
    """How a belief is laid out."""
    handoff_tries: PositiveInt = 3
    """How often a hand-off that was not acknowledged is sent to one node; then the next best is tried."""
    gate: Probability = 0.0
    """A reading is not used if one as unlikely under the belief has less than this probability, but for the third in a row;
    0 uses every reading."""
    threads: Annotated[int, Ge(1), Le(255)] = 1
    """How many leaders track a target beside each other, each with a belief of its own."""
    robust: bool = False
    """Whether hand-offs are acknowledged by who takes them, leaders claim their tracks every step, and who led before stands
    guard to take a track back from a leader that fell silent; without it the tracker is plain Table 1."""
    answer_s: Positive = 0.05
    """`robust`: how long to wait for who is to take a belief, or is asked whether it is alive."""
    patience_s: Positive | None = None
    """`robust`: how long after a reading instant a guard waits for its successor's claim; by default 60 % of the time
    between two readings."""
    suspect_s: NonNegative = 10.0
    """`robust`: how long a node that did not answer is left out of the choice."""
    watch: IdsqWatch = IdsqWatch()
    """`robust`: how watchdogs begin tracks, and how tracks end; see the problem's `watchdogs`."""
    sleep: IdsqSleep | None = None
    """Whether radios sleep between hand-offs, by the nodes' clocks; null leaves it to the MAC."""
    until_s: Positive | None = None
    """When the nodes stop; by default at the end of the run."""
