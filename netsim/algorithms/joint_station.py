"""What all parts of a node's tracker share: handle, knowledge, settings, and the clock of readings."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.api import NodeHandle, NoEnergyError, Op, Task
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge
from netsim.kernels.semiring import FloatArray
from netsim.units import s_to_ns

CALL, CLAIM, READING, GIVEN, TAKEN, END = "call", "claim", "reading", "given", "taken", "end"
ASK, LATEST = "ask", "latest"


@dataclass(frozen=True)
class Station:
    """A node and what it goes by.

    Attributes:
        node: The node.
        knowledge: What it knows.
        parameters: The algorithm's settings.
    """

    node: NodeHandle
    knowledge: EnergyTrackingKnowledge
    parameters: JointTrackingParameters
    _read: dict[int, Task[float | None]] = field(default_factory=dict, init=False)
    """The last reading, by step."""

    @cached_property
    def rng(self) -> np.random.Generator:
        """The node's random numbers for particles."""
        return self.node.rng("particles")

    @property
    def step_ns(self) -> int:
        """Time between two readings."""
        return s_to_ns(self.knowledge.reading_s)

    @property
    def step(self) -> int:
        """Number of the last reading that is due."""
        return self.node.now_ns // self.step_ns

    @property
    def next_step(self) -> int:
        """Number of the next reading; of one that is due at this moment, that one."""
        return -(-self.node.now_ns // self.step_ns)

    @property
    def loud(self) -> float:
        """A reading above this shows that a target is near."""
        return self.parameters.quiet_sd * self.knowledge.model.noise_sd

    def new_track(self, step: int) -> int:
        """A number for a track that this node begins at a reading: nobody else's, and the higher the later it begins."""
        sensors = sorted(self.knowledge.sensors_m)
        return step * len(sensors) + sensors.index(self.node.id)

    def is_fresh(self, track: int) -> bool:
        """Whether a track was detected so lately that it may be another's double; one that a node was told of never is."""
        is_detected = self.parameters.begin == "detected"
        return is_detected and self.step - track // len(self.knowledge.sensors_m) <= self.parameters.fresh_steps

    def time_ns(self, step: int) -> int:
        """When a reading is due."""
        return step * self.step_ns

    @property
    def place_m(self) -> FloatArray:
        """Where this node's sensor is, shape (2,)."""
        return np.array(self.knowledge.sensors_m[self.node.id], dtype=float)

    def range_to_m(self, places_m: FloatArray) -> float:
        """Distance to the nearest of some places, shape (n, 2)."""
        return float(np.hypot(*(places_m - self.place_m).T).min())

    def read(self, step: int) -> Op[float | None]:
        """The node's reading of a step; None if its energy allowance refuses it.

        It is read once for all groups that the node is in: who asks while the sensor is at it waits for that.
        """
        if step not in self._read:
            self._read.clear()
            self._read[step] = self.node.spawn(self._sensed())
        return (yield from self._read[step].join())

    def _sensed(self) -> Op[float | None]:
        try:
            observation = yield from self.node.sense()
        except NoEnergyError:
            return None
        return float(observation.values[0])
