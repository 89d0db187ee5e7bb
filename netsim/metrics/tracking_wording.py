"""Beliefs and choices of leaders in words, for time lines."""

import math
from collections.abc import Callable

from netsim.metrics.tracking_beliefs import belief_of
from netsim.metrics.wording import counted, listed
from netsim.trace.events import Belief, Handoff

_NOTHING_BIT = 1e-9  # rounding


def belief_words(event: Belief) -> str:
    """How wide a belief is."""
    cells = len(event.cell)
    spread = f", spread {math.sqrt(belief_of(event).variance_m2):.4g} m" if cells else ""
    return f"step {event.step} of {_line(event).rstrip(',')}: {counted(cells, 'cell')}{spread}"


def handoff_words(event: Handoff, label: Callable[[int], str]) -> str:
    """Who is to lead next, among whom it was chosen, and how the belief is laid out."""
    worth = zip(map(int, event.candidate), map(float, event.utility), strict=True)
    among = listed(f"{label(node)} {value:.4g}" for node, value in sorted(worth, key=lambda each: -each[1]))
    lost = f", loses {event.divergence_bit:.3g} bit" if event.divergence_bit > _NOTHING_BIT else ""
    return (
        f"{label(event.destination)} to lead {_line(event)} next, by utility of {among}; "
        f"belief as {event.form}, {event.payload_byte} byte{lost}"
    )


def _line(event: Belief | Handoff) -> str:
    """The track, and which of its redundant threads, but for the first."""
    return f"track {event.target}" + (f", thread {event.thread + 1}," if event.thread else "")
