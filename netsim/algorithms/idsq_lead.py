"""Table 1 of Liu, Reich, Zhao 2002, from the belief that comes in to the belief that goes out."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from netsim.algorithms.belief_records import record_belief
from netsim.algorithms.idsq_all import Neighbourhood
from netsim.algorithms.idsq_handoff import HandingOn
from netsim.algorithms.idsq_messages import NOBODY, TOLD, Claim, Held, Thread, Turn, claim_of, is_elder
from netsim.algorithms.idsq_station import Station
from netsim.api import NoEnergyError, Op, Task
from netsim.kernels.grid_belief import GridBelief
from netsim.kernels.idsq import rim_probability
from netsim.trace.events import Role

ON_THE_RIM = 0.5
MOST_REFUSED = 2
"""So many sensors in a row outvote the belief: the next reading is used whatever it is."""
OnHandedOn = Callable[[Held, int], None]
"""Called with what was handed on, and to whom."""


@dataclass(slots=True, eq=False)
class _Leadership:
    """One thread that this node leads.

    Attributes:
        held: What it holds.
        decoding: Operations that it took to read what was handed over.
        task: What it does.
    """

    held: Held
    decoding: int = 0
    task: Task[None] | None = None


class Leaders:
    """The threads that this node leads; usually none, or one.

    Args:
        station: This node.
        on_handed_on: What happens after a hand-off.
    """

    def __init__(self, station: Station, on_handed_on: OnHandedOn) -> None:
        self._station = station
        self._handing = HandingOn(station)
        self._neighbourhood = Neighbourhood(station)
        self._on_handed_on = on_handed_on
        self._led: dict[Thread, _Leadership] = {}

    @property
    def threads(self) -> Sequence[Thread]:
        """What it leads."""
        return list(self._led)

    def claims(self) -> list[Claim]:
        """What it says of them when it is asked: of the step before, lest it outdo a hand-off that is on its way."""
        return [
            replace(claim, turn=replace(claim.turn, step=max(claim.turn.step - 1, 0)))
            for claim in (claim_of(leadership.held, self._station.node.id) for leadership in self._led.values())
        ]

    def held(self, thread: Thread) -> Held | None:
        """What it holds of a thread; None if it does not lead it."""
        leadership = self._led.get(thread)
        return None if leadership is None else leadership.held

    def begin(self, held: Held, *, hand_on_first: bool) -> None:
        """Lead a new track, and give its further threads to the best of the others."""
        self._tell(held)
        self._take(held, hand_on_first=hand_on_first, without=(), forks=self._station.parameters.threads - 1)

    def take(self, held: Held, decoding: int) -> None:
        """Lead a thread from the next reading on; reading what was handed over took so many operations."""
        self._take(held, hand_on_first=False, without=(), forks=0, decoding=decoding)

    def take_back(self, held: Held, lost: int) -> None:
        """Hand a thread to another node than the one that was lost, or else lead it."""
        self._take(held, hand_on_first=True, without=(lost,), forks=0)

    def drop(self, thread: Thread) -> None:
        """Lead a thread no more, whatever its leader is about."""
        leadership = self._led.get(thread)
        if leadership is not None:
            self._release(leadership)
            if leadership.task is not None:
                leadership.task.cancel()

    def heed(self, claim: Claim) -> None:
        """Step down where somebody else's claim counts more, or an older track follows the same target."""
        own = self.held(claim.thread)
        if own is not None and self._is_rival(claim, own):
            self._station.record("stepped-down", own, to=claim.leader)
            self.drop(claim.thread)
        for thread in self.threads:
            held = self._led[thread].held
            if self._is_elder(claim, held):
                self._end(held, "duplicate")
                self.drop(thread)

    def _take(self, held: Held, *, hand_on_first: bool, without: Sequence[int], forks: int, decoding: int = 0) -> None:
        self.drop(held.thread)
        node, leadership = self._station.node, _Leadership(held, decoding)
        if not self._led:
            node.record(Role(node.id, "leader", 1))
        self._led[held.thread] = leadership
        leadership.task = node.spawn(self._lead(leadership, hand_on_first, without, forks))

    def _release(self, leadership: _Leadership) -> None:
        thread, node = leadership.held.thread, self._station.node
        if self._led.get(thread) is leadership:
            del self._led[thread]
            if not self._led:
                node.record(Role(node.id, "leader", 0))

    def _lead(self, leadership: _Leadership, hand_on_first: bool, without: Sequence[int], forks: int) -> Op[None]:
        """Steps 1 to 5 of Table 1, until somebody else leads."""
        station = self._station
        try:
            with station.waking.needed():
                yield from station.node.compute(leadership.decoding)
                yield from self._forked(leadership.held, forks)
                if hand_on_first and not station.others_sleep and (yield from self._handed_on(leadership, without)):
                    return
                while True:
                    yield from station.node.pause_until(station.reading_ns(leadership.held.step + 1))
                    if station.parameters.sleep is not None:
                        station.claim(leadership.held, station.node.id)  # who may be next is to stay awake
                    if station.is_over or (yield from self._is_lost(leadership)):
                        return
                    if (yield from self._handed_on(leadership)):
                        return
        except NoEnergyError as error:
            station.node.log(f"leads no more: {error}")
        finally:
            self._release(leadership)

    def _is_lost(self, leadership: _Leadership) -> Op[bool]:
        """Update the belief; whether that ends the track."""
        held = leadership.held = yield from self._updated(leadership.held)
        self._tell(held)
        if not self._station.parameters.robust:
            return False
        recent = list(self._station.book.since(self._station.node.now_ns - 3 * self._station.step_ns // 2))
        last = self._station.parameters.watch.lost_after
        if last and held.quiet >= last and (held.thread.track != TOLD or _others(recent, held)):
            self._end(held, "track-ended")
            return True
        if any(self._is_elder(claim, held) for claim in recent):
            self._end(held, "duplicate")
            return True
        return False

    def _updated(self, held: Held) -> Op[Held]:
        """Steps 1 to 3: predict, sense, update."""
        station, step = self._station, self._station.step
        asked = self._neighbourhood.ask(step)
        observation = yield from station.node.sense()
        reading, operations = station.read(observation)
        predicted = station.filtering.predicted(held.belief, step - held.step)
        trusts = held.refused < MOST_REFUSED
        belief, is_used = station.filtering.updated(predicted, station.sensor, reading, gated=trusts)
        operations += station.filtering.operations(held.belief, predicted, step - held.step, station.sensor)
        yield from station.node.compute(operations)
        if asked:
            told = yield from self._neighbourhood.answers(step, asked)
            readings = {station.node.id: reading, **told}
            belief, is_used = yield from self._neighbourhood.updated(predicted, readings, gated=trusts)
        if not is_used:
            station.record("outlier", held, reading=reading)
        turn, quiet = Turn(held.turn.epoch, step), self._quiet(held, reading, belief)
        return replace(held, turn=turn, belief=belief, quiet=quiet, refused=0 if is_used else held.refused + 1)

    def _quiet(self, held: Held, reading: float, belief: GridBelief) -> int:
        """How many readings in a row have told of no target here; a bearing, or no reading, says nothing of that."""
        if rim_probability(belief) > ON_THE_RIM or reading < self._station.noise_amplitude < math.inf:
            return held.quiet + 1
        return held.quiet if self._station.sensor.measures_bearing or math.isnan(reading) else 0

    def _handed_on(self, leadership: _Leadership, without: Sequence[int] = ()) -> Op[bool]:
        """Steps 4 and 5; False where nobody took it."""
        held, successor = yield from self._handing.on(leadership.held, without)
        leadership.held = held
        self._station.claim(held, self._station.node.id if successor is None else successor)
        if successor is None:
            return False
        self._on_handed_on(held, successor)
        return True

    def _forked(self, held: Held, forks: int) -> Op[None]:
        """Give a new track's further threads away, each to another node."""
        given: list[int] = []
        for number in range(1, forks + 1):
            fork = replace(held, thread=Thread(held.thread.track, number))
            fork, successor = yield from self._handing.on(fork, given)
            if successor is not None:
                given.append(successor)
                self._station.claim(fork, successor)
                self._on_handed_on(fork, successor)

    def _is_rival(self, claim: Claim, own: Held) -> bool:
        me = self._station.node.id
        return claim.leader != me and claim.rank > (own.turn.epoch, own.turn.step, -me)

    def _is_elder(self, claim: Claim, own: Held) -> bool:
        """Whether a claim is that of an older track of the same target."""
        if claim.leader == NOBODY or not is_elder(claim.thread.track, own.thread.track):
            return False
        x_m, y_m = own.belief.mean_m.tolist()
        return math.dist(claim.place_m, (x_m, y_m)) < self._station.parameters.watch.same_m

    def _end(self, held: Held, why: str) -> None:
        self._station.record(why, held)
        self._station.claim(held, NOBODY)

    def _tell(self, held: Held) -> None:
        """Put estimate and belief into the trace."""
        record_belief(self._station.node, held.thread.track, held.step, held.belief, held.thread.number)


def _others(claims: Sequence[Claim], held: Held) -> bool:
    """Whether there is a claim of another track."""
    return any(claim.thread.track != held.thread.track and claim.leader != NOBODY for claim in claims)
