"""Joint and factored tracking with collaboration groups (Liu, Chu, Liu, Reich, Zhao 2004, sections 3 to 5).

A node may lead groups, and is a member of those whose leaders' calls reach it within the sensing range of their targets: a
group is where its targets are (a geographically constrained group), and forms anew with every call.
"""

import numpy as np

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_detection import Detection
from netsim.algorithms.joint_identity import WORD, Identities
from netsim.algorithms.joint_leader import Leading
from netsim.algorithms.joint_location import LOCATE, REGISTER
from netsim.algorithms.joint_member import Membership
from netsim.algorithms.joint_messages import Held, decode_given, encode_taken
from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.algorithms.joint_station import ASK, CALL, CLAIM, END, GIVEN, LATEST, READING, TAKEN, Station
from netsim.api import Message, NodeHandle, Op
from netsim.errors import AlgorithmError
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge, TrackStart
from netsim.kernels.particles import uniform_disc

_HEEDED = {ASK, CALL, CLAIM, END, GIVEN, LATEST, READING, WORD, REGISTER, LOCATE}


class JointTracking:
    """See `JointTrackingParameters`."""

    def __init__(self, parameters: JointTrackingParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        knowledge = node.knowledge
        if not isinstance(knowledge, EnergyTrackingKnowledge):
            message = f"this algorithm needs an energy-tracking problem, not {type(knowledge).__name__}"
            raise AlgorithmError(message)
        if knowledge.has_sensor:
            yield from _Tracker(Station(node, knowledge, self._parameters)).run()


class _Tracker:
    """One node: it hears calls and takes groups that are given to it, for ever."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self._identities = Identities(station)
        self._leading = Leading(
            station,
            lambda call: self._membership.note_own(call),
            lambda call: self._membership.note_end(call),
            self._identities,
        )
        self._membership = Membership(station, self._leading.claim, self._identities.whereabouts)

    def run(self) -> Op[None]:
        node = self._station.node
        if self._station.parameters.begin == "detected":
            node.spawn(Detection(self._station, self._membership, self._leading.claim).run())
        else:
            for start in self._station.knowledge.starts:
                node.spawn(self._start(start))
        while True:
            message = yield from node.receive(kinds=_HEEDED)
            if message is not None:
                self._heed(message)

    def _start(self, start: TrackStart) -> Op[None]:
        """Begin a track that this node was told of, unless it has missed the begin: others may long be leading it."""
        station = self._station
        if station.node.now_ns > station.time_ns(start.step):
            station.node.log(f"track {start.track} was to begin at reading {start.step}, which is over: not begun")
            return
        yield from station.node.pause_until(station.time_ns(start.step) - 1)
        belief = uniform_disc(start.place_m, start.spread_m, station.parameters.particles, station.rng)
        row = np.eye(station.knowledge.targets)[start.track]
        known = Acquaintances.alone(start.track, row, Place(0, station.node.id))
        self._leading.begin(Held(start.step - 1, 0, (start.track,), belief, known, is_blank=True))

    def _heed(self, message: Message) -> None:
        if message.kind in (CALL, CLAIM):
            self._leading.hear(message)
            self._membership.hear(message)
        elif message.kind == LATEST:
            self._membership.hear(message)
        elif message.kind == ASK:
            self._membership.asked(message)
        elif message.kind == READING:
            self._leading.note_reading(message)
        elif message.kind == END:
            self._membership.forget(message)
        elif message.kind == WORD:
            self._identities.hear(message)
        elif message.kind in (REGISTER, LOCATE):
            self._identities.whereabouts.serve(message)
        else:
            self._take(message)

    def _take(self, message: Message) -> None:
        """Lead a group that is given, or join it to one's own; one that comes again is confirmed again."""
        station = self._station
        held = decode_given(message.payload, station.parameters.payload)
        station.node.send(message.source, TAKEN, encode_taken(held), causes=[message])
        self._leading.take(held)
