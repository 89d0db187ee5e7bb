"""Settings of centralised Bayesian tracking."""

from typing import Literal

from netsim.codec import FloatWidth
from netsim.parameters import NonNegative, Positive, parameters


@parameters
class CentralBayesParameters:
    """Every sensor sends every reading to the sink, which tracks with all that come in time."""

    type: Literal["central-bayes"] = "central-bayes"
    spread_s: NonNegative = 0.25
    """Each sensor sends its reading at a random time within this after taking it, so that they do not all speak at once."""
    deadline_s: Positive = 0.4
    """How long after a reading instant the sink waits for readings; those that come later are counted and left out. It goes
    on at once when all sensors have told theirs."""
    least_probability: NonNegative = 2e-5
    """Cells of the belief below this are dropped after every instant."""
    payload: FloatWidth = "float32"
    """Precision of readings on the air."""
    sleep: Literal["none", "scheduled"] = "none"
    """`scheduled`: radios, but the sink's, are on from each reading instant until the deadline alone, by the nodes' clocks;
    `none` leaves them to the MAC."""
    guard_s: NonNegative = 0.005
    """`scheduled`: how much sooner they wake and later they sleep, for the radio's start and for clocks that disagree."""
    until_s: Positive | None = None
    """When the nodes stop; by default at the end of the run."""

    def __post_init__(self) -> None:
        """Readings are sent before they are too late."""
        if self.spread_s >= self.deadline_s:
            message = "spread_s below deadline_s"
            raise ValueError(message)
