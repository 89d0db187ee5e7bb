"""What all parts of the tracker on one node share: its sensor and settings, its clock in steps, what it has heard."""

import json
import math

from netsim.algorithms.idsq_book import Book
from netsim.algorithms.idsq_messages import LEAD, NOBODY, Claim, Held, claim_of, encode_claim
from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.algorithms.idsq_payload import BeliefCoder
from netsim.algorithms.idsq_sleep import Waking
from netsim.api import NodeHandle, Observation
from netsim.errors import AlgorithmError
from netsim.kernels.acoustics import AmplitudeModel, SensorSpec
from netsim.kernels.beamformer import reading_of, reading_operations
from netsim.kernels.gating import detection_threshold
from netsim.kernels.idsq import Filter
from netsim.kernels.tracking_model import TrackingKnowledge
from netsim.trace.events import AlgorithmRecord
from netsim.units import s_to_ns


class Station:
    """One node of the tracker.

    Args:
        node: The node.
        knowledge: What it knows of the problem.
        sensor: Its own sensor.
        parameters: Settings.

    Attributes:
        filtering: How beliefs are predicted and updated.
        coder: How they are laid out in bytes.
        book: What it has heard of tracks.
        waking: Its radio.
        step_ns: Time between two readings.
        energy_share: What share of their energy other nodes had left when they last said so.
    """

    def __init__(
        self, node: NodeHandle, knowledge: TrackingKnowledge, sensor: SensorSpec, parameters: IdsqParameters
    ) -> None:
        self.node = node
        self.knowledge = knowledge
        self.sensor = sensor
        self.parameters = parameters
        radius_m = knowledge.max_speed_m_per_s * knowledge.reading_s
        self.filtering = Filter(radius_m, parameters.least_probability, parameters.gate)
        self.coder = BeliefCoder(knowledge.grid, parameters.payload, parameters.belief)
        self.book = Book()
        self.step_ns = s_to_ns(knowledge.reading_s)
        self.waking = Waking(node, parameters.sleep, self.step_ns)
        self.energy_share: dict[int, float] = {}
        self._suspected_ns: dict[int, int] = {}
        self._end_ns = None if parameters.until_s is None else s_to_ns(parameters.until_s)
        self._energy_j = node.energy_left_j

    @property
    def step(self) -> int:
        """Number of the present reading interval."""
        return self.node.now_ns // self.step_ns

    @property
    def others_sleep(self) -> bool:
        """Whether the window is over in which all listen."""
        sleep = self.parameters.sleep
        return sleep is not None and self.node.now_ns > self.step * self.step_ns + s_to_ns(sleep.window_s)

    def reading_ns(self, step: int) -> int:
        """When to take the reading of a step; one that is late waits for the next window, if others sleep by now."""
        due_ns = step * self.step_ns
        return (self.step + 1) * self.step_ns if self.node.now_ns > due_ns and self.others_sleep else due_ns

    @property
    def left_ns(self) -> int | None:
        """Time until the nodes stop; None for ever."""
        return None if self._end_ns is None else max(0, self._end_ns - self.node.now_ns)

    @property
    def is_over(self) -> bool:
        """Whether the nodes are to stop."""
        return self.left_ns == 0

    @property
    def own_energy_share(self) -> float:
        """What share it has left of the energy it started with or of its present allowance, whichever is shorter."""
        pairs = (self.node.energy_left_j, self._energy_j), (self.node.budget.left_j, self.node.budget.allowance_j)
        return min((left_j / whole_j for left_j, whole_j in pairs if 0.0 < whole_j < math.inf), default=1.0)

    @property
    def detection_amplitude(self) -> float:
        """Loudness from which on there is a target; infinite for a sensor that does not measure any."""
        chosen = self.parameters.watch.detection_amplitude
        return self.noise_amplitude if chosen is None else max(chosen, self.noise_amplitude)

    @property
    def noise_amplitude(self) -> float:
        """Loudness below which there may be noise alone; infinite for a sensor that does not measure any."""
        model = self.sensor.model
        if not isinstance(model, AmplitudeModel):
            return math.inf
        return detection_threshold(model, self.parameters.watch.false_alarm)

    def read(self, observation: Observation) -> tuple[float, int]:
        """The reading in an observation, and how many operations it takes to find it; NaN for no reading."""
        values, processing = observation.values, self.knowledge.processing
        return reading_of(values, processing), reading_operations(values, processing)

    def suspect(self, other: int) -> None:
        """A node did not answer."""
        self._suspected_ns[other] = self.node.now_ns

    def suspects(self) -> list[int]:
        """Nodes that have not answered lately."""
        since_ns = self.node.now_ns - s_to_ns(self.parameters.suspect_s)
        return [other for other, time_ns in self._suspected_ns.items() if time_ns > since_ns]

    def claim(self, held: Held, leader: int) -> None:
        """Note who leads a thread, and with `robust` tell everybody in reach."""
        claim = claim_of(held, leader)
        self.book.note(claim, self.node.id, self.node.now_ns)
        if self.parameters.robust:
            self.repeat(claim)

    def repeat(self, claim: Claim) -> None:
        """Tell everybody in reach who leads a thread."""
        self.node.broadcast(LEAD, encode_claim(claim, self.knowledge.grid.origin_m))

    def tell(self, claim: Claim, other: int) -> None:
        """Tell one node who leads a thread."""
        if other not in (self.node.id, NOBODY):
            self.answer(other, LEAD, encode_claim(claim, self.knowledge.grid.origin_m))

    def answer(self, other: int, kind: str, payload: bytes) -> None:
        """Send to a node that a message named; one that was garbled may name any."""
        try:
            self.node.send(other, kind, payload)
        except AlgorithmError as error:
            self.node.log(f"no answer to a message that must be garbled: {error}")

    def record(self, kind: str, held: Held, **more: object) -> None:
        """Put into the trace what befell a track."""
        fields = {"track": held.thread.track, "thread": held.thread.number, "step": held.step, **more}
        self.node.record(AlgorithmRecord(self.node.id, kind, json.dumps(fields)))
