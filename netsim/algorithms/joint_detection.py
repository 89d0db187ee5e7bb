"""Tracks that nobody was told of: sensors that read a target to which no group has called them elect a first leader.

Liu et al. 2004, section 5: when a target is detected, a group is created around it by electing a leader. Here every sensor
that reads a target waits, the louder the shorter, and claims the track unless another one's claim reaches it before. Claims
that cross each other begin several tracks of one target; the later one ends where the two turn out to be near each other.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_member import Membership
from netsim.algorithms.joint_messages import Held
from netsim.algorithms.joint_station import Station
from netsim.api import Op
from netsim.kernels.particles import uniform_disc

_WAIT_SHARE: Final = 0.7
_CHANCE_SHARE: Final = 0.2
"""Shares of the rest of the time between two readings: what faint sensors wait, and what chance adds."""


class Detection:
    """One node's part in beginning tracks.

    Args:
        station: The node.
        membership: Knows whether groups call this node.
        claim: Lead a new group, and say so.
    """

    def __init__(self, station: Station, membership: Membership, claim: Callable[[Held], None]) -> None:
        self._station, self._membership, self._claim = station, membership, claim

    def run(self) -> Op[None]:
        """Listen at every reading, for ever."""
        station = self._station
        while True:
            step = station.next_step
            yield from station.node.pause_until(station.time_ns(step))
            energy = yield from station.read(step)
            called_ns = int(station.parameters.collect_share * station.step_ns)
            yield from station.node.pause_until(station.time_ns(step) + called_ns)
            if energy is not None and energy > station.loud and not self._is_covered(step):
                yield from station.node.pause(int(self._wait_share(energy) * (station.step_ns - called_ns)))
                if not self._is_covered(step):
                    self._begin(step, energy)
            yield from station.node.pause_until(station.time_ns(step) + 1)

    def _is_covered(self, step: int) -> bool:
        """Whether a group has called this node, now or a reading ago: a call may get lost."""
        return self._membership.is_covered(step) or self._membership.is_covered(step - 1)

    def _wait_share(self, energy: float) -> float:
        chance = float(self._station.node.rng("detection").random())
        return _WAIT_SHARE * self._station.loud / energy + _CHANCE_SHARE * chance

    def _begin(self, step: int, energy: float) -> None:
        """Lead a track of a target that is within the range of a reading just as loud as is needed."""
        station, model = self._station, self._station.knowledge.model
        track, targets = station.new_track(step), station.knowledge.targets
        range_m = max(float(np.sqrt(model.amplitude / station.loud)), model.saturation_m)
        station.node.log(f"a reading of {energy:.1f}, and no group called: beginning track {track}")
        belief = uniform_disc(station.place_m, range_m, station.parameters.particles, station.rng)
        known = Acquaintances.alone(track, np.full(targets, 1.0 / targets), Place(0, station.node.id))
        self._claim(Held(step, 0, (track,), belief, known, is_blank=True))
