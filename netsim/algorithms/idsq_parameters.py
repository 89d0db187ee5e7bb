"""Settings of the IDSQ tracker."""

from typing import Literal

from netsim.codec import FloatWidth
from netsim.kernels.selection import SelectionRule
from netsim.parameters import NonNegative, NonNegativeInt, Positive, parameters


@parameters
class IdsqParameters:
    """Information-driven tracking: one leader holds the belief, senses, and hands it to the most informative neighbour."""

    type: Literal["idsq"] = "idsq"
    selection: SelectionRule = "mutual_information"
    """How the next leader is chosen (see `netsim.kernels.selection.utilities`)."""
    exact_information: bool = False
    """Whether mutual information goes through every cell of the belief instead of ranges or bearings (section 4.3)."""
    excludes_previous: bool = True
    """The triplet rule: who led before the leader is not among its neighbours."""
    first_step: Literal["senses", "hands_over"] = "senses"
    """What the first leader, whose belief is uniform, does with it: `senses` first at the next reading instant, as anybody
    whom a belief reaches does; `hands_over` at once to the most informative neighbour. The paper does not say."""
    least_probability: NonNegative = 2e-5
    """Cells of the belief below this are dropped after every reading."""
    payload: FloatWidth = "float32"
    """Precision of probabilities on the air."""
    handoff_tries: NonNegativeInt = 3
    """How often a hand-off that was not acknowledged is sent to one node; then the next best is tried."""
    until_s: Positive | None = None
    """When the nodes stop; by default at the end of the run."""
