"""Electing one node by flooding."""

from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import AlgorithmError
from netsim.protocols.election import ELECTION, elect
from netsim.testing import run_algorithm
from netsim.trace.events import AlgorithmRecord
from netsim.units import s_to_ns


class Elector:
    """Elects, and notes whom."""

    def __init__(self, scores):
        self._scores = scores

    def run(self, node):
        winner = yield from elect(node, self._scores[node.id], s_to_ns(2.0))
        node.record(AlgorithmRecord(node.id, "elected", f'{{"winner": {winner}}}'))


def elected(run):
    return {event.fields_json for _, event in run.of(AlgorithmRecord)}


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(0, 12), min_size=1, max_size=7))
def test_all_agree_on_the_best_of_equals_the_lowest_id(scores):
    run = run_algorithm(lambda: Elector(scores), nodes=range(len(scores))).require_success()
    assert elected(run) == {f'{{"winner": {scores.index(max(scores))}}}'}


def test_most_keep_silent():
    scores = [3, 3, 4, 9, 2, 1, 0, 3, 5, 4]
    run = run_algorithm(lambda: Elector(scores), nodes=range(10)).require_success()
    floods = {message.source for messages in run.delivered.values() for message in messages if message.kind == ELECTION}
    assert 3 in floods
    assert len(floods) <= 3


def test_a_score_out_of_range_is_refused():
    run = run_algorithm(lambda: Elector([-1]), nodes=[0])
    assert isinstance(run.failures[0], AlgorithmError)


def test_who_comes_after_the_election_elects_nobody():
    class Late(Elector):
        def run(self, node):
            if node.id == 2:
                yield from node.pause_until(s_to_ns(2.0))
            yield from super().run(node)

    run = run_algorithm(lambda: Late([1, 5, 9]), nodes=3).require_success()
    assert elected(run) == {'{"winner": 1}', '{"winner": None}'}
