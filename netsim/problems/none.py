"""No problem: for scenarios that only exercise the network."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.parameters import parameters
from netsim.problems.problem import placement
from netsim.trace.events import Event, VariablePlacement


@parameters
class NoProblemParameters:
    """Nothing to find out; sensors read an empty array."""

    type: Literal["none"] = "none"
    """Selects this problem."""


class NoProblem:
    """See `NoProblemParameters`."""

    kind = "none"

    def instance_json(self) -> str:
        """See `Problem.instance_json`."""
        return "{}"

    def truth_events(self) -> Sequence[Event]:
        """See `Problem.truth_events`."""
        return ()

    def placement_event(self) -> VariablePlacement:
        """See `Problem.placement_event`."""
        return placement({}, {}, ())

    def knowledge(self, node: int) -> None:
        """See `Problem.knowledge`."""
        return

    def later_truth(self, end_ns: int) -> Sequence[tuple[int, Event]]:
        """Nothing: the truth stays as it is."""
        return ()

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """See `Problem.observe`."""
        return np.empty(0)
