"""All measurements to one node, which associates for all: the baseline of full centralisation.

The centre finds the most probable joint association (Chen, Wainwright, Cetin, Willsky, Mathematical and Computer Modelling
43 (2006), eq 6) by integer programming, as exactly as the payload's precision allows, and tells every sensor its part. What
did not reach it by its deadline it goes on without.

What the processor is charged for: the sensor's reading; at the centre the tables of joint hypotheses and a simplex run
(see `solving_operations`); at a sensor that hears no decision, deciding alone. Not charged: encoding and decoding.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from netsim.algorithms.central_reports import (
    Gathered,
    Priors,
    decode_decision,
    decode_report,
    encode_decision,
    encode_report,
    gather,
)
from netsim.algorithms.independent import association_knowledge, decide_alone, measurements
from netsim.api import NodeHandle, NoEnergyError, Op
from netsim.codec import FloatWidth, decode_floats, encode_floats
from netsim.errors import AlgorithmError, NetsimError
from netsim.kernels.assignment import ExactAssignment, best_assignment
from netsim.kernels.association_model import AssociationInstance, AssociationKnowledge, SensorModel
from netsim.kernels.polar_evidence import polar_operations
from netsim.kernels.semiring import FloatArray
from netsim.parameters import NonNegativeInt, Positive, PositiveInt, parameters
from netsim.protocols.election import elect
from netsim.protocols.exchange import exchange
from netsim.trace.events import Association, Role
from netsim.units import s_to_ns

REPORT = "report"
DECISION = "decision"
CENTRE = "centre"


@parameters
class CentralMapParameters:
    """Every sensor sends what it measured and knows to a centre, which associates for all and tells each its part.

    A sensor that hears nothing of the centre in time decides alone, as under `independent`.
    """

    type: Literal["central-map"] = "central-map"
    centre: NonNegativeInt | None = None
    """Node id of the centre, a node with a sensor; by default the nodes elect the one that shares targets with most others,
    of equals the one with the lowest id, by flooding."""
    priors: Priors = "once"
    """`once`: a target is described by the first of its covering sensors alone; `every`: by all, so that one report that is
    lost does not take a target with it."""
    election_s: Positive = 2.0
    """Time for the election; none is spent where `centre` is given."""
    gather_s: Positive = 6.0
    """Time for reports; with what has come by then the centre goes on."""
    answer_s: Positive = 6.0
    """Time for computing and for telling the decisions; sensors that are not told in time decide alone. A
    microcontroller without floating-point hardware takes some thousand times as long as one with it. Where sensors measure
    bearings, the evidence of each target is an integral: with it, 10 s for 10 targets, two minutes for 33."""
    attempts: PositiveInt = 3
    """How often a report or a decision is sent that was not acknowledged."""
    payload: FloatWidth = "float64"
    """Precision of measurements and priors on the air."""


class CentralMap:
    """See `CentralMapParameters`."""

    def __init__(self, parameters: CentralMapParameters) -> None:
        self._parameters = parameters

    def run(self, node: NodeHandle) -> Op[None]:
        """See `netsim.api.Algorithm.run`."""
        parameters, knowledge = self._parameters, association_knowledge(node)
        if knowledge is None and node.id == parameters.centre:
            message = f"node {node.id} cannot be the centre: it has no sensor, and does not know how sensors see"
            raise AlgorithmError(message)
        elected_ns = 0 if parameters.centre is not None else s_to_ns(parameters.election_s)
        gathered_ns = elected_ns + s_to_ns(parameters.gather_s)
        end_ns = gathered_ns + s_to_ns(parameters.answer_s)
        if knowledge is not None:
            centre: int | None = parameters.centre
            if centre is None:
                sharing = {sensor for covered in knowledge.targets for sensor in covered.sensors}
                centre = yield from elect(node, len(sharing), elected_ns)
            own_m = yield from self._measured(node, knowledge.model.numbers)
            if centre == node.id:
                decision = yield from self._lead(node, knowledge, own_m, gathered_ns, end_ns)
            else:
                decision = yield from self._follow(node, knowledge, own_m, centre, gathered_ns, end_ns)
            if decision is None:
                decision = (yield from decide_alone(node, knowledge, own_m)).tolist()
            node.record(Association(node.id, decision, 0))
        yield from node.pause_until(end_ns)

    def _measured(self, node: NodeHandle, numbers: int) -> Op[FloatArray]:
        """The measurements as they can be sent: the centre computes with its own at the precision of the others."""
        width = self._parameters.payload
        own_m = yield from measurements(node, numbers)
        return decode_floats(encode_floats(own_m.ravel(), width), width).reshape(own_m.shape)

    def _follow(
        self,
        node: NodeHandle,
        knowledge: AssociationKnowledge,
        own_m: FloatArray,
        centre: int | None,
        gathered_ns: int,
        end_ns: int,
    ) -> Op[list[int] | None]:
        """Report, and wait for the decision; None if none comes that fits.

        A node that was down during the election knows no centre, but the centre may have its report from before.
        """
        parameters = self._parameters
        if centre is not None:
            report = encode_report(knowledge, own_m, parameters.priors, parameters.payload)
            yield from exchange(node, REPORT, report, [centre], gathered_ns, parameters.attempts)
        message = yield from node.receive(kinds={DECISION}, timeout_ns=max(end_ns - node.now_ns, 0))
        decision = None if message is None else decode_decision(message.payload)
        return decision.tolist() if decision is not None and len(decision) == len(own_m) else None

    def _lead(
        self, node: NodeHandle, knowledge: AssociationKnowledge, own_m: FloatArray, gathered_ns: int, end_ns: int
    ) -> Op[list[int] | None]:
        """Take the reports, associate for all, tell each; returns the centre's own part."""
        node.record(Role(node.id, CENTRE, 1))
        parameters = self._parameters
        own = encode_report(knowledge, own_m, parameters.priors, parameters.payload)
        layout = parameters.payload, knowledge.model.numbers
        reports = {node.id: decode_report(own, *layout)}
        while node.now_ns < gathered_ns:
            message = yield from node.receive(kinds={REPORT}, timeout_ns=gathered_ns - node.now_ns)
            if message is not None:
                reports[message.source] = decode_report(message.payload, *layout)
        decisions = yield from self._solved(node, gather(reports, knowledge.model))
        yield from self._tell(node, {to: each for to, each in decisions.items() if to != node.id}, end_ns)
        return decisions.get(node.id)

    def _solved(self, node: NodeHandle, gathered: Gathered) -> Op[Mapping[int, list[int]]]:
        """Each sensor's decision, after the time that computing takes; none where there is no answer or no energy."""
        answer = most_probable(gathered.instance)
        if answer is None:
            node.log("no association explains what was reported: every sensor decides alone")
            return {}
        try:
            yield from node.compute(solving_operations(gathered.instance, answer.variables))
        except NoEnergyError:
            return {}
        nodes = gathered.instance.sensor_nodes
        return {to: gathered.named(each) for to, each in zip(nodes, answer.assignment, strict=True)}

    def _tell(self, node: NodeHandle, decisions: Mapping[int, list[int]], end_ns: int) -> Op[None]:
        """Tell each sensor its decision, one after the other; go round again for those that did not acknowledge."""
        waiting = dict(decisions)
        for _ in range(self._parameters.attempts):
            missed = {}
            for to, decision in waiting.items():
                if node.now_ns >= end_ns:
                    node.log(f"no time to tell {len(waiting)} sensors their decisions: see `answer_s`")
                    return
                delivery = yield from node.send(to, DECISION, encode_decision(decision)).wait()
                if not delivery.acknowledged:
                    missed[to] = decision
            waiting = missed


def most_probable(instance: AssociationInstance) -> ExactAssignment | None:
    """The most probable joint association; None if there is none.

    With `strict` false alarms and reports missing, a sensor may have more measurements than targets that are known of and
    one false alarm: then any number of false alarms is allowed (the factor P_F each of eq 16).
    """
    models: list[SensorModel] = [instance.model]
    if instance.model.false_alarms == "strict":
        models.append(replace(instance.model, false_alarms="geometric"))
    for model in models:
        try:
            return best_assignment(replace(instance, model=model))
        except NetsimError:
            continue
    return None


def solving_operations(instance: AssociationInstance, variables: int) -> int:
    """Estimate of the elementary operations of an exact association.

    First the evidence of joint hypotheses (see `evidence_operations`). The integer programme is one of packing whose
    relaxation is nearly always integral, so one simplex run: in practice about three pivots a
    row (Bertsimas and Tsitsiklis, Introduction to Linear Optimization, 1997, section 3.7), each two operations for every
    nonzero of the matrix. Branching, factorisation and fill-in are not in it.

    Args:
        instance: What is solved.
        variables: Its binary variables, one a joint hypothesis.
    """
    targets = sum(1 for sensors in instance.coverage if sensors)
    rows = targets + sum(len(points) for points in instance.measurements_m) + len(instance.sensor_nodes)
    nonzeros = variables * (
        1 + 2 * _most_covers(instance)
    )  # one target, at most so many measurements and their sensors
    return int(evidence_operations(instance, variables) + 3 * rows * 2 * nonzeros)


def evidence_operations(instance: AssociationInstance, variables: int) -> int:
    """Estimate of the elementary operations of the evidence of joint hypotheses.

    From positions some 20 a measurement of each; from ranges and bearings those of an integral over each target's prior
    (`netsim.kernels.polar_evidence.polar_operations`).
    """
    model = instance.model
    if model.measures == "position":
        return 20 * variables * _most_covers(instance)
    total = 0
    for target, sensors in enumerate(instance.coverage):
        places_m = np.array([instance.sensors_m[sensor] for sensor in sensors])
        counts = [len(instance.measurements_m[sensor]) for sensor in sensors]
        prior = instance.means_m[target], instance.covariances_m2[target]
        total += polar_operations(*prior, places_m, counts, model.measures, model.range_sd_m, model.bearing_sd_rad)
    return total


def _most_covers(instance: AssociationInstance) -> int:
    """How many sensors cover the target that most do."""
    return max((len(sensors) for sensors in instance.coverage), default=0)
