"""Exchanges: everybody hears everybody, by either manner, also through losses; and what each manner costs."""

from collections import Counter

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.protocols.exchange import exchange
from netsim.testing import DROP, ScriptedMedium, rule, run_algorithm
from netsim.trace.events import BROADCAST, AlgorithmRecord, MessageSent

S = 1_000_000_000


class Tell:
    """Tells its number to all others; who is silent only listens."""

    def __init__(self, parameters):
        self._manner, self._silent = parameters

    def run(self, node):
        partners = [other for other in range(5) if other != node.id]
        word = None if node.id in self._silent else bytes([node.id])
        heard = yield from exchange(node, "word", word, partners, S, manner=self._manner)
        assert node.now_ns == S
        assert list(heard.items()) == [(partner, bytes([partner])) for partner in heard]
        node.record(AlgorithmRecord(node.id, "heard", str(sorted(heard))))


def told(manner, silent=(), **more):
    run = run_algorithm(Tell, nodes=5, parameters=(manner, silent), **more).require_success()
    return run, {event.node: event.fields_json for _, event in run.of(AlgorithmRecord)}


EVERYBODY = {node: str([other for other in range(5) if other != node]) for node in range(5)}


@pytest.mark.parametrize("manner", ["unicast", "broadcast"])
@pytest.mark.parametrize("neighbours", [None, nx.path_graph(5).adj, nx.star_graph(4).adj])
def test_everybody_hears_everybody(manner, neighbours):
    assert told(manner, neighbours=neighbours)[1] == EVERYBODY


def test_one_transmission_each_where_all_are_in_reach():
    run, _ = told("broadcast")
    assert Counter((event.kind, event.destination) for _, event in run.of(MessageSent)) == {("word", BROADCAST): 5}
    run, _ = told("unicast")
    assert len(run.of(MessageSent)) == 20


def test_who_was_not_heard_is_asked():
    lossy = ScriptedMedium([rule(DROP, kind="word", source=2, destination=4, counts={0})])
    run, heard = told("broadcast", medium=lossy)
    assert heard == EVERYBODY
    sent = [(event.source, event.destination, event.kind) for _, event in run.of(MessageSent)]
    assert sent[5:] == [(4, 2, "word-request"), (2, 4, "word")]


@given(st.sets(st.tuples(st.integers(0, 4), st.integers(0, 4), st.integers(0, 1)), max_size=12))
@settings(max_examples=60, deadline=None)
def test_with_at_most_two_losses_on_each_way_everybody_hears_everybody(lost):
    """Four attempts' worth of messages: what is lost at first is asked for, and asked for again."""
    rules = [rule(DROP, source=a, destination=b, kind="word", counts={count}) for a, b, count in lost]
    assert told("broadcast", medium=ScriptedMedium(rules))[1] == EVERYBODY


def test_who_stays_silent_is_missing_and_the_call_returns_in_time():
    deaf = ScriptedMedium([rule(DROP, destination=3), rule(DROP, source=3)])
    for manner in ("unicast", "broadcast"):
        _, heard = told(manner, medium=deaf)
        assert heard[3] == "[]"
        assert heard[0] == "[1, 2, 4]"


@pytest.mark.parametrize("manner", ["unicast", "broadcast"])
def test_who_has_nothing_to_tell_hears_the_others(manner):
    run, heard = told(manner, silent=(3,))
    assert heard == {node: str([other for other in range(5) if other not in (node, 3)]) for node in range(5)}
    assert all(event.source != 3 or event.kind != "word" for _, event in run.of(MessageSent))
