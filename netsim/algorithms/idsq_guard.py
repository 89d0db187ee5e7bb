"""Who led before stands guard: it keeps the belief that it handed on, and takes it back if its successor falls silent.

A guard is relieved by a claim that its successor has handed on, or that the track has ended. One that hears no claim within
its patience after a reading instant asks the successor, and takes the track back, in the next epoch, if nobody answers.
"""

from netsim.algorithms.idsq_lead import Leaders
from netsim.algorithms.idsq_messages import ALIVE, Claim, Held, Thread, claim_of, encode_question
from netsim.algorithms.idsq_station import Station
from netsim.api import Message, Op
from netsim.trace.events import Role
from netsim.units import s_to_ns

QUESTIONS = 2
PATIENCE = 0.6
"""Of the time between two readings: hand-offs take the time before."""


class Guards:
    """The successors that this node watches over.

    Args:
        station: This node.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._guarded: dict[Thread, tuple[Held, int]] = {}
        patience_s = station.parameters.patience_s
        self._patience_ns = round(PATIENCE * station.step_ns) if patience_s is None else s_to_ns(patience_s)

    def begin(self, leaders: Leaders, held: Held, successor: int) -> None:
        """Watch over the node that took a belief."""
        if not self._guarded:
            self._station.node.record(Role(self._station.node.id, "guard", 1))
        self._guarded[held.thread] = held, successor
        self._station.node.spawn(self._guard(leaders, held, successor))

    def heed(self, claim: Claim) -> None:
        """Tell a leader whose claim counts less that there is a successor who leads by right."""
        held, successor = self._guarded.get(claim.thread, (None, None))
        if held is None or successor is None or claim.leader in (successor, self._station.node.id):
            return
        right = claim_of(held, successor)
        if claim.rank < right.rank and claim.turn == held.turn:
            self._station.tell(right, claim.leader)

    def answer(self, leaders: Leaders, question: Message, thread: Thread) -> None:
        """Tell a guard who leads a thread, as far as this node knows."""
        held = leaders.held(thread)
        claim = self._station.book.latest(thread) if held is None else claim_of(held, self._station.node.id)
        if claim is not None:
            self._station.tell(claim, question.source)

    def _guard(self, leaders: Leaders, held: Held, successor: int) -> Op[None]:
        station, post, step = self._station, self._guarded[held.thread], held.step
        try:
            with station.waking.needed():
                while not station.is_over and leaders.held(held.thread) is None:
                    yield from station.node.pause_until((step + 1) * station.step_ns + self._patience_ns)
                    step = max(step + 1, station.step)
                    if self._guarded.get(held.thread) is not post or self._is_relieved(held, successor):
                        return
                    if not self._renewed(held, step) and not (yield from self._answers(held, successor)):
                        self._take_back(leaders, held, successor)
                        return
        finally:
            self._leave(held.thread, post)

    def _leave(self, thread: Thread, post: tuple[Held, int]) -> None:
        if self._guarded.get(thread) is post:
            del self._guarded[thread]
            if not self._guarded:
                self._station.node.record(Role(self._station.node.id, "guard", 0))

    def _is_relieved(self, held: Held, successor: int) -> bool:
        """Whether somebody else leads by now, or nobody."""
        claim = self._station.book.latest(held.thread)
        if claim is None or claim.leader in (successor, self._station.node.id):
            return False
        return claim.rank > (held.turn.epoch, held.turn.step, -successor)

    def _renewed(self, held: Held, step: int) -> bool:
        """Whether the successor has claimed the thread in the present interval."""
        claim = self._station.book.latest(held.thread)
        return claim is not None and (claim.turn.epoch, claim.turn.step) >= (held.turn.epoch, step)

    def _answers(self, held: Held, successor: int) -> Op[bool]:
        """Whether the successor, when it is asked, says who leads; that the guard itself does is no help."""
        node = self._station.node
        for _ in range(QUESTIONS):
            asked_ns = node.now_ns
            yield from node.send(successor, ALIVE, encode_question(held.thread, held.turn)).wait()
            yield from node.pause(s_to_ns(self._station.parameters.answer_s))
            said = self._station.book.said_since(held.thread, successor, asked_ns)
            if said is not None:
                return said.leader != node.id
            if self._is_relieved(held, successor):
                return True
        return False

    def _take_back(self, leaders: Leaders, held: Held, lost: int) -> None:
        if leaders.held(held.thread) is not None:
            return
        self._station.suspect(lost)
        taken = held.taken_back()
        self._station.record("taken-back", taken, lost=lost)
        leaders.take_back(taken, lost)
