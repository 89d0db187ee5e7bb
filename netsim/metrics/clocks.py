"""How far the nodes' clocks were from true time, from the samples in the trace."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from netsim.trace.events import NodeClocks
from netsim.trace.recorder import Handler


class Clocks:
    """Error against true time over all nodes and samples, and spread among the nodes: what synchronisation narrows.

    There are no figures where all clocks are perfect.
    """

    def __init__(self) -> None:
        self._count = 0
        self._squares_s2: list[float] = []
        self._largest_s = 0.0
        self._largest_spread_s = 0.0
        self._last_spread_s = 0.0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {NodeClocks: self._on_clocks}

    def figures(self) -> dict[str, Any]:
        """The metrics; units in the keys."""
        if not self._count:
            return {}
        return {
            "clock_error_max_s": self._largest_s,
            "clock_error_rms_s": math.sqrt(math.fsum(self._squares_s2) / self._count),
            "clock_spread_max_s": self._largest_spread_s,
            "clock_spread_last_s": self._last_spread_s,
        }

    def _on_clocks(self, event: NodeClocks, _: int) -> None:
        ahead_s = np.asarray(event.ahead_s, dtype=float)
        self._count += len(ahead_s)
        self._squares_s2.append(math.fsum((ahead_s * ahead_s).tolist()))
        self._largest_s = max(self._largest_s, float(np.abs(ahead_s).max()))
        self._last_spread_s = float(ahead_s.max() - ahead_s.min())
        self._largest_spread_s = max(self._largest_spread_s, self._last_spread_s)
