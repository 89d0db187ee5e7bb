"""A leader's part: call, collect, update the belief, and decide with whom and where it goes on (Liu et al. 2004)."""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from netsim.algorithms.decay_factors import charge
from netsim.algorithms.joint_belief import operations, particles_of, updated
from netsim.algorithms.joint_book import Calls, Readings, Turns, call_of
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_giving import give
from netsim.algorithms.joint_groups import cover, is_joint, joined, kept, parts_of, places_of
from netsim.algorithms.joint_identity import Identities
from netsim.algorithms.joint_messages import (
    Call,
    Held,
    Reading,
    Sighting,
    decode_call,
    decode_reading,
    encode_call,
)
from netsim.algorithms.joint_station import CALL, CLAIM, END, Station
from netsim.api import Message, Op
from netsim.kernels.logical_targets import join_operations
from netsim.kernels.particles import resample_operations
from netsim.trace.events import AlgorithmRecord, Role

LEADER = "leader"
_CLAIM_RANGES = 2.0
"""How far claims are heard, in sensing ranges."""
MERGE, SPLIT = "merge", "split"
"""Kinds of the records of a group's changes; their field `parts` names the tracks of each part."""


class Leading:
    """The groups that a node leads, each in a place of its own.

    While a group is collected, computed or given away, word may come that another node leads some of its tracks: what is
    held is looked up anew after every wait.

    Args:
        station: The node.
        on_call: Told of every call of this node.
        on_end: Told of the last word on tracks that this node ends.
        identities: Told who is led here, and asked who is who.
    """

    def __init__(
        self,
        station: Station,
        on_call: Callable[[Call], None],
        on_end: Callable[[Call], None],
        identities: Identities,
    ) -> None:
        self._station, self._on_call, self._on_end, self._identities = station, on_call, on_end, identities
        self._groups: dict[int, Held] = {}
        self._leaving: set[int] = set()
        """Places of groups that are being given away."""
        self._amidst: set[int] = set()
        """Places of groups that are amidst a reading."""
        self._next = 0
        self._turns = Turns()
        self._calls = Calls(station)
        self._readings = Readings(station)

    def take(self, held: Held) -> None:
        """Lead a group that was given, or of it the tracks that nobody has led since, perhaps jointly with one's own."""
        news = kept(held, self._turns.news_in(held))
        if news is not None:
            place = self.begin(replace(news, waiting=()))
            self._identities.keep_waiting(news)
            if news is not held:
                self._identities.meet(news)
            self._join_own(place)

    def begin(self, held: Held) -> int:
        """Lead a group, from the reading after its last one on, at the place that is returned."""
        broken = [self._lose(place, held.tracks) for place in list(self._groups)]
        if not held.is_blank:  # what a live leader gives counts for more
            self._turns.note(held.tracks, held.turn, self._station.node.id)
        place, self._next = self._next, self._next + 1
        self._groups[place] = held
        self._identities.lead(held)
        for left in filter(None, broken):
            self._identities.meet(left)
        self._tell_role(held.tracks, 1)
        self._station.node.spawn(self._lead(place))
        return place

    def claim(self, held: Held) -> None:
        """Lead a group that nobody gave, and say so at once to all whom that concerns."""
        self.begin(held)
        self._identities.recover(held)
        places_m = places_of(held)
        call = call_of(held, held.step, places_m)
        self._on_call(call)
        self._say(CLAIM, call)

    def hear(self, message: Message) -> None:
        """Another leader's word: of two that lead a track the one with more turns goes on, of equal turns the lower node.

        But one that has begun anew and has no reading yet gives way to one that has lately had readings: such a claim is
        false, made by a member that missed this leader's calls.
        """
        call = decode_call(message.payload)
        if message.kind == CALL:
            self._calls.note(message.source, call)
        if not call.is_blank:
            self._turns.note(call.tracks, call.turn, message.source)
        for place, held in list(self._groups.items()):
            if set(held.tracks) & set(call.tracks):
                self._contend(place, message, call)

    def _contend(self, place: int, message: Message, call: Call) -> None:
        """Another leader speaks for some tracks of a group of this node."""
        held = self._groups[place]
        if call.is_blank and not held.is_blank and held.step >= call.step - 1:
            self._refute(place, message, call)
        elif (held.turn, -self._station.node.id) < (call.turn, -message.source):
            self._station.node.log(f"node {message.source} leads {held.label} since, or a part: giving way")
            left = self._lose(place, call.tracks)
            common = sorted(set(held.tracks) & set(call.tracks))
            self._identities.leave(common, Place(call.turn, message.source))
            if left is not None:
                self._identities.meet(left)
        elif message.kind == CALL:  # who is to give way may be out of the region of this group's calls
            self._answer(place, message)

    def _refute(self, place: int, message: Message, call: Call) -> None:
        """Contradict a false claim, with a turn above its own (SWIM's incarnation numbers, Das et al. 2002, section 4.2)."""
        if place in self._leaving:
            return  # the turn is offered already; whoever takes the group hears the next call, and contradicts it
        held = self._groups[place]
        if held.turn <= call.turn:
            self._groups[place] = replace(held, turn=call.turn + 1)
            self._identities.lead(self._groups[place])
        self._answer(place, message)

    def _answer(self, place: int, message: Message) -> None:
        held = self._groups[place]
        word = encode_call(call_of(held, held.step, places_of(held)))
        self._station.node.send(message.source, CLAIM, word, causes=[message])

    def note_reading(self, message: Message) -> None:
        """A member's reading, for all groups of this node that it is in."""
        self._readings.note(message.source, decode_reading(message.payload))

    def _lose(self, place: int, tracks: Collection[int]) -> Held | None:
        """Lead these tracks no more; what is left of a joint group that breaks up by that."""
        held = self._fresh(place)
        del self._groups[place]
        left = kept(held, set(held.tracks).difference(tracks))
        if left is not None:
            self._groups[place] = left
        self._tell_role(sorted(set(held.tracks).intersection(tracks)), 0)
        return left if left is not held else None

    def _tell_role(self, tracks: Collection[int], holds: int) -> None:
        for track in tracks:
            self._station.node.record(Role(self._station.node.id, f"{LEADER} {track}", holds))

    def _tell_change(self, kind: str, parts: Sequence[Held]) -> None:
        fields = json.dumps({"parts": [list(part.tracks) for part in parts]})
        self._station.node.record(AlgorithmRecord(self._station.node.id, kind, fields))

    def _say(self, kind: str, call: Call) -> None:
        # a leader that is thought to be silent may just have jumped to where these members do not hear it
        reach = _CLAIM_RANGES if kind == CLAIM else 1.0
        region = cover(call.estimates_m, reach * self._station.knowledge.sensing_range_m)
        self._station.node.geocast(region, kind, encode_call(call))

    def _lead(self, place: int) -> Op[None]:
        """One reading after another, until the group is given away, joined, superseded or ended."""
        station = self._station
        while place in self._groups:
            # one that is late leaves readings out: its members would read something else by now
            step = max(self._groups[place].step + 1, station.next_step)
            yield from station.node.pause_until(station.time_ns(step))
            if place not in self._groups:
                return
            self._amidst.add(place)
            readings = yield from self._take_reading(place, step)
            self._amidst.discard(place)
            if readings is None:
                return
            self._identities.classify(self._groups[place])
            yield from self._decide(place, {other for reading in readings.values() for other in reading.others})

    def _take_reading(self, place: int, step: int) -> Op[Mapping[int, Reading] | None]:
        """Update a group by a reading, and return what members told; None where it is led here no more."""
        readings = yield from self._collected(self._fresh(place), step)
        if place not in self._groups:
            return None
        yield from charge(self._station.node, operations(len(readings), self._groups[place].belief))
        if place not in self._groups:
            return None
        self._groups[place] = updated(self._station, self._fresh(place), step, readings)
        return readings

    def _fresh(self, place: int) -> Held:
        """A group with what is known of its identities now; of a joint one all that has been learned."""
        held = self._groups[place]
        if len(held.tracks) > 1:
            self._identities.fold(held.tracks)
        held = self._groups[place] = self._identities.fresh(held)
        return held

    def _collected(self, held: Held, step: int) -> Op[Mapping[int, Reading]]:
        """Call the group, and take what its members tell until the time for that is over; this node's own among it."""
        station, node = self._station, self._station.node
        places_m = places_of(held)
        call = call_of(held, step, places_m)
        self._turns.note(held.tracks, held.turn, node.id)
        self._on_call(call)
        self._say(CALL, call)
        own = None
        if station.range_to_m(places_m) <= station.knowledge.sensing_range_m:
            own = yield from station.read(step)
        yield from node.pause_until(station.time_ns(step) + int(station.parameters.collect_share * station.step_ns))
        readings = self._readings.near(step, places_m)
        if own is not None:
            readings[node.id] = Reading(step, own, self._calls.sighted(call))
        return readings

    def _decide(self, place: int, others: Collection[Sighting]) -> Op[None]:
        """End, merge, split, or move on."""
        parameters, held = self._station.parameters, self._groups[place]
        if held.quiet >= parameters.quiet_steps:
            self._end(place, f"nobody has read a target for {held.quiet} readings")
            return
        others = [each for each in others if each.track not in held.tracks]
        if not others and held.is_parted:
            held = self._groups[place] = replace(held, is_parted=False)
        if (double := self._double(held, others)) is not None:
            self._end(place, f"its target is that of track {double}")
            return
        near = [each for each in others if self._belong(held, each)]
        if (host := self._host(held, near)) is not None:
            yield from self._given(place, host)
            return
        waits = self._join_own(place)
        yield from self._split(place)
        if place in self._groups and not near and not waits:  # else stay: another group is on its way to this one
            yield from self._migrate(place)

    def _double(self, held: Held, others: Sequence[Sighting]) -> int | None:
        """The earlier track that a group's, which is fresh, turns out to be a double of."""
        if not self._station.is_fresh(held.name):
            return None
        (x_m, y_m), *_ = places_of(held).tolist()
        same_m = self._station.parameters.same_m
        earlier = (each for each in others if each.track < held.name)
        return next((each.track for each in earlier if np.hypot(each.x_m - x_m, each.y_m - y_m) <= same_m), None)

    def _belong(self, held: Held, other: Sighting) -> bool:
        """Whether a group and another's track are to be joint; fresh ones may yet be the same, and wait."""
        is_settled = not any(map(self._station.is_fresh, (*held.tracks, other.track)))
        return is_settled and is_joint(self._station.parameters, held, places_of(held), other)

    def _end(self, place: int, why: str) -> None:
        held = self._groups[place]
        call = call_of(held, held.step, places_of(held))
        self._on_end(call)
        self._say(END, call)
        self._station.node.log(f"{held.label}: {why}: ending")
        self._lose(place, held.tracks)
        self._identities.leave(held.tracks)

    def _host(self, held: Held, near: Sequence[Sighting]) -> int | None:
        """The leader to whom this group is to be given: of those that are to be joint, the one of the lowest track stays."""
        lower = [each for each in near if each.track < held.name and each.leader != self._station.node.id]
        return min(lower, key=lambda each: each.track).leader if lower else None

    def _given(self, place: int, receiver: int) -> Op[bool]:
        """Give a group away; where nobody confirms, this node goes on with a turn above the one it offered."""
        held = self._identities.with_waiting(self._fresh(place))
        self._leaving.add(place)
        is_taken = yield from give(self._station, held, receiver)
        self._leaving.discard(place)
        if place not in self._groups:
            return True
        if is_taken:
            self._lose(place, held.tracks)
            self._identities.leave(held.tracks, Place(held.turn + 1, receiver), held.known)
        else:
            self._groups[place] = replace(self._groups[place], turn=held.turn + 2)
            self._identities.lead(self._groups[place])
        return is_taken

    def _join_own(self, place: int) -> bool:
        """Join to a group the others of this node that belong with it; among them are those that were given for that.

        Returns:
            Whether there are some that belong with it, and are yet to take a reading.
        """
        waits = False
        for other in [each for each in self._groups if each != place and each not in self._leaving]:
            if not self._are_joint(self._groups[place], self._groups[other]):
                continue
            if other not in self._amidst and self._groups[other].step == self._groups[place].step:
                self._merge(place, other)
            else:
                waits = True
        return waits

    def _are_joint(self, held: Held, other: Held) -> bool:
        node = self._station.node
        near = (
            Sighting(node.id, track, *at) for track, at in zip(other.tracks, places_of(other).tolist(), strict=True)
        )
        return any(self._belong(held, one) for one in near)

    def _merge(self, place: int, other: int) -> None:
        self._identities.fold((*self._groups[place].tracks, *self._groups[other].tracks))
        station, held, each = self._station, self._fresh(place), self._fresh(other)
        del self._groups[other]
        both = joined(held, each, station.parameters.joint_particles, station.rng)
        self._charge(join_operations(both.belief.count, held.belief.count + each.belief.count))
        self._turns.note(both.tracks, both.turn, station.node.id)
        self._groups[place] = both
        self._identities.lead(both)
        self._tell_change(MERGE, [held, each])

    def _charge(self, count: int) -> None:
        self._station.node.spawn(charge(self._station.node, count))

    def _split(self, place: int) -> Op[None]:
        """Targets that have parted go on in groups of their own: the nearest here, others with the sensors nearest them."""
        station, held = self._station, self._fresh(place)
        parts = parts_of(
            station.parameters,
            held,
            station.knowledge.sensing_range_m,
            lambda targets: particles_of(station, targets),
            station.rng,
        )
        if len(parts) == 1:
            self._groups[place] = parts[0]
            return
        self._charge(sum(resample_operations(held.belief.count, part.belief.count) for part in parts))
        parts.sort(key=lambda part: station.range_to_m(places_of(part)))
        self._tell_change(SPLIT, parts)
        self._groups[place] = parts[0]
        self._identities.meet(parts[0])
        for part in parts[1:]:
            yield from self._sent_off(part)

    def _sent_off(self, part: Held) -> Op[None]:
        """Give a part to the sensor nearest to it, or go on with it here."""
        station = self._station
        self._tell_role(part.tracks, 0)
        receiver, part = station.knowledge.nearest(_centre(part))[0], self._identities.fresh(part)
        if receiver != station.node.id and (yield from give(station, part, receiver)):
            self._identities.leave(part.tracks, Place(part.turn + 1, receiver), part.known)
        else:
            self.take(replace(part, turn=part.turn + 2))

    def _migrate(self, place: int) -> Op[None]:
        """Move the group on to the sensor nearest to its targets, if that is nearer by the margin."""
        station, centre_m = self._station, _centre(self._groups[place])
        nearest = station.knowledge.nearest(centre_m)[:2]
        own_m = float(np.hypot(*(station.place_m - centre_m)))
        for receiver in nearest:
            there_m = float(np.hypot(*(np.array(station.knowledge.sensors_m[receiver]) - centre_m)))
            if own_m - there_m <= station.parameters.migrate_m or (yield from self._given(place, receiver)):
                return


def _centre(held: Held) -> tuple[float, float]:
    x_m, y_m = held.belief.estimate_m.mean(axis=0).tolist()
    return x_m, y_m
