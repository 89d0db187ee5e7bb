"""Parameters of correlation-decay data association."""

from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.codec import FloatWidth
from netsim.kernels.correlation_decay import Estimator, VertexOrder
from netsim.parameters import NonNegative, Positive, PositiveInt, parameters


@parameters
class FloodParameters:
    """How far measurements are told, and over which graph of the sensors."""

    graph: Literal["sensing", "overlay"] = "overlay"
    """`sensing`: neighbours are sensors whose discs overlap, as in the paper; an edge between a measurement and an event may
    span several of them. `overlay`: sensors that may have measurements of the same event, in reach or not: `depth` / 2 hops
    (rounded up) then bring all that factors of that depth need, one more what the normalised estimator of side `event` and
    the intervals need."""
    hops: Annotated[int, Ge(0), Le(255)] = 4
    """How many hops; 0 floods nothing."""
    round_s: Positive = 5.0
    """How long a neighbour is waited for in each round, besides `spread_s` for each round so far; one that is silent for so
    long is given up."""
    attempts: PositiveInt = 3
    """How often what a neighbour should have told is asked for in that time."""
    spread_s: NonNegative = 1.0
    """Each round begins at a random moment of so much time; bundles that take longer on the channel than that, all together,
    are in each other's way."""


@parameters
class TargetParameters:
    """Go on until the certified interval of each of a node's pairs is narrow enough.

    A node grows t by two, asks the sensors that may have missing measurements of events within that distance, and computes
    the interval again, until it is as narrow as asked, `depth` is reached, or the allowance is spent. It stops before, with
    what it can certify, when no answer could come before `until_s`, and when sensors that do not answer leave so much open
    that intervals cannot become as narrow as asked by any answer of others, nor narrower by as much. What the estimator
    finds is then brought into the interval: a stated probability is off by no more than the width.
    """

    interval_width: Annotated[float, Ge(0), Le(1)] = 0.05
    """Widest interval that is narrow enough."""
    ask_attempts: PositiveInt = 3
    """How often a sensor that does not answer is asked."""
    answer_s: Positive = 2.0
    """How long an answer is waited for."""
    spread_s: NonNegative = 0.5
    """Questions and answers are sent at random moments of so much time, so that sensors do not all speak at once."""
    allowance_j: Positive | None = None
    """What the node may draw for it, listening included, before it stops asking and growing t; what it has begun, it
    finishes: one question with its `answer_s`, and the intervals of one t. By default there is no limit."""


@parameters
class CorrelationDecayParameters:
    """Association probabilities by correlation decay, each sensor for its own measurements.

    Sensors tell their measurements within some hops, compute factors on what they know, and state, with each probability,
    the interval they can certify: it holds whatever was lost or never told.
    """

    type: Literal["correlation-decay"] = "correlation-decay"
    depth: Annotated[int, Ge(1), Le(200)] = 8
    """Levels of the recursion, t; it is exact at twice the number of events or measurements, whichever are fewer.
    A level is two calls deep, and deeper than 200 there would be no room for them."""
    estimator: Estimator = "normalised"
    """`normalised`: sums to one with the chance of no measurement (or no event, see `side`). `two_factor`: the product of
    two factors. `literal`: the ratio of two products over a list of vertices, as printed; it can exceed one."""
    side: Literal["event", "measurement"] = "event"
    """What the normalised estimator sums to one for, and the first end of the two-factor form."""
    vertices: Literal["own", "known"] = "own"
    """The list of the literal estimator: a sensor's own measurements and their events, as printed, or all it knows."""
    order: VertexOrder = "measurements_first"
    """Order of that list, of which the error depends."""
    factors: Literal["local", "requests"] = "local"
    """Who computes the factors of the literal estimator: the sensor that wants them, or the owner of each vertex, who gets
    the rest of the list with what is removed so far, and answers with the product."""
    flood: FloodParameters = FloodParameters()
    """How measurements are told."""
    target: TargetParameters | None = None
    """Grow t for a narrow interval, up to `depth`; by default t is `depth` from the start."""
    request_s: Positive = 2.0
    """After how long an unanswered request for factors is sent again; an owner who is still at work then says so."""
    request_attempts: PositiveInt = 3
    """How often in a row it is sent without a sign of life before the asker stands in for the owner."""
    until_s: Positive = 60.0
    """When nodes stop answering others, and the algorithm ends."""
    payload: FloatWidth = "float64"
    """Precision of positions on the air; products of factors are float64. All nodes compute with what `payload` leaves of a
    measurement and of an event, and the certified intervals hold for the association problem of those: rounding moves
    likelihoods, and pairs into and out of gates, so that against the exact probabilities of the measured positions
    (`interval_misses`) narrow payloads may miss."""

    def __post_init__(self) -> None:
        """Refuse factors that nobody asks for."""
        if self.factors == "requests" and self.estimator != "literal":
            message = "factors by requests only for the literal estimator: set estimator: literal, or factors: local"
            raise ValueError(message)
