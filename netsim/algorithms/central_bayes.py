"""Every reading to one node, which tracks for all: centralised Bayesian tracking (Liu, Reich, Zhao 2002, section 2.2).

Step numbers count reading intervals from time 0 of the nodes' clocks. As the first leader of the IDSQ tracker does, the sink
begins with a uniform belief at step 0 and takes its first readings at step 1.

What the processor is charged for: at a sensor its reading; at the sink prediction, likelihoods and update. Not charged:
encoding and decoding.
"""

import json
import math
import struct
from collections import defaultdict

from netsim.algorithms.belief_records import record_belief
from netsim.algorithms.central_bayes_parameters import CentralBayesParameters
from netsim.algorithms.idsq import tracking_knowledge
from netsim.algorithms.idsq_parameters import IdsqSleep
from netsim.algorithms.idsq_sleep import Waking
from netsim.algorithms.tracking_readings import STEPS, decode_reading, encode_reading, own_reading
from netsim.api import Message, NodeHandle, Op
from netsim.kernels.fusion import fused, fusion_operations
from netsim.kernels.grid_belief import GridBelief, diffusion_operations, uniform
from netsim.kernels.idsq import Filter
from netsim.kernels.tracking_model import TrackingKnowledge
from netsim.trace.events import AlgorithmRecord, Role
from netsim.units import s_to_ns

READING = "reading"
FUSED = "fused"
TRACK = 0


class CentralBayes:
    """See `CentralBayesParameters`."""

    def __init__(self, parameters: CentralBayesParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        knowledge = tracking_knowledge(node)
        if node.role == "sink":
            yield from _Centre(node, knowledge, self._parameters).track()
        else:
            yield from _report(node, knowledge, self._parameters)


def _report(node: NodeHandle, knowledge: TrackingKnowledge, parameters: CentralBayesParameters) -> Op[None]:
    """A sensor's part: read at every instant, and send the reading a little later."""
    step_ns, spread_ns = s_to_ns(knowledge.reading_s), s_to_ns(parameters.spread_s)
    if parameters.sleep == "scheduled":
        windows = IdsqSleep(window_s=parameters.deadline_s, guard_s=parameters.guard_s)
        node.spawn(Waking(node, windows, step_ns).windows())
    while not _is_over(node, parameters):
        step = node.now_ns // step_ns + 1
        yield from node.pause_until(step * step_ns)
        reading = None if knowledge.sensor is None else (yield from own_reading(node, knowledge))
        if reading is not None and not math.isnan(reading):
            at_ns = step * step_ns + int(node.rng("spread").random() * spread_ns)
            node.spawn(_told(node, at_ns, encode_reading(step, reading, parameters.payload)))
    yield from node.pause_until(node.now_ns // step_ns * step_ns + spread_ns)  # what is to be sent dies with the node


def _told(node: NodeHandle, at_ns: int, payload: bytes) -> Op[None]:
    """Send a reading at an instant, which may be after that of the next one."""
    yield from node.pause_until(at_ns)
    node.send_to_sink(READING, payload)


def _is_over(node: NodeHandle, parameters: CentralBayesParameters) -> bool:
    return parameters.until_s is not None and node.now_ns >= s_to_ns(parameters.until_s)


class _Centre:
    """The sink's part."""

    def __init__(self, node: NodeHandle, knowledge: TrackingKnowledge, parameters: CentralBayesParameters) -> None:
        self._node = node
        self._knowledge = knowledge
        self._parameters = parameters
        self._filtering = Filter(knowledge.max_speed_m_per_s * knowledge.reading_s, parameters.least_probability)
        self._step_ns = s_to_ns(knowledge.reading_s)
        self._told: defaultdict[int, dict[int, float]] = defaultdict(dict)  # by step, then node
        self._late = 0

    def track(self) -> Op[None]:
        """Gather and fuse, instant after instant."""
        node = self._node
        node.record(Role(node.id, "centre", 1))
        step, belief = node.now_ns // self._step_ns, uniform(self._knowledge.grid)
        record_belief(node, TRACK, step, belief)
        while not _is_over(node, self._parameters):
            step += 1
            readings = yield from self._gathered(step)
            belief = yield from self._updated(belief, readings)
            record_belief(node, TRACK, step, belief)
            fields = {"step": step, "readings": len(readings), "late": self._late}
            node.record(AlgorithmRecord(node.id, FUSED, json.dumps(fields)))
            self._late = 0
        node.record(Role(node.id, "centre", 0))

    def _gathered(self, step: int) -> Op[dict[int, float]]:
        """The readings of a step that come in time."""
        node, deadline_ns = self._node, step * self._step_ns + s_to_ns(self._parameters.deadline_s)
        while len(self._told[step]) < len(self._knowledge.others):
            message = yield from node.receive(kinds={READING}, timeout_ns=max(0, deadline_ns - node.now_ns))
            if message is None:
                break
            self._take(message, step)
        return self._told.pop(step)

    def _take(self, message: Message, step: int) -> None:
        try:
            code, reading = decode_reading(message.payload, self._parameters.payload)
        except (ValueError, struct.error) as error:
            self._node.log(f"a reading from node {message.source} makes no sense: {error}")
            return
        ahead = (code - step) % STEPS
        if ahead >= STEPS // 2:
            self._late += 1
        elif message.source in self._knowledge.others:
            self._told[step + ahead][message.source] = reading

    def _updated(self, belief: GridBelief, readings: dict[int, float]) -> Op[GridBelief]:
        sensors, filtering = self._knowledge.others, self._filtering
        predicted = filtering.predicted(belief, 1)
        operations = diffusion_operations(belief, predicted, filtering.radius_m)
        yield from self._node.compute(operations + fusion_operations(predicted, sensors, readings))
        return fused(predicted, sensors, readings, filtering.least_probability)
