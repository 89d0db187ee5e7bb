"""A member's part: read when a leader calls, tell it, and take a track over whose leader has fallen silent.

A member that hears no calls may only have missed them: it suspects the leader, and asks it by unicast before it takes over
(Das, Gupta, Motivala 2002, SWIM, section 4.2: suspicion before a member is declared failed). A former leader that has
heard nothing newer itself passes the question on to whom it gave the track.
"""

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Final

import numpy as np

from netsim.algorithms.joint_belief import particles_of
from netsim.algorithms.joint_book import Calls
from netsim.algorithms.joint_location import Whereabouts
from netsim.algorithms.joint_messages import (
    Ask,
    Call,
    Held,
    Reading,
    decode_ask,
    decode_call,
    encode_ask,
    encode_call,
    encode_reading,
)
from netsim.algorithms.joint_station import ASK, CALL, END, LATEST, READING, Station
from netsim.api import Message, Op
from netsim.kernels.particles import uniform_disc
from netsim.units import s_to_ns

_MOST_PASSED: Final = 4
"""How often a question is passed on: a track changes hands once a reading, or twice, and questions come after few."""


class Membership:
    """One node's memberships.

    Args:
        station: The node.
        claim: Lead a group whose leader has fallen silent.
        whereabouts: Knows to whom this node gave tracks.
    """

    def __init__(self, station: Station, claim: Callable[[Held], None], whereabouts: Whereabouts) -> None:
        self._station, self._claim, self._whereabouts = station, claim, whereabouts
        self._heard: dict[int, Call] = {}
        """The last word heard, by track."""
        self._ended: dict[int, Call] = {}
        """The last word on tracks that have ended."""
        self._calls = Calls(station)

    def hear(self, message: Message) -> None:
        """Answer a call whose targets are in range, and watch over it; a claim, and what another heard, is not answered."""
        call, station = decode_call(message.payload), self._station
        if any(self._is_older(call, track) for track in call.tracks):
            return
        self.note(call)
        if message.kind != LATEST:  # whoever passes a call on need not be the one who called
            self._calls.note(message.source, call)
        if station.range_to_m(call.estimates_m) <= station.knowledge.sensing_range_m and message.kind == CALL:
            station.node.spawn(self._answer(message, call))
        if tracks := self._watched(call):
            station.node.spawn(self._watch(message.source, call, tracks))

    def _watched(self, call: Call) -> tuple[int, ...]:
        """The tracks that this node is near to; of the others it might hear nothing once the group has split."""
        range_m = self._station.parameters.watch_share * self._station.knowledge.sensing_range_m
        near = np.hypot(*(call.estimates_m - self._station.place_m).T) <= range_m
        return tuple(track for track, is_near in zip(call.tracks, near.tolist(), strict=True) if is_near)

    def note_own(self, call: Call) -> None:
        """This node itself calls."""
        self.note(call)
        self._calls.note(self._station.node.id, call)

    def note(self, call: Call) -> None:
        """Somebody speaks for these tracks, perhaps this node itself."""
        self._heard.update(dict.fromkeys(call.tracks, call))
        for track in call.tracks:
            self._ended.pop(track, None)

    def forget(self, message: Message) -> None:
        """Some tracks have ended."""
        self.note_end(decode_call(message.payload))

    def note_end(self, call: Call) -> None:
        """Tracks have ended, perhaps of this node itself, unless a later leader goes on with them."""
        for track in call.tracks:
            if not self._is_older(call, track):
                self._heard.pop(track, None)
                self._ended[track] = call

    def is_covered(self, step: int) -> bool:
        """Whether a group has called this node at a step."""
        return self._calls.any_at(step)

    def _is_older(self, call: Call, track: int) -> bool:
        known = self._heard.get(track)
        return known is not None and (known.step, known.turn) > (call.step, call.turn)

    def _answer(self, message: Message, call: Call) -> Op[None]:
        station, parameters = self._station, self._station.parameters
        energy = yield from station.read(call.step)
        spread_ns = parameters.spread_share * parameters.collect_share * station.step_ns
        yield from station.node.pause(int(station.node.rng("answers").random() * spread_ns))
        if energy is not None:
            payload = encode_reading(Reading(call.step, energy, self._calls.sighted(call)))
            station.node.send(message.source, READING, payload, causes=[message])

    def asked(self, message: Message) -> None:
        """Tell the last words on some tracks, heard or said, that are later than what a member knows, or pass it on."""
        ask = decode_ask(message.payload)
        ended = {track: call for track in ask.tracks if (call := self._end_of(track, ask)) is not None}
        later = {track: call for track in ask.tracks if (call := self._later(track, ask)) is not None}
        for kind, calls in ((END, ended), (LATEST, later)):
            for call in dict.fromkeys(calls.values()):
                self._station.node.send(ask.member, kind, encode_call(call), causes=[message])
        self._pass_on(message, ask, [track for track in ask.tracks if track not in {*ended, *later}])

    def _later(self, track: int, ask: Ask) -> Call | None:
        call = self._heard.get(track)
        return call if call is not None and (call.step, call.turn) > (ask.step, ask.turn) else None

    def _end_of(self, track: int, ask: Ask) -> Call | None:
        """The word that a track has ended; it names the reading that the last call was for."""
        call = self._ended.get(track)
        return call if call is not None and (call.step, call.turn) >= (ask.step, ask.turn) else None

    def _pass_on(self, message: Message, ask: Ask, tracks: Collection[int]) -> None:
        """Ask whom this node gave the tracks to."""
        given = {track: receiver for track in tracks if (receiver := self._whereabouts.next_of(track)) is not None}
        if ask.passed == _MOST_PASSED:
            return
        for receiver in sorted({*given.values()} - {ask.member}):
            rest = tuple(track for track in given if given[track] == receiver)
            payload = encode_ask(replace(ask, passed=ask.passed + 1, tracks=rest))
            self._station.node.send(receiver, ASK, payload, causes=[message])

    def _watch(self, source: int, call: Call, tracks: Collection[int]) -> Op[None]:
        """Take over those tracks for which nobody speaks any more; the nearest to the targets is the first to do so.

        Args:
            source: Whom the call was heard from.
            call: The last word.
            tracks: Those of its tracks that this node watches.
        """
        station, parameters = self._station, self._station.parameters
        range_share = station.range_to_m(call.estimates_m) / station.knowledge.sensing_range_m
        delay = 0.7 * range_share + 0.2 * float(station.node.rng("watch").random())
        silence_ns = (parameters.silence_steps + delay) * station.step_ns
        yield from station.node.pause_until(station.time_ns(call.step) + int(silence_ns))
        if silent := self._silent(call, tracks):
            ask = Ask(call.step, call.turn, station.node.id, 0, tuple(silent))
            station.node.send(source, ASK, encode_ask(ask))
            yield from station.node.pause(s_to_ns(parameters.ask_s))
            self._take_over(call, self._silent(call, silent))

    def _silent(self, call: Call, tracks: Collection[int]) -> list[int]:
        """Those of some tracks for which a call is still the last word."""
        return [track for track in tracks if self._heard.get(track) is call]

    def _take_over(self, call: Call, tracks: Collection[int]) -> None:
        if tracks:
            held = self._anew(call, tuple(track for track in call.tracks if track in tracks))
            self._station.node.log(f"leader of {held.label} silent since reading {call.step}: taking over")
            self._claim(held)

    def _anew(self, call: Call, tracks: tuple[int, ...]) -> Held:
        """What a member can know of some of a call's tracks: they were near the last estimates, and have moved since.

        A group of which only a part is taken over has parted: who is who among its tracks is open, whoever takes the rest.
        """
        station = self._station
        elapsed = station.step - call.step + 1  # a call's estimates are a step old
        spread_m = station.knowledge.max_speed_m_per_s * station.knowledge.reading_s * elapsed
        centres_m = call.estimates_m[[call.tracks.index(track) for track in tracks]]
        belief = uniform_disc(centres_m, spread_m, particles_of(station, len(tracks)), station.rng)
        known = call.known.recovered()
        known = known if tracks == call.tracks else known.met(call.tracks)
        return Held(station.step, call.turn + 1, tracks, belief, known, is_blank=True)
