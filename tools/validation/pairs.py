"""The algorithm of the blind window: two nodes send to a third, with a given gap between them."""

from netsim.api import NodeHandle, Op
from netsim.parameters import NonNegative, parameters

TRIAL_NS = 100_000_000


class Pairs:
    """In trial k, at (k + 1) x 100 ms, node 1 sends; node 2 sends a gap later."""

    @parameters
    class Parameters:
        """Settings."""

        gaps_us: tuple[NonNegative, ...]
        """A gap for each trial."""

    def __init__(self, settings: Parameters) -> None:
        self._gaps_us = settings.gaps_us

    def run(self, node: NodeHandle) -> Op[None]:
        """Send in every trial."""
        for trial, gap_us in enumerate(self._gaps_us, start=1):
            if node.id != 0:
                yield from node.pause_until(trial * TRIAL_NS + (round(gap_us * 1000) if node.id == 2 else 0))
                node.send(0, "pair", bytes(50))
