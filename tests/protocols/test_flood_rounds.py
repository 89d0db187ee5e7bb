"""A flood in rounds: everybody gets the reports within so many hops and passes on those within one less, whatever the
delays; and what happens when bundles are lost, come twice, or partners are silent.
"""

import json
import struct

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import AlgorithmError
from netsim.protocols.flood_rounds import FloodRounds, FloodSettings, decode_bundle, encode_bundle
from netsim.rng import Streams
from netsim.testing import DROP, ScriptedMedium, delay, duplicate, rule, run_algorithm
from netsim.trace.events import AlgorithmRecord, MessageSent

S = 1_000_000_000
ROUND_S = 40
SILENT = 4
"""It passes on what others tell, and has nothing to tell itself."""
GRAPHS = st.builds(nx.random_geometric_graph, st.integers(1, 10), st.floats(0.1, 0.7), seed=st.integers(0, 2**32 - 1))


def report(node):
    return bytes([node]) * (node % 3)


class Tell:
    """Floods, says what came of it, and answers others until 20 rounds have passed."""

    def __init__(self, parameters):
        self._graph, self._hops, self._mute = parameters

    def run(self, node):
        if node.id in self._mute:
            return
        settings = FloodSettings(self._hops, ROUND_S * S, spread_ns=S)
        own = None if node.id == SILENT else report(node.id)
        flooded = yield from FloodRounds(node, "word", self._graph[node.id], settings).run(own)
        assert all(text == report(source) for source, text in flooded.reports.items())
        said = [sorted(flooded.reports), flooded.passed_on, sorted(flooded.given_up), node.now_ns]
        node.record(AlgorithmRecord(node.id, "flooded", json.dumps(said)))
        yield from node.pause_until(20 * ROUND_S * S)


def flooded(graph, hops, rules=(), mute=(), algorithm=Tell):
    run = run_algorithm(algorithm, nodes=len(graph), parameters=(graph, hops, mute), medium=ScriptedMedium(rules))
    run.require_success()
    return run, {event.node: json.loads(event.fields_json) for _, event in run.of(AlgorithmRecord)}


def balls(graph, hops):
    """Nodes within so many hops that tell something."""
    return {node: sorted(set(nx.single_source_shortest_path_length(graph, node, hops)) - {SILENT}) for node in graph}


def right(graph, hops):
    """Reports and how many are passed on."""
    passed_on = balls(graph, hops - 1) if hops else dict.fromkeys(graph, ())
    return {node: (within, len(passed_on[node])) for node, within in balls(graph, hops).items()}


def told(said):
    return {node: (reports, passed_on) for node, (reports, passed_on, _, _) in said.items()}


def any_delay(seed, most_s):
    """Each message has a delay of its own; some arrive twice."""

    def decide(passage):
        name = f"{passage.source}/{passage.destination}/{passage.kind}/{passage.count}"
        kind, extra = Streams(seed).generator(name).random(2)
        return delay(most_s * extra) if kind < 0.7 else duplicate(most_s * extra)

    return decide


@settings(max_examples=30, deadline=None)
@given(GRAPHS, st.integers(0, 5), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 2.0, 7.5]))
def test_everybody_has_the_ball_of_the_hops_and_passes_on_that_of_one_less(graph, hops, seed, most_s):
    """Five delays, one behind the other, are less than a round. Where they are more than a quarter of it, bundles are asked
    for that are on their way, and come twice.
    """
    run, said = flooded(graph, hops, [any_delay(seed, most_s)])
    assert told(said) == right(graph, hops)
    assert not any(given_up for _, _, given_up, _ in said.values())
    asked = [event for _, event in run.of(MessageSent) if event.kind == "word-request"]
    assert most_s > 2.0 or not asked  # 5 x 2 s do not make a quarter


@settings(max_examples=25, deadline=None)
@given(GRAPHS, st.integers(1, 4), st.sets(st.tuples(st.integers(0, 13), st.integers(0, 13), st.integers(0, 1))))
def test_lost_bundles_are_asked_for(graph, hops, lost):
    """The first two bundles on any way may be lost, and the first request."""
    rules = [rule(DROP, source=a, destination=b, kind="word", counts={count}) for a, b, count in lost]
    rules += [
        rule(DROP, source=a, destination=b, kind="word-request", counts={count}) for a, b, count in lost if not count
    ]
    assert told(flooded(graph, hops, rules)[1]) == right(graph, hops)


def test_a_lost_bundle_is_asked_for_after_a_quarter_of_the_round_and_of_nobody_else():
    run, said = flooded(nx.path_graph(3), 2, [rule(DROP, source=0, kind="word", counts={1})])
    assert told(said) == right(nx.path_graph(3), 2)
    requests = [(event.source, event.destination) for _, event in run.of(MessageSent) if event.kind == "word-request"]
    assert requests == [(1, 0)]
    assert 10 * S < said[1][3] < 12 * S


@pytest.mark.parametrize("dead", [0, 2])
def test_a_silent_partner_is_given_up_after_one_round_and_only_one(dead):
    graph = nx.cycle_graph(6)
    _, said = flooded(graph, 3, mute=[dead])
    alive = nx.Graph(graph)
    alive.remove_node(dead)
    assert {node: reports for node, (reports, _, _, _) in said.items()} == balls(alive, 3)
    partners = set(graph[dead])
    assert {node: given_up for node, (_, _, given_up, _) in said.items()} == {
        node: [dead] if node in partners else [] for node in alive
    }
    assert all(ROUND_S * S <= said[node][3] < (ROUND_S + 5) * S for node in partners)


class ComesLate(Tell):
    """Node 2 begins when its partners have given it up."""

    def run(self, node):
        if node.id == 2:
            yield from node.pause((ROUND_S + 5) * S)
        yield from super().run(node)


def test_who_was_given_up_and_catches_up_is_a_partner_again():
    """Node 1 waits in its second round for node 0, whose bundle and two answers are lost."""
    lost = rule(DROP, source=0, kind="word", counts={1, 2, 3})
    _, said = flooded(nx.path_graph(3), 3, [lost], algorithm=ComesLate)
    assert {node: reports for node, (reports, _, _, _) in said.items()} == balls(nx.path_graph(3), 3)
    assert not any(given_up for _, _, given_up, _ in said.values())


def test_who_comes_when_all_are_through_gets_what_there_is_and_is_not_heard():
    _, said = flooded(nx.path_graph(3), 2, algorithm=ComesLate)
    assert told(said)[2] == right(nx.path_graph(3), 2)[2]
    assert [said[node][0] for node in (0, 1)] == [[0, 1], [0, 1]]
    assert said[1][2] == [2]


class LooksLater(Tell):
    """Says what bundles are in its inbox at the end."""

    def run(self, node):
        yield from super().run(node)
        left = []
        while (message := (yield from node.receive(kinds={"word"}, timeout_ns=0))) is not None:
            left.append(message.source)
        node.record(AlgorithmRecord(node.id, "left", json.dumps(left)))


def test_bundles_that_come_when_a_node_is_through_do_not_stay_in_its_inbox():
    """Every bundle comes again ten rounds later."""
    run, _ = flooded(nx.path_graph(3), 2, [rule(duplicate(10.0 * ROUND_S), kind="word")], algorithm=LooksLater)
    left = [json.loads(event.fields_json) for _, event in run.of(AlgorithmRecord) if event.kind == "left"]
    assert left == [[], [], []]


class LosesAll(Tell):
    """Node 1 loses all it knew in the second round and begins anew."""

    def run(self, node):
        if node.id == 1:
            first = node.spawn(super().run(node))
            yield from node.pause(3 * S)
            first.cancel()
        yield from super().run(node)


def test_who_begins_anew_gets_everything_again():
    slow = rule(delay(5.0), source=3, kind="word", counts={1})  # so that nobody is through when node 1 forgets
    _, said = flooded(nx.path_graph(5), 4, [slow], algorithm=LosesAll)
    assert told(said) == right(nx.path_graph(5), 4)


def test_messages_of_strangers_and_torn_ones_are_ignored():
    class Noise(Tell):
        def run(self, node):
            if node.id == 2:
                for payload in (b"", b"\1", b"\1\7", encode_bundle(1, {7: b"torn"})[:-1]):
                    node.broadcast("word", payload)
                    node.broadcast("word-request", payload)
                return
            if node.id == 3:
                for payload in (b"", b"\1\7", encode_bundle(1, {7: b"torn"})[:-1]):
                    node.send(1, "word", payload)
                node.send(1, "word-request", b"")
                yield from node.pause(2 * S)
            yield from super().run(node)

    graph = nx.Graph([(0, 1), (1, 3)])
    graph.add_node(2)
    _, said = flooded(graph, 2, algorithm=Noise)
    everybody = [0, 1, 3]
    assert {node: reports for node, (reports, _, _, _) in said.items()} == {0: everybody, 1: everybody, 3: everybody}


@given(st.integers(0, 255), st.dictionaries(st.integers(0, 65_535), st.binary(max_size=40), max_size=6))
def test_bundles_come_back_as_they_went(number, reports):
    data = encode_bundle(number, reports)
    assert decode_bundle(data) == (number, reports)
    assert len(data) == 1 + sum(4 + len(each) for each in reports.values())


def test_torn_bundles_are_refused():
    data = encode_bundle(1, {1: b"abc", 2: b"defg"})
    whole = {1, len(data) - 8, len(data)}  # where one report ends
    for size in set(range(len(data))) - whole:
        with pytest.raises((ValueError, struct.error)):
            decode_bundle(data[:size])


def test_a_report_that_is_too_long_is_refused():
    class Long:
        def run(self, node):
            yield from FloodRounds(node, "word", [], FloodSettings(1, S)).run(bytes(65_536))

    with pytest.raises(AlgorithmError, match="a report of 65536 bytes: at most 65535 can be flooded"):
        run_algorithm(Long, nodes=1).require_success()
