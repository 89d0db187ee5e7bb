"""Which instants `netsim track` shows, and the picture of them."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from netsim.cli.console import say
from netsim.errors import ScenarioError
from netsim.snapshots.moment import HOLD_S, SOON_S
from netsim.units import NS_PER_S, s_to_ns

MOST_PANELS = 12
"""Panels that one picture may have."""


def chosen_times_ns(beliefs_ns: Sequence[int], at_s: Sequence[float]) -> list[int]:
    """The instants asked for, in order, each once; if a belief is told right after one, because it took time, that of it.

    Args:
        beliefs_ns: When beliefs are told, in order.
        at_s: What is asked for.

    Raises:
        ScenarioError: For one at which there is no belief yet, or none any more.
    """
    first_s, last_s = beliefs_ns[0] / NS_PER_S, beliefs_ns[-1] / NS_PER_S
    for time_s in at_s:
        if not first_s <= time_s <= last_s + HOLD_S:
            message = (
                f"--at: expected instants from {first_s:g} s, that of the first belief, to {last_s + HOLD_S:g} s, "
                f"{HOLD_S:g} s after the last one, got {time_s:g} s"
            )
            raise ScenarioError(message)
    told_ns = np.unique(beliefs_ns)
    asked_ns = np.array([s_to_ns(time_s) for time_s in at_s])
    following_ns = told_ns[np.minimum(np.searchsorted(told_ns, asked_ns), len(told_ns) - 1)]
    soon = (following_ns >= asked_ns) & (following_ns <= asked_ns + s_to_ns(SOON_S))
    return [int(time_ns) for time_ns in np.unique(np.where(soon, following_ns, asked_ns))]


def draw(write: Callable[[], None], times_ns: Sequence[int], out: Path, *, quiet: bool) -> None:
    """Write a picture of some instants, and say so.

    Raises:
        ScenarioError: More than fit into one.
    """
    if len(times_ns) > MOST_PANELS:
        message = f"--at: expected at most {MOST_PANELS} instants in one picture, got {len(times_ns)}; draw several"
        raise ScenarioError(message)
    write()
    if not quiet:
        say(f"wrote {out}")
