"""Watchdogs: they sense while nobody tracks, raise the alarm, and elect the loudest of those in reach to begin a track.

Who hears an alarm senses too. A candidate speaks after a random time, the sooner the louder, unless a louder one has spoken
before (Chang and Roberts 1979, with one hop of the air for the ring): so most of them never speak at all.

A target may be heard farther than a radio reaches. So who hears an alarm and a leader's claim as well passes the claim on,
lest who hears no leader begin a second track of the same target: after a random time, unless somebody else has done so
before (Floyd, Jacobson, Liu, McCanne, Zhang 1997, who suppress repairs likewise).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from netsim.algorithms.idsq_lead import Leaders
from netsim.algorithms.idsq_messages import (
    DETECT,
    NOBODY,
    Claim,
    Held,
    Thread,
    Turn,
    decode_alarm,
    encode_alarm,
    loudness_code,
    new_track,
)
from netsim.algorithms.idsq_station import Station
from netsim.api import Message, NoEnergyError, Op
from netsim.kernels.acoustics import AmplitudeModel
from netsim.kernels.grid_belief import uniform
from netsim.units import s_to_ns

INHIBITED_STEPS = 3
"""A claim keeps watchdogs quiet for so many readings: one or two may be lost."""
SPOKEN_BY = 0.6
"""Candidates speak within this share of the election."""
PASSED_ON_BY = 0.3
"""Claims are passed on within this share of an election after the alarm, so that they come before its end."""


@dataclass(slots=True)
class _Election:
    """What a node knows of an election that goes on: the loudest code and who, as (code, -node)."""

    best: tuple[int, int]


class Watch:
    """The node's part in detection.

    Args:
        station: This node.
        leaders: What begins a track.
    """

    def __init__(self, station: Station, leaders: Leaders) -> None:
        self._station = station
        self._leaders = leaders
        self._election: _Election | None = None
        self._threshold = station.detection_amplitude

    def watch(self) -> Op[None]:
        """Sense at every reading instant while nobody tracks nearby."""
        station = self._station
        while not station.is_over:
            yield from station.node.pause_until((station.step + 1) * station.step_ns)
            if self._may_begin():
                yield from self._stand(station.step)

    def hear(self, alarm: Message) -> None:
        """Somebody has raised the alarm: sense too, unless one has done so already."""
        step, code = decode_alarm(alarm.payload)
        rival = (code, -alarm.source)
        if any(self._ongoing()):
            self._station.node.spawn(self._pass_on(self._station.node.now_ns))
        if self._election is not None:
            self._election.best = max(self._election.best, rival)
        elif self._may_begin() and step >= self._station.step - 1:
            self._station.node.spawn(self._stand(self._station.step, rival))

    def _pass_on(self, alarm_ns: int) -> Op[None]:
        """Repeat what leaders have claimed, but for what has been heard since the alarm."""
        station, node = self._station, self._station.node
        longest_ns = PASSED_ON_BY * s_to_ns(station.parameters.watch.election_s)
        yield from node.pause(round(float(node.rng("passing-on").random()) * longest_ns))
        said = {claim.thread for claim in station.book.since(alarm_ns)}
        for claim in self._ongoing():
            if claim.thread not in said:
                station.repeat(claim)

    def _ongoing(self) -> Iterator[Claim]:
        """Claims of the present or the last interval: by their steps, so that none goes round for ever."""
        station = self._station
        claims = station.book.since(station.node.now_ns - INHIBITED_STEPS * station.step_ns)
        return (claim for claim in claims if claim.leader != NOBODY and claim.turn.step >= station.step - 1)

    def _may_begin(self) -> bool:
        """Whether it measures loudness, takes part in no election, and nobody tracks nearby."""
        if not math.isfinite(self._threshold) or self._election is not None or self._leaders.threads:
            return False
        return not self._is_tracked(self._station.parameters.watch.inhibit_m)

    def _is_tracked(self, within_m: float) -> bool:
        """Whether a track was within a distance lately."""
        station, here_m = self._station, self._station.sensor.position_m
        claims = station.book.since(station.node.now_ns - INHIBITED_STEPS * station.step_ns)
        return any(claim.leader != NOBODY and math.dist(claim.place_m, here_m) <= within_m for claim in claims)

    def _is_explained(self, loudness: float) -> bool:
        """Whether a source of the greatest amplitude could be a target that is tracked already, where it is by now."""
        station, model = self._station, self._station.sensor.model
        moved_m = INHIBITED_STEPS * station.filtering.radius_m
        greatest = model.high if isinstance(model, AmplitudeModel) else math.inf
        return self._is_tracked(greatest / loudness + station.parameters.watch.same_m + moved_m)

    def _stand(self, step: int, rival: tuple[int, int] = (0, 0)) -> Op[None]:
        """Sense, and stand for election if there is anything to hear."""
        station = self._station
        self._election = election = _Election(rival)
        try:
            with station.waking.needed():
                observation = yield from station.node.sense()
                loudness, _ = station.read(observation)
                if loudness >= self._threshold and not self._is_explained(loudness):
                    yield from self._elect(election, step, loudness)
        except NoEnergyError:
            return
        finally:
            self._election = None

    def _elect(self, election: _Election, step: int, loudness: float) -> Op[None]:
        """Lead a new track if nobody in reach is louder."""
        station, node = self._station, self._station.node
        own = (loudness_code(loudness), -node.id)
        election.best = max(election.best, own)
        time_ns = s_to_ns(station.parameters.watch.election_s)
        end_ns = node.now_ns + time_ns
        share = min((1.0 + float(node.rng("alarm").random())) / (2.0 + loudness / self._threshold), 1.0)
        yield from node.pause(round(SPOKEN_BY * share * time_ns))
        if election.best == own:
            node.broadcast(DETECT, encode_alarm(step, loudness))
        yield from node.pause_until(end_ns)
        if election.best == own and not self._is_explained(loudness) and not self._leaders.threads:
            yield from self._begin(step, loudness)

    def _begin(self, step: int, loudness: float) -> Op[None]:
        station = self._station
        square = uniform(station.knowledge.grid, station.sensor.position_m, station.parameters.watch.square_m)
        belief, _ = station.filtering.updated(square, station.sensor, loudness)
        yield from station.node.compute(station.filtering.operations(square, square, 0, station.sensor))
        held = Held(Thread(new_track(station.node.id, step)), Turn(0, step), belief)
        station.record("track-begun", held, loudness=loudness)
        self._leaders.begin(held, hand_on_first=True)
