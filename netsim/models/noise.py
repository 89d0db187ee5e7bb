"""Background noise at each receiver: constant, or changing in steps of equal length.

Asking changes nothing: the noise of a node in a step depends on the run's streams, the node and the step alone.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Noise(Protocol):
    """Noise powers of all nodes, ascending by id.

    Attributes:
        step_ns: Length of a step of constant noise; None if it never changes.
        typical_mw: (N,) what link qualities are computed with: the median over time.
    """

    @property
    def step_ns(self) -> int | None:
        """Length of a step of constant noise; None if it never changes."""
        ...

    @property
    def typical_mw(self) -> Floats:
        """(N,) median over time, in mW: what link qualities are computed with."""
        ...

    def power_mw(self, step: int) -> Floats:
        """(N,) noise powers during [step * step_ns, (step + 1) * step_ns), in mW; step 0 where it never changes."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class ConstantNoise:
    """Noise that never changes; receivers may differ.

    Attributes:
        typical_mw: (N,) noise powers.
    """

    typical_mw: Floats

    @property
    def step_ns(self) -> None:
        """See `Noise.step_ns`."""
        return

    def power_mw(self, step: int) -> Floats:
        """See `Noise.power_mw`."""
        return self.typical_mw
