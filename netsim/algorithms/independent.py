"""Every sensor decides by itself: the baseline without any communication.

Chen, Wainwright, Cetin, Willsky, Mathematical and Computer Modelling 43 (2006), section 6.1: the best state of the sensor's
local potential. Targets that other sensors cover too have no evidence in it, so that their measurements tie.

What the processor is charged for: the sensor's reading, and one pass over the sensor's mask tables.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.errors import AlgorithmError
from netsim.kernels.association_model import AssociationKnowledge
from netsim.kernels.association_vertices import sensor_vertex
from netsim.kernels.injections import IntArray
from netsim.kernels.semiring import FloatArray
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.parameters import NonNegative, parameters
from netsim.trace.events import Association
from netsim.units import s_to_ns

_LAST_SENSOR = 1 << 24
"""Above all sensors' numbers: vertices of targets come after those of sensors, and ties are settled in that order."""


@parameters
class IndependentParameters:
    """Every sensor decides by its own measurements alone; nothing is sent."""

    type: Literal["independent"] = "independent"
    until_s: NonNegative = 0.0
    """The nodes stay on until then, which makes joules comparable with those of an algorithm that takes so long."""


class Independent:
    """See `IndependentParameters`."""

    def __init__(self, parameters: IndependentParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        knowledge = association_knowledge(node)
        if knowledge is not None:
            own_m = yield from measurements(node, knowledge.model.numbers)
            decision = yield from decide_alone(node, knowledge, own_m)
            node.record(Association(node.id, decision.tolist(), 0))
        yield from node.pause_until(s_to_ns(self._parameters.until_s))


def association_knowledge(node: NodeHandle) -> AssociationKnowledge | None:
    """What a node knows of a data-association problem; None for a node without a sensor.

    Raises:
        AlgorithmError: If the scenario's problem is another one.
    """
    knowledge = node.knowledge
    if knowledge is None or isinstance(knowledge, AssociationKnowledge):
        return knowledge
    message = f"this algorithm needs an association problem, not {type(knowledge).__name__}"
    raise AlgorithmError(message)


def measurements(node: NodeHandle, numbers: int) -> Op[FloatArray]:
    """Read the sensor; a node whose energy allowance refuses that goes on as if it had measured nothing.

    Args:
        node: The node.
        numbers: How many numbers a measurement has.

    Returns:
        Shape (measurements, numbers).
    """
    try:
        observation = yield from node.sense()
    except NoEnergyError:
        return np.empty((0, numbers))
    return np.asarray(observation.values, dtype=float)


def alone_vertex(knowledge: AssociationKnowledge, own_m: FloatArray) -> SensorVertex:
    """The association variable of a sensor that has heard nobody's measurements, as the hybrid model has it.

    Which of the graphical models the problem is posed in makes no difference to a sensor that decides alone.
    """
    targets = tuple(
        replace(covered, vertex=_LAST_SENSOR + covered.target if len(covered.sensors) >= 3 else None)
        for covered in knowledge.targets
    )
    sharing = {sensor for covered in targets for sensor in covered.sensors}
    nobody = {sensor: np.empty((0, own_m.shape[1])) for sensor in sharing}
    return sensor_vertex(replace(knowledge, targets=targets), own_m, nobody)


def decide_alone(node: NodeHandle, knowledge: AssociationKnowledge, own_m: FloatArray) -> Op[IntArray]:
    """The node-independent decision, after the time it takes; it is taken even where its energy is refused."""
    vertex = alone_vertex(knowledge, own_m)
    try:
        yield from node.compute(vertex.operations())
    except NoEnergyError:
        node.log("too little energy to decide: the decision is charged to nobody")
    return vertex.decide_alone()
