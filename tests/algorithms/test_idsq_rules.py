"""Rules of the tracker that cost messages or weigh joules: all neighbours sense, and hand-offs that are priced."""

import struct

import numpy as np
import pytest
from idsq_rig import RADIO, SAMPLE_NS, Run, S, world

from netsim.algorithms.idsq_all import decode_query, encode_query
from netsim.algorithms.idsq_payload import BeliefCoder
from netsim.kernels.fusion import fused
from netsim.kernels.grid_belief import uniform
from netsim.kernels.handoff_cost import HandoffCost
from netsim.kernels.idsq import Filter
from netsim.kernels.information import information_bit
from netsim.trace.events import Belief, Handoff, LinkTable, MessageDelivered, MessageSent

STEP_NS = S // 2


def test_all_is_the_product_of_all_neighbours_likelihoods_to_the_bit(tmp_path):
    """Each neighbour reads when the query has reached it, a little after the leader: the target moves on meanwhile."""
    run = Run(world(tmp_path, "selection: all, payload: float64", duration_s=6))
    beliefs = [event for _, event in run.of(Belief)][1:]
    filtering, belief = Filter(7.5, 2e-5), uniform(run.problem.grid)
    coder = BeliefCoder(run.problem.grid, "float64")
    assert len(beliefs) == 11
    for event in beliefs:
        knowledge = run.problem.knowledge(event.node)
        asked = knowledge.neighbours(knowledge.sensor.position_m)
        heard_ns = {query.node: at_ns for at_ns, query in run.of(MessageDelivered) if _is_query(at_ns, query, event)}
        readings = {node: float(np.float32(_reading(run, node, heard_ns[node]))) for node in asked}
        readings[event.node] = _reading(run, event.node, event.step * STEP_NS)
        sensors = {**knowledge.others, event.node: knowledge.sensor}
        belief = fused(filtering.predicted(belief, 1), sensors, readings, filtering.least_probability)
        np.testing.assert_array_equal(event.cell, belief.cells)
        np.testing.assert_array_equal(event.probability, belief.probability)
        belief = coder.decode(coder.encode(belief).data)  # the next leader scales it anew


def _is_query(time_ns, query, belief):
    return (query.kind, query.source, time_ns // STEP_NS) == ("query", belief.node, belief.step)


def _reading(run, node, begun_ns):
    return float(run.problem.observe(node, begun_ns + SAMPLE_NS)[0])


def test_only_those_asked_answer_the_leader(tmp_path):
    run = Run(world(tmp_path, "selection: all", duration_s=5))
    leaders = {event.step: event.node for _, event in run.of(Belief)}
    readings = [(time_ns, event) for time_ns, event in run.of(MessageSent) if event.kind == "reading"]
    assert readings
    for time_ns, event in readings:
        leader = leaders[time_ns // STEP_NS]
        knowledge = run.problem.knowledge(leader)
        assert event.destination == leader
        assert event.source in knowledge.neighbours(knowledge.sensor.position_m)


def test_a_neighbour_that_is_dead_is_waited_for_and_left_out(tmp_path):
    faults = "faults:\n  - {type: crash, nodes: [1, 2, 7, 8, 9, 14], at_s: 0.1}"
    run = Run(world(tmp_path, "selection: all, robust: true", duration_s=6, more=faults))
    assert len({event.step for _, event in run.of(Belief)}) >= 10
    assert run.errors_m(from_s=4.0)


@pytest.mark.parametrize("rule", ["information_less_cost", "information_per_joule"])
def test_utilities_weigh_bits_against_the_joules_of_the_link(tmp_path, rule):
    """By the links' reception ratios, as the trace has them, and the payload of the hand-off; all batteries are full."""
    run = Run(world(tmp_path, f"selection: {rule}, payload: float64", medium=RADIO, mac="{type: csma}", duration_s=4))
    ((_, links),) = run.of(LinkTable)
    pairs = zip(map(int, links.source), map(int, links.destination), strict=True)
    prr = dict(zip(pairs, map(float, links.prr), strict=True))
    beliefs = {event.step: event for _, event in run.of(Belief)}
    assert run.of(Handoff)
    for _, event in run.of(Handoff):
        predicted = Filter(7.5, 2e-5).predicted(_belief(run, beliefs[event.step]), 1)
        for node, utility in zip(event.candidate, event.utility, strict=True):
            bits = information_bit(predicted, run.problem.sensors[node])
            joules = HandoffCost(3.5e-6).joules(event.payload_byte, prr.get((event.node, node), 0.0))
            expected = bits / joules if rule == "information_per_joule" else bits - 100.0 * joules
            assert utility == pytest.approx(expected, rel=1e-5)


def _belief(run, event):
    start = uniform(run.problem.grid)
    return type(start)(run.problem.grid, np.asarray(event.cell, dtype=np.int64), np.asarray(event.probability))


def test_a_query_survives_the_air():
    assert decode_query(encode_query(70_000, (3, 600))) == (70_000 % 65_536, (3, 600))
    for data in (b"", b"\x01", b"\x01\x00\x05"):
        with pytest.raises(struct.error):
            decode_query(data)
