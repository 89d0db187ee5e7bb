"""Settings of the IDSQ tracker."""

from typing import Literal

from netsim.algorithms.idsq_payload import BeliefForms
from netsim.codec import Precision
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
    least_probability: NonNegative = 2e-5
    """Cells of the belief below this are dropped after every reading."""
    payload: Precision = "float32"
    """Precision of probabilities on the air."""
    belief: BeliefForms = BeliefForms()
    """How a belief is laid out."""
    handoff_tries: NonNegativeInt = 3
    """How often a hand-off that was not acknowledged is sent to one node; then the next best is tried."""
    until_s: Positive | None = None
    """When the nodes stop; by default at the end of the run."""
