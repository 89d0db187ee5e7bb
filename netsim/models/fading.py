"""Block fading: a power gain that is drawn anew for every frame and listener, and constant over the frame."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Fading(Protocol):
    """A distribution of power gains of mean 1 (so that link budgets stay what path loss and shadowing say)."""

    def gains(self, generator: np.random.Generator, size: int) -> Floats:
        """Draw (size,) linear power gains, one a listener."""
        ...
