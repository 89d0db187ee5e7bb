"""Delivery ratios that were measured, to be replayed: the chance of a frame on a link at a time, whatever the cause."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class DeliveryRatios(Protocol):
    """What a trace says of the frames of one sender; interference comes on top."""

    def ratios(self, source: int, now_ns: int) -> Floats:
        """Chance that a frame of `source` sent now arrives, at each node it reaches (ascending by id, as its links)."""
        ...
