"""What all parts of a node's tracker share: handle, knowledge, settings, and the clock of readings."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge
from netsim.kernels.semiring import FloatArray
from netsim.units import s_to_ns

CALL, READING, GIVEN, TAKEN, END = "call", "reading", "given", "taken", "end"


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

    def read(self) -> Op[float | None]:
        """The node's reading; None if its energy allowance refuses it."""
        try:
            observation = yield from self.node.sense()
        except NoEnergyError:
            return None
        return float(observation.values[0])
