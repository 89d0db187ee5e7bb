"""The IDSQ tracker (Liu, Reich, Zhao 2002, Table 1): the belief wanders over the air, and whoever holds it leads.

A leader predicts, senses, updates, chooses the next leader and hands the belief over, all within one reading interval; all
others wait. Step numbers count reading intervals from time 0 of the nodes' clocks.

`idsq_lead` has steps 1 to 3 and `idsq_handoff` steps 4 and 5; this module is step 0. What the paper leaves as future work
(section 6) is apart: `idsq_guard` replaces leaders that fall silent, `idsq_watch` begins tracks, `idsq_sleep` lets radios
sleep.
"""

import math
import struct

from netsim.algorithms.idsq_all import QUERY, Neighbourhood
from netsim.algorithms.idsq_guard import Guards
from netsim.algorithms.idsq_lead import Leaders
from netsim.algorithms.idsq_messages import (
    ALIVE,
    DETECT,
    HANDOFF,
    LEAD,
    NOBODY,
    TAKEN,
    TOLD,
    Claim,
    Held,
    Thread,
    Turn,
    belief_bytes,
    decode_claim,
    decode_handoff,
    encode_taken,
    turn_of,
)
from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.algorithms.idsq_station import Station
from netsim.algorithms.idsq_watch import Watch
from netsim.api import Message, NodeHandle, Op
from netsim.errors import AlgorithmError
from netsim.kernels.grid_belief import uniform
from netsim.kernels.tracking_model import TrackingKnowledge

HEARD = frozenset({HANDOFF, LEAD, ALIVE, DETECT, QUERY})


class Idsq:
    """See `IdsqParameters`."""

    def __init__(self, parameters: IdsqParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        knowledge = tracking_knowledge(node)
        if knowledge.is_watchdog and not self._parameters.robust:
            message = "watchdogs need a tracker with `robust: true`: they are quiet where leaders claim their tracks"
            raise AlgorithmError(message)
        if knowledge.sensor is not None:
            yield from Tracker(Station(node, knowledge, knowledge.sensor, self._parameters)).run()


def tracking_knowledge(node: NodeHandle) -> TrackingKnowledge:
    """What a node knows of a tracking problem.

    Raises:
        AlgorithmError: If the scenario's problem is another one.
    """
    if isinstance(node.knowledge, TrackingKnowledge):
        return node.knowledge
    message = f"this algorithm needs a tracking problem, not {type(node.knowledge).__name__}"
    raise AlgorithmError(message)


class Tracker:
    """One node's part.

    Args:
        station: The node.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._guards = Guards(station)
        self._leaders = Leaders(station, self._stand_guard)
        self._watch = Watch(station, self._leaders)
        self._neighbourhood = Neighbourhood(station)

    def run(self) -> Op[None]:
        """Step 0 of Table 1: wait for a belief, and heed what others say meanwhile."""
        station, node = self._station, self._station.node
        node.spawn(station.waking.windows())
        if station.knowledge.leads_first:
            self._begin_as_told()
        if station.knowledge.is_watchdog:
            node.spawn(self._watch.watch())
        while True:
            message = yield from node.receive(kinds=HEARD, timeout_ns=station.left_ns)
            if message is None:
                return
            try:
                self._heed(message)
            except (ValueError, struct.error) as error:
                node.log(f"a {message.kind} from node {message.source} makes no sense: {error}")

    def _begin_as_told(self) -> None:
        """Lead the first track, unless its time is over: a node that was told so comes here after a crash too."""
        station = self._station
        if station.step > 0:
            station.node.log("told to lead first, but the first reading instant has passed by its clock: it does not")
            return
        held = Held(Thread(TOLD), Turn(0, 0), uniform(station.knowledge.grid))
        self._leaders.begin(held, hand_on_first=station.parameters.first_step == "hands_over")

    def _heed(self, message: Message) -> None:
        if message.kind == HANDOFF:
            self._on_handoff(message)
        elif message.kind == LEAD:
            self._on_claim(message)
        elif message.kind == ALIVE:
            self._guards.answer(self._leaders, message, turn_of(message.payload)[0])
        elif message.kind == QUERY:
            self._neighbourhood.heed(message)
        else:
            self._on_alarm(message)

    def _on_handoff(self, message: Message) -> None:
        """Lead from now on, unless somebody else does by better right, or this node has handed on since."""
        station = self._station
        held = decode_handoff(message.payload, message.source, station.coder.decode)
        known, led = station.book.latest(held.thread), self._leaders.held(held.thread)
        is_again = led is not None and (led.turn, led.previous) == (held.turn, held.previous)
        if not is_again and known is not None and _forbids(known, held.turn):
            if station.parameters.robust:
                station.tell(known, message.source)
            return
        if station.parameters.robust:
            station.answer(message.source, TAKEN, encode_taken(held, station.own_energy_share))
        if not is_again:
            self._leaders.take(held, station.coder.decoding_operations(belief_bytes(message.payload), held.belief))

    def _on_claim(self, message: Message) -> None:
        claim = decode_claim(message.payload, self._station.knowledge.grid.origin_m)
        self._station.book.note(claim, message.source, self._station.node.now_ns)
        self._leaders.heed(claim)
        self._guards.heed(claim)
        if message.source in self._station.knowledge.others or self._is_near(claim):
            self._station.waking.stay()

    def _is_near(self, claim: Claim) -> bool:
        sleep, here_m = self._station.parameters.sleep, self._station.sensor.position_m
        return sleep is not None and math.dist(claim.place_m, here_m) <= sleep.near_m

    def _on_alarm(self, message: Message) -> None:
        """Look whether there is anything to hear; a leader tells who raised the alarm of its track, in case that is all."""
        self._station.waking.stay()
        self._watch.hear(message)
        for claim in self._leaders.claims():
            self._station.tell(claim, message.source)

    def _stand_guard(self, held: Held, successor: int) -> None:
        if self._station.parameters.robust:
            self._guards.begin(self._leaders, held, successor)


def _forbids(known: Claim, turn: Turn) -> bool:
    """Whether a thread has come further than a turn, or ended."""
    reached, offered = (known.turn.epoch, known.turn.step), (turn.epoch, turn.step)
    return reached > offered or (reached == offered and known.leader == NOBODY)
