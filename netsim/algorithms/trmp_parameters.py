"""The settings of distributed tree-reweighted max-product."""

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from netsim.kernels.trmp import TreeSchedule
from netsim.parameters import NonNegative, Positive, PositiveInt, parameters
from netsim.protocols.exchange import Manner


@parameters
class TrmpParameters:
    """Tree-reweighted max-product: finds the MAP state and proves it, or says that it could not."""

    type: Literal["trmp"] = "trmp"
    """Selects this algorithm."""
    schedule: TreeSchedule = "two_pass"
    """On each tree: from the leaves inward and back out, one message a directed edge; or `flooding`, parallel rounds, as
    many as the tree's longest path has edges."""
    iterations: Annotated[int, Ge(1), Le(65_535)] = 100
    """Most iterations; then the answer is not proved."""
    damping: Annotated[float, Gt(0), Le(1)] = 0.5
    """Share of each step of the reparameterization that is taken: 0.5 is the geometric mean of old and new compatibilities,
    1 the step as printed, which oscillates on dense graphs."""
    setup_s: Positive = 6.0
    """Time for sensing and for the exchange of measurements before anything else. Without them nothing is proved."""
    setup_attempts: PositiveInt = 6
    """How often a measurement is sent that was not acknowledged."""
    setup_exchange: Manner = "unicast"
    """How measurements are exchanged (see `max-product`)."""
    time_limit_s: Positive = 600.0
    """When nodes give up waiting, from the start of the run; where other nodes host the sensors' variables (`model` of the
    problem), they are told what these conclude within 4 `stall_s` more."""
    spread_s: NonNegative = 0.02
    """Before it sends, a node waits at random up to this long: others have their turn, and messages gather."""
    hold_s: NonNegative = 0.1
    """How much later a growing tree passes an edge that has one already; several times what a message takes."""
    resend: Annotated[int, Ge(0), Le(50)] = 10
    """How often a message that the link layer gave up is sent again."""
    resend_s: Positive = 0.5
    """Longest pause before it is sent again."""
    stall_s: Positive = 5.0
    """How long a node hears nothing new before it asks for what it lacks; then twice as long, up to 32 times. A loss that
    comes to light in this way makes nodes confirm messages to each other: on links that do not acknowledge, later ones cost
    a round trip each."""
    payload: Literal["float64", "float32"] = "float64"
    """Precision of numbers on the air. With float32 a state must be better than the next by a factor of e^0.001, not
    e^(10^-9), to count as the only best one: rounding must not prove anything."""
