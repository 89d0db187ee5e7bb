"""Steps 4 and 5 of Table 1 (Liu, Reich, Zhao 2002): who is to lead next, and the belief on its way there."""

from collections.abc import Callable, Iterable, Sequence

from netsim.algorithms.idsq_messages import HANDOFF, NOBODY, TAKEN, Held, Thread, decode_energy, turn_of
from netsim.algorithms.idsq_payload import Laid
from netsim.algorithms.idsq_station import Station
from netsim.api import Message, Op
from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.grid_belief import diffusion_operations
from netsim.kernels.handoff_cost import HandoffCost
from netsim.kernels.selection import PRICED, best, choosing_operations, utilities
from netsim.trace.events import Handoff
from netsim.units import s_to_ns


class HandingOn:
    """Hands beliefs to the best node that takes them.

    Args:
        station: This node.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._chosen: dict[Thread, tuple[int, int]] = {}

    def on(self, held: Held, without: Sequence[int] = ()) -> Op[tuple[Held, int | None]]:
        """Hand a belief to the best candidate, or the next best.

        Args:
            held: What is handed on.
            without: Nodes left out, besides the leader before (the triplet rule).

        Returns:
            What was handed on, in a later epoch than `held` where an earlier try may have arrived unnoticed, and who took
            it; None where nobody did, so that this node leads on.
        """
        node, robust = self._station.node, self._station.parameters.robust
        laid = self._station.coder.encode(held.belief)
        yield from node.compute(laid.operations)
        yield from node.pause(held.thread.number * s_to_ns(self._station.parameters.answer_s))  # the others go first
        left_out = [*without, *self._left_out(held)]
        until_ns = (self._station.step + 1) * self._station.step_ns
        while worth := (yield from self._worth(held, left_out, len(held.header + laid.data))):
            chosen = best(worth)
            self._chosen[held.thread] = held.step, chosen
            payload = held.header + laid.data
            self._tell(held, chosen, worth, laid, len(payload))
            if (yield from self._given(held, chosen, payload)):
                return held, chosen
            left_out.append(chosen)
            if robust:
                self._station.suspect(chosen)
                held = held.again()
                if node.now_ns >= until_ns:
                    break
        return held, None

    def _left_out(self, held: Held) -> list[int]:
        """Who led before, who has not answered lately, and to whom another thread of the track has gone in this step."""
        station = self._station
        before = [] if held.previous is None or not station.parameters.excludes_previous else [held.previous]
        claims = station.book.since(station.step * station.step_ns)
        heard = {claim.thread: (claim.turn.step, claim.leader) for claim in claims if claim.leader != NOBODY}
        taken = [
            leader
            for thread, (step, leader) in [*heard.items(), *self._chosen.items()]
            if thread.track == held.thread.track and thread != held.thread and step == held.step
        ]
        suspects = station.suspects()
        if not station.knowledge.neighbours(station.sensor.position_m, [*before, *suspects, *taken]):
            suspects = []  # better to try them again than to lead alone
        return [*before, *suspects, *taken]

    def _worth(self, held: Held, left_out: Sequence[int], payload_byte: int) -> Op[dict[int, float]]:
        """What speaks for each candidate's next reading."""
        station, parameters = self._station, self._station.parameters
        knowledge, rng = station.knowledge, station.node.rng("selection")
        steps = max(1, station.step - held.step)
        predicted = station.filtering.predicted(held.belief, steps)
        candidates = knowledge.neighbours(station.sensor.position_m, left_out)
        specs = self._who_can_tell(held, {other: knowledge.others[other] for other in candidates})
        rule, exact = parameters.selection, parameters.exact_information
        worth = utilities(
            rule,
            predicted,
            specs,
            rng,
            exact=exact,
            costs=self._costs_j(specs, payload_byte) if rule in PRICED else None,
            energy_left=station.energy_share,
            bit_per_joule=parameters.cost.bit_per_joule,
        )
        operations = steps * diffusion_operations(held.belief, predicted, station.filtering.radius_m)
        yield from station.node.compute(operations + choosing_operations(rule, predicted, specs, exact=exact))
        return worth

    def _who_can_tell(self, held: Held, specs: dict[int, SensorSpec]) -> dict[int, SensorSpec]:
        """While silence makes a target doubtful, those whose sensors could hear it, if there are any.

        Else bearings, which say something of every noise, might keep a track of nothing among themselves for ever.
        """
        hearing = {node: spec for node, spec in specs.items() if not spec.measures_bearing}
        is_doubtful = self._station.parameters.robust and held.quiet > 0
        return hearing if is_doubtful and hearing else specs

    def _costs_j(self, candidates: Iterable[int], payload_byte: int) -> dict[int, float]:
        """Joules of the hand-off to each candidate, by what this node knows of its links."""
        prr = {neighbour.id: neighbour.prr for neighbour in self._station.node.neighbours}
        cost = HandoffCost(self._station.parameters.cost.joule_per_byte)
        return {other: cost.joules(payload_byte, prr.get(other, 0.0)) for other in candidates}

    def _given(self, held: Held, chosen: int, payload: bytes) -> Op[bool]:
        """Whether a node took it, as far as this one can tell."""
        node, parameters = self._station.node, self._station.parameters
        for _ in range(parameters.handoff_tries):
            delivery = yield from node.send(chosen, HANDOFF, payload).wait()
            if delivery.acknowledged and (not parameters.robust or (yield from self._is_taken(held, chosen))):
                return True
        return False

    def _is_taken(self, held: Held, chosen: int) -> Op[bool]:
        wait_ns = s_to_ns(self._station.parameters.answer_s)
        answers = _answers(held, chosen)
        answer = yield from self._station.node.receive(kinds={TAKEN}, match=answers, timeout_ns=wait_ns)
        if answer is None:
            return False
        self._station.energy_share[chosen] = decode_energy(answer.payload)
        return True

    def _tell(self, held: Held, chosen: int, worth: dict[int, float], laid: Laid, payload_byte: int) -> None:
        node = self._station.node
        choice = list(worth), list(worth.values()), laid.form, payload_byte, laid.divergence_bit
        node.record(Handoff(node.id, held.thread.track, held.step, chosen, *choice, held.thread.number))


def _answers(held: Held, chosen: int) -> Callable[[Message], bool]:
    """Whether a `taken` is the answer of a node to a hand-off."""
    return lambda message: message.source == chosen and turn_of(message.payload) == (held.thread, held.turn)
