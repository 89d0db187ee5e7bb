"""The IDSQ tracker (Liu, Reich, Zhao 2002, Table 1): the belief wanders over the air, and whoever holds it leads.

A leader predicts, senses, updates, chooses the next leader and hands the belief over, all within one reading interval; all
others wait. Step numbers count reading intervals from time 0 of the nodes' clocks.
"""

from dataclasses import dataclass

from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.algorithms.idsq_payload import BeliefCoder, Laid
from netsim.api import Message, NodeHandle, Op
from netsim.codec import Record
from netsim.errors import AlgorithmError
from netsim.kernels.acoustics import SensorSpec
from netsim.kernels.grid_belief import GridBelief, condition, diffuse, pruned, uniform
from netsim.kernels.selection import best, utilities
from netsim.kernels.tracking_model import TrackingKnowledge
from netsim.trace.events import Belief, Estimate, Handoff, Role
from netsim.units import s_to_ns

HANDOFF = "handoff"
_HEADER = Record("HH")  # track, step


@dataclass(frozen=True, slots=True)
class Held:
    """What a leader holds.

    Attributes:
        track: Number of the track.
        step: Step of the belief.
        belief: After that step's reading.
        previous: The leader before; None for the first.
    """

    track: int
    step: int
    belief: GridBelief
    previous: int | None


class Idsq:
    """See `IdsqParameters`."""

    def __init__(self, parameters: IdsqParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        knowledge = tracking_knowledge(node)
        if knowledge.sensor is None:
            return
        tracker = _Tracker(node, knowledge, knowledge.sensor, self._parameters)
        if knowledge.leads_first:
            yield from tracker.begin()
        while True:
            held = yield from tracker.sleep()
            if held is None:
                return
            yield from tracker.lead(held)


def tracking_knowledge(node: NodeHandle) -> TrackingKnowledge:
    """What a node knows of a tracking problem.

    Raises:
        AlgorithmError: If the scenario's problem is another one.
    """
    if isinstance(node.knowledge, TrackingKnowledge):
        return node.knowledge
    message = f"this algorithm needs a tracking problem, not {type(node.knowledge).__name__}"
    raise AlgorithmError(message)


class _Tracker:
    """One node's part."""

    def __init__(
        self, node: NodeHandle, knowledge: TrackingKnowledge, sensor: SensorSpec, parameters: IdsqParameters
    ) -> None:
        self._node = node
        self._knowledge = knowledge
        self._sensor = sensor
        self._parameters = parameters
        self._coder = BeliefCoder(knowledge.grid, parameters.payload, parameters.belief)
        self._step_ns = s_to_ns(knowledge.reading_s)
        self._end_ns = None if parameters.until_s is None else s_to_ns(parameters.until_s)

    def begin(self) -> Op[None]:
        """Lead the first track: from a uniform belief, without a reading of step 0."""
        held = Held(0, 0, uniform(self._knowledge.grid), None)
        self._tell(held)
        yield from self.lead(held)

    def sleep(self) -> Op[Held | None]:
        """Step 0 of Table 1: wait for a belief; None at the end."""
        node = self._node
        left_ns = None if self._end_ns is None else max(0, self._end_ns - node.now_ns)
        message = yield from node.receive(kinds={HANDOFF}, timeout_ns=left_ns)
        return None if message is None else self._taken(message)

    def lead(self, held: Held) -> Op[None]:
        """Steps 1 to 5 of Table 1, until somebody else leads."""
        node = self._node
        node.record(Role(node.id, "leader", 1))
        while True:
            yield from node.pause_until((held.step + 1) * self._step_ns)
            if self._end_ns is not None and node.now_ns >= self._end_ns:
                break
            held = yield from self._updated(held)
            self._tell(held)
            if (yield from self._handed_over(held)):
                break
        node.record(Role(node.id, "leader", 0))

    def _updated(self, held: Held) -> Op[Held]:
        """Steps 1 to 3: predict, sense, update."""
        step = self._node.now_ns // self._step_ns
        predicted = self._predicted(held.belief, step - held.step)
        observation = yield from self._node.sense()
        logs = self._sensor.log_likelihood(float(observation.values[0]), predicted.centres_m)
        after, _ = condition(predicted, logs)
        return Held(held.track, step, pruned(after, self._parameters.least_probability), held.previous)

    def _predicted(self, belief: GridBelief, steps: int) -> GridBelief:
        for _ in range(steps):
            belief = diffuse(belief, self._knowledge.max_speed_m_per_s * self._knowledge.reading_s)
        return belief

    def _handed_over(self, held: Held) -> Op[bool]:
        """Steps 4 and 5; False where nobody took it."""
        node, parameters = self._node, self._parameters
        without = [] if held.previous is None or not parameters.excludes_previous else [held.previous]
        laid = self._coder.encode(held.belief)
        payload = _HEADER.pack(held.track, held.step) + laid.data
        predicted = self._predicted(held.belief, 1)
        while candidates := self._knowledge.neighbours(self._sensor.position_m, without):
            specs = {other: self._knowledge.others[other] for other in candidates}
            worth = utilities(
                parameters.selection, predicted, specs, node.rng("selection"), exact=parameters.exact_information
            )
            chosen = best(worth)
            self._tell_choice(held, chosen, worth, laid, len(payload))
            for _ in range(parameters.handoff_tries):
                delivery = yield from node.send(chosen, HANDOFF, payload).wait()
                if delivery.acknowledged:
                    return True
            without.append(chosen)
        return False

    def _taken(self, message: Message) -> Held:
        track, step = _HEADER.unpack(message.payload)
        belief = self._coder.decode(message.payload[_HEADER.size_byte :])
        return Held(track, step, belief, message.source)

    def _tell(self, held: Held) -> None:
        """Put estimate and belief into the trace."""
        node, belief, grid = self._node, held.belief, held.belief.grid
        (xx, xy), (_, yy) = belief.covariance_m2.tolist()
        x_m, y_m = belief.mean_m.tolist()
        node.record(Estimate(node.id, held.track, x_m, y_m, [xx, xy, yy]))
        cells, chances = belief.cells.tolist(), belief.probability.tolist()
        where = (*grid.origin_m, grid.cell_m, grid.columns)
        node.record(Belief(node.id, held.track, held.step, *where, cells, chances))

    def _tell_choice(self, held: Held, chosen: int, worth: dict[int, float], laid: Laid, payload_byte: int) -> None:
        node = self._node
        choice = list(worth), list(worth.values()), laid.form, payload_byte, laid.divergence_bit
        node.record(Handoff(node.id, held.track, held.step, chosen, *choice))
