"""A leader's part: call, collect, update the belief, and decide with whom and where it goes on (Liu et al. 2004)."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from netsim.algorithms.decay_factors import charge
from netsim.algorithms.joint_giving import give
from netsim.algorithms.joint_groups import cover, is_joint, joined, parts_of, places_of
from netsim.algorithms.joint_member import sightings
from netsim.algorithms.joint_messages import (
    JOIN,
    TAKE_OVER,
    Call,
    Held,
    Reading,
    Sighting,
    decode_call,
    decode_reading,
    encode_call,
)
from netsim.algorithms.joint_station import CALL, END, Station
from netsim.api import Message, Op
from netsim.kernels.energy_sensing import likelihood_operations
from netsim.kernels.logical_targets import ordered
from netsim.kernels.particles import (
    ParticleBelief,
    condition,
    condition_operations,
    predict,
    predict_operations,
    resample,
    resample_operations,
)
from netsim.trace.events import Estimate, Identity, Role

LEADER = "leader"
_KEPT_STEPS = 2


class Leading:
    """The groups that a node leads, each in a place of its own.

    Args:
        station: The node.
        on_call: Told of every call of this node.
    """

    def __init__(self, station: Station, on_call: Callable[[Call], None]) -> None:
        self._station, self._on_call = station, on_call
        self._groups: dict[int, Held] = {}
        self._next = 0
        self._turns: dict[int, tuple[int, int]] = {}
        """Of each track the highest turn known, and the leader that it is of (of equals the lowest)."""
        self._calls: dict[int, Call] = {}
        """Last call heard from each leader."""
        self._readings: dict[int, dict[int, Reading]] = {}
        """By step and member."""
        self._waiting: list[Held] = []
        """Groups given to be joined to one of this node's, at the end of its step."""

    def is_news(self, held: Held) -> bool:
        """Whether a group that is given was not given before, nor led by another since."""
        return all(held.turn > self._turns.get(track, (-1, 0))[0] for track in held.tracks)

    def take(self, held: Held, *, joins: bool) -> None:
        """Lead a group that another node gave."""
        if joins and self._groups:
            self._note(held.tracks, held.turn, self._station.node.id)
            self._waiting.append(held)
        else:
            self.begin(held)

    def begin(self, held: Held) -> None:
        """Lead a group, from the reading after its last one on."""
        self._note(held.tracks, held.turn, self._station.node.id)
        place, self._next = self._next, self._next + 1
        self._groups[place] = held
        self._tell_role(held, 1)
        self._station.node.spawn(self._lead(place))

    def hear(self, message: Message) -> None:
        """Another leader's call: who leads its tracks with fewer turns stops; of equal turns the lower node goes on."""
        call = decode_call(message.payload)
        self._calls[message.source] = call
        self._note(call.tracks, call.turn, message.source)
        for place, held in list(self._groups.items()):
            rank = held.turn, -self._station.node.id
            if set(held.tracks) & set(call.tracks) and rank < (call.turn, -message.source):
                self._station.node.log(f"node {message.source} leads track {call.tracks[0]} since: stopping")
                self._drop(place)

    def note_reading(self, message: Message) -> None:
        """A member's reading, for all groups of this node that it is in."""
        reading = decode_reading(message.payload)
        if reading.step >= self._station.step - _KEPT_STEPS:
            self._readings.setdefault(reading.step, {})[message.source] = reading

    def _note(self, tracks: Collection[int], turn: int, leader: int) -> None:
        for track in tracks:
            known, of = self._turns.get(track, (-1, 0))
            if (turn, -leader) > (known, -of):
                self._turns[track] = turn, leader

    def _drop(self, place: int) -> None:
        self._tell_role(self._groups.pop(place), 0)

    def _tell_role(self, held: Held, holds: int) -> None:
        for track in held.tracks:
            self._station.node.record(Role(self._station.node.id, f"{LEADER} {track}", holds))

    def _lead(self, place: int) -> Op[None]:
        """One reading after another, until the group is given away, joined, superseded or ended."""
        station = self._station
        while place in self._groups:
            step = max(self._groups[place].step + 1, station.step)
            yield from station.node.pause_until(station.time_ns(step))
            if place not in self._groups:
                return
            readings = yield from self._collected(self._groups[place], step)
            if place not in self._groups:
                return
            self._groups[place] = yield from self._updated(self._groups[place], step, readings)
            others = {other for reading in readings.values() for other in reading.others}
            yield from self._decide(place, others)

    def _collected(self, held: Held, step: int) -> Op[Mapping[int, Reading]]:
        """Call the group, and take what its members tell until the time for that is over; this node's own among it."""
        station, node = self._station, self._station.node
        range_m, places_m = station.knowledge.sensing_range_m, places_of(held)
        call = Call(step, held.turn, held.tracks, places_m, held.rows)
        node.geocast(cover(places_m, range_m), CALL, encode_call(call))
        self._on_call(call)
        own = None
        if station.range_to_m(places_m) <= range_m:
            own = yield from station.read()
        yield from node.pause_until(station.time_ns(step) + int(station.parameters.collect_share * station.step_ns))
        readings = {
            member: reading
            for member, reading in self._readings.get(step, {}).items()
            if float(np.hypot(*(places_m - np.array(station.knowledge.sensors_m[member])).T).min()) <= range_m
        }
        if own is not None:
            readings[node.id] = Reading(step, own, self._sighted(step))
        self._readings = {each: told for each, told in self._readings.items() if each >= step}
        return readings

    def _sighted(self, step: int) -> tuple[Sighting, ...]:
        """Tracks of other leaders in whose range this node itself is."""
        range_m = self._station.knowledge.sensing_range_m
        calls = {
            leader: call
            for leader, call in self._calls.items()
            if call.step == step and self._station.range_to_m(call.estimates_m) <= range_m
        }
        return sightings(calls)

    def _updated(self, held: Held, step: int, readings: Mapping[int, Reading]) -> Op[Held]:
        """Belief after motion and readings (eq 1), resampled to equal weights; the estimates go into the trace."""
        station, model = self._station, self._station.knowledge.model
        nodes = sorted(readings)
        sensors_m = station.knowledge.places_m(nodes)
        energies = np.array([readings[node].energy for node in nodes])
        most_m = station.knowledge.max_speed_m_per_s * station.knowledge.reading_s * (step - held.step)
        belief = predict(held.belief, most_m, station.rng)
        if nodes:
            belief = condition(belief, model.log_likelihood(energies, sensors_m, belief.positions_m))
        yield from charge(station.node, _operations(len(nodes), belief))
        self._tell(held, belief)
        is_quiet = not (energies > station.parameters.quiet_sd * model.noise_sd).any()
        count = self._particles(len(held.tracks))
        return replace(
            held, step=step, belief=resample(belief, count, station.rng), quiet=held.quiet + 1 if is_quiet else 0
        )

    def _particles(self, targets: int) -> int:
        parameters = self._station.parameters
        return parameters.particles if targets == 1 else parameters.joint_particles

    def _tell(self, held: Held, belief: ParticleBelief) -> None:
        node = self._station.node
        logical = ordered(belief) if belief.targets > 1 else belief
        for index, track in enumerate(held.tracks):
            spread = logical.covariance_m2(index)
            covariance = [float(spread[0, 0]), float(spread[0, 1]), float(spread[1, 1])]
            x_m, y_m = logical.estimate_m[index].tolist()
            node.record(Estimate(node.id, track, x_m, y_m, covariance))
            node.record(Identity(node.id, track, held.rows[index].tolist()))

    def _decide(self, place: int, others: Collection[Sighting]) -> Op[None]:
        """End, merge, split, or move on."""
        parameters, held = self._station.parameters, self._groups[place]
        if held.quiet >= parameters.quiet_steps:
            self._end(place)
            return
        others = [each for each in others if each.track not in held.tracks]
        if not others and held.is_parted:
            held = self._groups[place] = replace(held, is_parted=False)
        host = self._host(held, others)
        if host is not None and (yield from self._given(place, host, JOIN)):
            return
        if place not in self._groups:
            return
        self._join_waiting(place)
        yield from self._split(place)
        if place in self._groups:
            yield from self._migrate(place)

    def _end(self, place: int) -> None:
        held, station = self._groups[place], self._station
        places_m = places_of(held)
        word = encode_call(Call(held.step, held.turn, held.tracks, places_m, held.rows))
        station.node.geocast(cover(places_m, station.knowledge.sensing_range_m), END, word)
        station.node.log(f"track {held.tracks[0]}: nobody has read a target for {held.quiet} readings: ending it")
        self._drop(place)

    def _host(self, held: Held, others: Sequence[Sighting]) -> int | None:
        """The leader to whom this group is to be given: of two that are to be joint, the one of the lower track stays."""
        places_m = places_of(held)
        near = [each for each in others if is_joint(self._station.parameters, held, places_m, each)]
        lower = [each for each in near if each.track < held.name and each.leader != self._station.node.id]
        return min(lower, key=lambda each: each.track).leader if lower else None

    def _given(self, place: int, receiver: int, purpose: int) -> Op[bool]:
        """Give a group away; where nobody confirms, this node goes on with a turn above the one it offered."""
        held = self._groups[place]
        is_taken = yield from give(self._station, held, receiver, purpose)
        if place not in self._groups:
            return True
        if is_taken:
            self._drop(place)
        else:
            self._groups[place] = replace(held, turn=held.turn + 2)
        return is_taken

    def _join_waiting(self, place: int) -> None:
        """Take in the groups that were given to be joined, and others of this node that belong with this one."""
        station, held = self._station, self._groups[place]
        while self._waiting:
            held = self._joined(held, self._waiting.pop())
        for other, each in list(self._groups.items()):
            if other == place or each.step != held.step:
                continue
            places_m = places_of(each).tolist()
            near = [Sighting(station.node.id, track, *at) for track, at in zip(each.tracks, places_m, strict=True)]
            if any(is_joint(station.parameters, held, places_of(held), one) for one in near):
                self._drop(other)
                held = self._joined(held, each)
        self._groups[place] = held

    def _joined(self, held: Held, other: Held) -> Held:
        station = self._station
        both = joined(held, other, station.parameters.joint_particles, station.rng)
        self._note(both.tracks, both.turn, station.node.id)
        self._tell_role(other, 1)
        return both

    def _split(self, place: int) -> Op[None]:
        """Targets that have parted go on in groups of their own: the nearest here, others with the sensors nearest them."""
        station, held = self._station, self._groups[place]
        parts = parts_of(station.parameters, held, self._particles, station.rng)
        if len(parts) == 1:
            return
        parts.sort(key=lambda part: station.range_to_m(places_of(part)))
        self._groups[place] = parts[0]
        for part in parts[1:]:
            self._tell_role(part, 0)
            receiver = station.knowledge.nearest(_centre(part))[0]
            if receiver == station.node.id or not (yield from give(station, part, receiver, TAKE_OVER)):
                self.begin(replace(part, turn=part.turn + 2))

    def _migrate(self, place: int) -> Op[None]:
        """Move the group on to the sensor nearest to its targets, if that is nearer by the margin."""
        station, centre_m = self._station, _centre(self._groups[place])
        nearest = station.knowledge.nearest(centre_m)[:2]
        own_m = float(np.hypot(*(station.place_m - centre_m)))
        for receiver in nearest:
            there_m = float(np.hypot(*(np.array(station.knowledge.sensors_m[receiver]) - centre_m)))
            if own_m - there_m <= station.parameters.migrate_m or (yield from self._given(place, receiver, TAKE_OVER)):
                return


def _operations(readings: int, belief: ParticleBelief) -> int:
    """Of one step of a belief with so many readings."""
    particles, targets = belief.count, belief.targets
    return (
        predict_operations(particles, targets)
        + likelihood_operations(readings, particles, targets)
        + condition_operations(particles)
        + resample_operations(particles, particles)
    )


def _centre(held: Held) -> tuple[float, float]:
    x_m, y_m = held.belief.estimate_m.mean(axis=0).tolist()
    return x_m, y_m
