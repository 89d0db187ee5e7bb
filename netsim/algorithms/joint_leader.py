"""A leader's part: call, collect, update the belief, and decide with whom and where it goes on (Liu et al. 2004)."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from netsim.algorithms.charging import charge
from netsim.algorithms.joint_belief import operations, particles_of, updated
from netsim.algorithms.joint_book import Calls, Readings, call_of
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_contention import Contention
from netsim.algorithms.joint_giving import give
from netsim.algorithms.joint_groups import cover, joined, kept, parts_of, places_of
from netsim.algorithms.joint_holding import Holding
from netsim.algorithms.joint_identity import Identities
from netsim.algorithms.joint_meeting import are_joint, belong, double_of, host_of
from netsim.algorithms.joint_messages import (
    Call,
    Held,
    Reading,
    Sighting,
    decode_call,
    decode_reading,
    encode_call,
    label_of,
)
from netsim.algorithms.joint_station import CALL, CLAIM, END, Station
from netsim.api import Message, Op
from netsim.kernels.logical_targets import join_operations
from netsim.kernels.particles import resample_operations

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
        self._holding = Holding(station, identities)
        self._contention = Contention(station, self._holding, identities)
        self._calls = Calls(station)
        self._readings = Readings(station)

    def take(self, held: Held) -> bool:
        """Lead a group that was given, or of it the tracks that nobody has led since, perhaps jointly with one's own.

        Returns:
            Whether there are such tracks.
        """
        news = kept(held, self._holding.turns.news_in(held))
        if news is None:
            return False
        place = self.begin(replace(news, waiting=()))
        self._identities.evidence.keep(news)
        if news is not held:
            self._identities.meet(news)
        self._join_own(place)
        return True

    def begin(self, held: Held) -> int:
        """Lead a group, from the reading after its last one on, at the place that is returned."""
        place = self._holding.add(held)
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
        """Another leader's word."""
        call = decode_call(message.payload)
        if message.kind == CALL:
            self._calls.note(message.source, call)
        self._contention.hear(message, call)

    def note_reading(self, message: Message) -> None:
        """A member's reading, for all groups of this node that it is in."""
        self._readings.note(message.source, decode_reading(message.payload))

    def _say(self, kind: str, call: Call) -> None:
        # a leader that is thought to be silent may just have jumped to where these members do not hear it
        reach = _CLAIM_RANGES if kind == CLAIM else 1.0
        region = cover(call.estimates_m, reach * self._station.knowledge.sensing_range_m)
        self._station.node.geocast(region, kind, encode_call(call))

    def _lead(self, place: int) -> Op[None]:
        """One reading after another, until the group is given away, joined, superseded or ended."""
        station = self._station
        while place in self._holding.groups:
            # one that is late leaves readings out: its members would read something else by now
            step = max(self._holding.groups[place].step + 1, station.next_step)
            yield from station.node.pause_until(station.time_ns(step))
            if place not in self._holding.groups:
                return
            self._holding.amidst.add(place)
            readings = yield from self._take_reading(place, step)
            self._holding.amidst.discard(place)
            if readings is None:
                return
            self._identities.evidence.classify(self._holding.groups[place])
            yield from self._decide(place, {other for reading in readings.values() for other in reading.others})

    def _take_reading(self, place: int, step: int) -> Op[Mapping[int, Reading] | None]:
        """Update a group by a reading, and return what members told; None where it is led here no more."""
        readings = yield from self._collected(self._holding.fresh(place), step)
        if place not in self._holding.groups:
            return None
        yield from charge(self._station.node, operations(len(readings), self._holding.groups[place].belief))
        if place not in self._holding.groups:
            return None
        self._holding.groups[place] = updated(self._station, self._holding.fresh(place), step, readings)
        return readings

    def _collected(self, held: Held, step: int) -> Op[Mapping[int, Reading]]:
        """Call the group, and take what its members tell until the time for that is over; this node's own among it."""
        station, node = self._station, self._station.node
        places_m = places_of(held)
        call = call_of(held, step, places_m)
        self._holding.turns.note(held.tracks, held.turn, node.id)
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
        parameters, held = self._station.parameters, self._holding.groups[place]
        if held.quiet >= parameters.quiet_steps:
            self._end_quiet(place)
            return
        others = [each for each in others if each.track not in held.tracks]
        if not others and held.is_parted:
            held = self._holding.groups[place] = replace(held, is_parted=False)
        if (double := double_of(self._station, held, others)) is not None:
            self._end(place, held.tracks, f"its target is that of track {double}")
            return
        near = [each for each in others if belong(self._station, held, each)]
        if (host := host_of(self._station, held, near)) is not None:
            yield from self._given(place, host)
            return
        waits = self._join_own(place)
        yield from self._split(place)
        if (
            place in self._holding.groups and not near and not waits
        ):  # else stay: another group is on its way to this one
            yield from self._migrate(place)

    def _end_quiet(self, place: int) -> None:
        """End what nobody reads any more: the group, or the one track that the readings do not speak for."""
        held = self._holding.groups[place]
        if held.spare is None:
            self._end(place, held.tracks, f"nobody has read a target for {held.quiet} readings")
        else:
            self._end(place, (held.spare,), f"{held.quiet} readings are explained better without it")

    def _end(self, place: int, tracks: tuple[int, ...], why: str) -> None:
        """End some tracks of a group, and say so; the others go on, and who is who of them is open."""
        held = self._holding.fresh(place)
        places_m = places_of(held)[[held.tracks.index(track) for track in tracks]]
        call = replace(call_of(held, held.step, places_m), tracks=tracks)
        self._on_end(call)
        self._say(END, call)
        self._station.node.log(f"{label_of(tracks)}: {why}: ending")
        left = self._holding.lose(place, tracks)
        self._identities.leave(tracks)
        if left is not None:
            self._holding.groups[place] = replace(left, quiet=0, spare=None)
            self._identities.meet(left)

    def _given(self, place: int, receiver: int) -> Op[bool]:
        """Give a group away; where nobody confirms, this node goes on with a turn above the one it offered, and says so."""
        held = self._identities.evidence.with_waiting(self._holding.fresh(place))
        self._holding.leaving.add(place)
        is_taken = yield from give(self._station, held, receiver)
        self._holding.leaving.discard(place)
        if place not in self._holding.groups:
            return True
        if is_taken:
            self._holding.lose(place, held.tracks)
            self._identities.leave(held.tracks, Place(held.turn + 1, receiver), held.known)
        else:
            self._holding.put(place, replace(self._holding.groups[place], turn=held.turn + 2))
            self._contention.assert_to(receiver, self._holding.groups[place])
        return is_taken

    def _join_own(self, place: int) -> bool:
        """Join to a group the others of this node that belong with it; among them are those that were given for that.

        Returns:
            Whether there are some that belong with it, and are yet to take a reading.
        """
        waits = False
        for other in [each for each in self._holding.groups if each != place and each not in self._holding.leaving]:
            if not are_joint(self._station, self._holding.groups[place], self._holding.groups[other]):
                continue
            if (
                other not in self._holding.amidst
                and self._holding.groups[other].step == self._holding.groups[place].step
            ):
                self._merge(place, other)
            else:
                waits = True
        return waits

    def _merge(self, place: int, other: int) -> None:
        self._identities.evidence.fold((*self._holding.groups[place].tracks, *self._holding.groups[other].tracks))
        station, held, each = self._station, self._holding.fresh(place), self._holding.fresh(other)
        del self._holding.groups[other]
        both = joined(held, each, station.parameters.joint_particles, station.rng)
        self._charge(join_operations(both.belief.count, held.belief.count + each.belief.count))
        self._holding.turns.note(both.tracks, both.turn, station.node.id)
        self._holding.put(place, both)
        self._holding.tell_change(MERGE, [held, each])

    def _charge(self, count: int) -> None:
        self._station.node.spawn(charge(self._station.node, count))

    def _split(self, place: int) -> Op[None]:
        """Targets that have parted go on in groups of their own: the nearest here, others with the sensors nearest them."""
        station, held = self._station, self._holding.fresh(place)
        parts = parts_of(
            station.parameters,
            held,
            station.knowledge.sensing_range_m,
            lambda targets: particles_of(station, targets),
            station.rng,
        )
        if len(parts) == 1:
            self._holding.groups[place] = parts[0]
            return
        self._charge(sum(resample_operations(held.belief.count, part.belief.count) for part in parts))
        parts.sort(key=lambda part: station.range_to_m(places_of(part)))
        self._holding.tell_change(SPLIT, parts)
        self._holding.groups[place] = parts[0]
        self._identities.meet(parts[0])
        for part in parts[1:]:
            yield from self._sent_off(part)

    def _sent_off(self, part: Held) -> Op[None]:
        """Give a part to the sensor nearest to it, or go on with it here."""
        station = self._station
        receiver, part = station.knowledge.nearest(_centre(part))[0], self._identities.fresh(part)
        is_taken = receiver != station.node.id and (yield from give(station, part, receiver))
        self._holding.tell_role(part.tracks, 0)
        if is_taken:
            self._identities.leave(part.tracks, Place(part.turn + 1, receiver), part.known)
            return
        part = replace(part, turn=part.turn + 2)
        if self.take(part) and receiver != station.node.id:
            self._contention.assert_to(receiver, part)

    def _migrate(self, place: int) -> Op[None]:
        """Move the group on to the sensor nearest to its targets, if that is nearer by the margin."""
        station, centre_m = self._station, _centre(self._holding.groups[place])
        nearest = station.knowledge.nearest(centre_m)[:2]
        own_m = float(np.hypot(*(station.place_m - centre_m)))
        for receiver in nearest:
            there_m = float(np.hypot(*(np.array(station.knowledge.sensors_m[receiver]) - centre_m)))
            if own_m - there_m <= station.parameters.migrate_m or (yield from self._given(place, receiver)):
                return


def _centre(held: Held) -> tuple[float, float]:
    x_m, y_m = held.belief.estimate_m.mean(axis=0).tolist()
    return x_m, y_m
