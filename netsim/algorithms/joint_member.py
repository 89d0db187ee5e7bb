"""A member's part: read when a leader calls, tell it, and take a track over whose leader has fallen silent."""

from collections.abc import Callable, Mapping

import numpy as np

from netsim.algorithms.joint_messages import Call, Held, Reading, Sighting, decode_call, encode_reading
from netsim.algorithms.joint_station import READING, Station
from netsim.api import Message, Op
from netsim.kernels.particles import uniform_disc

Begin = Callable[[Held], None]


class Membership:
    """One node's memberships.

    Args:
        station: The node.
        begin: Lead a group.
    """

    def __init__(self, station: Station, begin: Begin) -> None:
        self._station, self._begin = station, begin
        self._heard: dict[int, Call] = {}
        """The last call heard, by track."""
        self._calls: dict[int, dict[int, Call]] = {}
        """By step and leader the calls that put this node into their groups."""
        self._read: tuple[int, float | None] = (-1, None)

    def hear(self, message: Message) -> None:
        """Answer a call whose targets are in range."""
        call, station = decode_call(message.payload), self._station
        known = [self._heard[track] for track in call.tracks if track in self._heard]
        if any((other.step, other.turn) > (call.step, call.turn) for other in known):
            return
        self.note(call)
        if station.range_to_m(call.estimates_m) > station.knowledge.sensing_range_m:
            return
        station.node.spawn(self._answer(message, call))
        if station.range_to_m(call.estimates_m) <= station.parameters.watch_share * station.knowledge.sensing_range_m:
            station.node.spawn(self._watch(call))

    def note(self, call: Call) -> None:
        """Somebody speaks for these tracks, perhaps this node itself."""
        self._heard.update(dict.fromkeys(call.tracks, call))

    def forget(self, message: Message) -> None:
        """A track has ended."""
        for track in decode_call(message.payload).tracks:
            self._heard.pop(track, None)

    def _answer(self, message: Message, call: Call) -> Op[None]:
        station, parameters = self._station, self._station.parameters
        self._calls = {step: calls for step, calls in self._calls.items() if step >= call.step - 1}
        calls = self._calls.setdefault(call.step, {})
        calls[message.source] = call
        energy = yield from self._reading(call.step)
        spread_ns = parameters.spread_share * parameters.collect_share * station.step_ns
        yield from station.node.pause(int(station.node.rng("answers").random() * spread_ns))
        if energy is not None:
            others = {leader: each for leader, each in calls.items() if leader != message.source}
            payload = encode_reading(Reading(call.step, energy, sightings(others)))
            station.node.send(message.source, READING, payload, causes=[message])

    def _reading(self, step: int) -> Op[float | None]:
        """One reading serves all groups of a step."""
        if self._read[0] != step:
            self._read = step, (yield from self._station.read())
        return self._read[1]

    def _watch(self, call: Call) -> Op[None]:
        """Take the tracks over if nobody speaks for them any more; the nearest to the targets is the first to do so."""
        station, parameters = self._station, self._station.parameters
        range_share = station.range_to_m(call.estimates_m) / station.knowledge.sensing_range_m
        delay = 0.7 * range_share + 0.2 * float(station.node.rng("watch").random())
        silence_ns = (parameters.silence_steps + delay) * station.step_ns
        yield from station.node.pause_until(station.time_ns(call.step + 1) + int(silence_ns))
        if not all(self._heard.get(track) is call for track in call.tracks):
            return
        station.node.log(f"leader of {_named(call)} silent since reading {call.step}: taking over")
        self._begin(self._anew(call))

    def _anew(self, call: Call) -> Held:
        """What a member can know: the targets were near the last estimates, and have moved since."""
        station, parameters = self._station, self._station.parameters
        elapsed = station.step - call.step
        spread_m = station.knowledge.max_speed_m_per_s * station.knowledge.reading_s * elapsed
        count = parameters.particles if len(call.tracks) == 1 else parameters.joint_particles
        belief = uniform_disc(call.estimates_m, spread_m, count, station.rng)
        rows = call.rows / call.rows.sum(axis=1, keepdims=True)
        return Held(station.step, call.turn + 1, call.tracks, belief, np.asarray(rows))


def sightings(calls: Mapping[int, Call]) -> tuple[Sighting, ...]:
    """The tracks of groups, by their leaders."""
    return tuple(
        Sighting(leader, track, *place)
        for leader, call in sorted(calls.items())
        for track, place in zip(call.tracks, call.estimates_m.tolist(), strict=True)
    )


def _named(call: Call) -> str:
    return " and ".join(f"track {track}" for track in call.tracks)
