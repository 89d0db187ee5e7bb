"""Requests for factors between two and three nodes: who answers, who waits, and who stands in for whom."""

import json

import numpy as np
import pytest

from netsim.algorithms.decay_factors import FACTORS, Factors, NamedGraph
from netsim.algorithms.decay_payload import FactorRequest, VertexName, decode_request, encode_request
from netsim.kernels.correlation_decay import Chain, DecayGraph
from netsim.testing import DROP, ScriptedMedium, delay, rule, run_algorithm
from netsim.trace.events import AlgorithmRecord, MessageSent

S = 1_000_000_000
WEIGHTS = np.array([[1.0, 2.0], [3.0, 0.5]])
NAMES = {VertexName(False, 0, 0): 0, VertexName(False, 1, 0): 1, VertexName(True, 2, 0): 2, VertexName(True, 0, 1): 3}
"""Measurements of nodes 0 and 1, events of nodes 2 and 0."""
WHOLE = tuple(NAMES)
RIGHT = float(DecayGraph(WEIGHTS).chain(Chain((0, 1, 2, 3)), 3))


class Owner:
    """Serves from the start, knows the graph after a while, and does what a test has for it; ends after 100 s."""

    def __init__(self, parameters):
        self._plans, self._knows_at_s = parameters

    def run(self, node):
        others = {0, 1, 2} - {node.id}
        factors, named = Factors(node, others, S, 3), NamedGraph(DecayGraph(WEIGHTS), NAMES)
        node.spawn(self._serve(node, factors))
        yield from node.pause_until(self._knows_at_s.get(node.id, 0) * S)
        factors.begin(named)
        for at_s, removed, vertices in self._plans.get(node.id, ()):
            yield from node.pause_until(at_s * S)
            product = yield from factors.product(named, removed, vertices, 3)
            fields = [float(product), node.now_ns / S, factors.stood_in, factors.requests]
            node.record(AlgorithmRecord(node.id, "product", json.dumps(fields)))
        yield from node.pause_until(100 * S)

    def _serve(self, node, factors):
        while True:
            message = yield from node.receive(kinds={FACTORS})
            factors.serve(message)


def products(plans, rules=(), knows_at_s=()):
    run = run_algorithm(Owner, nodes=3, parameters=(plans, dict(knows_at_s)), medium=ScriptedMedium(rules))
    run.require_success()
    return run, [(event.node, *json.loads(event.fields_json)) for _, event in run.of(AlgorithmRecord)]


def sent(run):
    return [(event.source, event.destination, event.kind) for _, event in run.of(MessageSent)]


def test_a_chain_goes_from_owner_to_owner_and_its_product_comes_back():
    run, [(_, product, _, stood_in, requests)] = products({0: [(0, (), WHOLE)]})
    assert product == pytest.approx(RIGHT, rel=1e-14)
    assert (stood_in, requests) == (0, 1)
    there = [(0, 1, "factors"), (1, 2, "factors"), (2, 0, "factors")]
    back = [(0, 2, "product"), (2, 1, "product"), (1, 0, "product")]
    assert sent(run) == there + back


def test_the_list_and_all_that_is_removed_travel_whole():
    asked = []

    def look(passage):
        if passage.kind == FACTORS:
            asked.append(decode_request(passage.payload))

    products({0: [(0, (WHOLE[3],), WHOLE[:3])]}, [look])
    assert [(each.removed, each.vertices, each.depth) for each in asked] == [
        ((WHOLE[3], WHOLE[0]), WHOLE[1:3], 3),
        ((WHOLE[3], WHOLE[0], WHOLE[1]), WHOLE[2:3], 3),
    ]


def test_two_who_ask_each_other_do_not_wait_for_ever():
    plans = {0: [(0, (), WHOLE)], 1: [(0, (), (WHOLE[1], WHOLE[0], WHOLE[2], WHOLE[3]))]}
    _, found = products(plans)
    other = float(DecayGraph(WEIGHTS).chain(Chain((1, 0, 2, 3)), 3))
    assert {node: product for node, product, *_ in found} == pytest.approx({0: RIGHT, 1: other})


def test_a_silent_owner_is_stood_in_for_until_it_is_heard_of():
    """Node 2 hears nothing for ten seconds; at the twelfth it asks node 0 for something."""
    mine = (WHOLE[0], WHOLE[2])
    plans = {0: [(0, (), mine), (5, (), mine), (13, (), mine)], 2: [(12, (), (WHOLE[3],))]}
    run, found = products(plans, [rule(DROP, destination=2, until_s=10.0)])
    right = float(DecayGraph(WEIGHTS).chain(Chain((0, 2)), 3))
    of_0 = [each[1:] for each in found if each[0] == 0]
    assert [product for product, *_ in of_0] == pytest.approx([right] * 3)
    assert [time_s for _, time_s, *_ in of_0] == pytest.approx([3.0, 5.0, 13.0], abs=0.1)
    assert [tuple(each[2:]) for each in of_0] == [(1, 1), (2, 1), (2, 2)]
    assert sent(run).count((0, 2, "factors")) == 3 + 1


def test_who_is_not_ready_says_so_and_answers_when_it_is():
    run, [(_, product, time_s, stood_in, _)] = products({0: [(0, (), WHOLE)]}, knows_at_s=[(1, 20)])
    assert product == pytest.approx(RIGHT, rel=1e-14)
    assert 20.0 < time_s < 20.1
    assert stood_in == 0
    assert sent(run).count((1, 0, "working")) == sent(run).count((0, 1, "factors")) == 20


def test_who_waits_for_others_shows_life_before_it_is_given_up():
    """Node 1 gets the third and last request of node 0; that of its own to node 2 takes ten seconds."""
    rules = [
        rule(DROP, source=0, destination=1, kind="factors", counts={0, 1}),
        rule(delay(10.0), source=2, kind="product"),
    ]
    run, [(_, product, _, stood_in, _)] = products({0: [(0, (), WHOLE)]}, rules)
    assert product == pytest.approx(RIGHT, rel=1e-14)
    assert stood_in == 0
    assert (1, 0, "working") in sent(run)


def test_vertices_of_which_a_node_knows_nothing_have_the_factor_one():
    stranger = VertexName(True, 0, 99)
    _, [(_, product, *_)] = products({0: [(0, (stranger,), (WHOLE[0], stranger))]})
    assert product == pytest.approx(DecayGraph(WEIGHTS).factor(0, 3), rel=1e-14)


def test_owners_that_do_not_exist_are_not_asked():
    stranger = VertexName(False, 77, 0)
    run, [(_, product, _, stood_in, requests)] = products({0: [(0, (), (stranger, WHOLE[0]))]})
    assert product == pytest.approx(DecayGraph(WEIGHTS).factor(0, 3), rel=1e-14)
    assert (stood_in, requests, sent(run)) == (1, 0, [])


def test_torn_requests_and_answers_are_ignored():
    class Torn(Owner):
        def run(self, node):
            if node.id:
                whole = encode_request(FactorRequest(1, 3, (), WHOLE[:1]))
                for size in range(len(whole)):
                    node.send(0, FACTORS, whole[:size])
                for kind in ("product", "working"):
                    node.send(0, kind, b"\1\2")
            yield from super().run(node)

    parameters = ({0: [(0, (), WHOLE[:2])]}, {})
    run = run_algorithm(Torn, nodes=3, parameters=parameters).require_success()
    assert len(run.of(AlgorithmRecord)) == 1
    assert not [each for each in sent(run) if each[0] == 0 and each[2] != "factors"]
