"""Readings travel to the sink; every node ends at its time and says what became of them."""

import itertools
import json

import networkx as nx
import pytest

from netsim.algorithms.collect_readings import CollectReadings, CollectReadingsParameters
from netsim.codec import decode_floats
from netsim.errors import AlgorithmError
from netsim.testing import DROP, ScriptedMedium, rule, run_algorithm
from netsim.trace.events import AlgorithmRecord, MessageSent

SETTINGS = CollectReadingsParameters(start_s=1, period_s=2, rounds=3, drain_s=1, padding_byte=4)


def collect(**more):
    settings = {
        "nodes": 4,
        "neighbours": nx.path_graph(4).adj,
        "observe": lambda node: [float(node), 0.5],
        "parameters": SETTINGS,
        "sinks": (0,),
    }
    return run_algorithm(CollectReadings, **settings | more)


def records(run):
    return {event.node: json.loads(event.fields_json) for _, event in run.of(AlgorithmRecord)}


def test_each_reading_arrives_with_what_the_sensor_gave():
    run = collect().require_success()
    assert records(run) == {0: {"count": 9, "sources": 3}} | {key: {"count": 3, "refused": 0} for key in (1, 2, 3)}
    for message in run.delivered[0]:
        assert decode_floats(message.payload[:8], "float32").tolist() == [float(message.source), 0.5]
        assert len(message.payload) == 12
    assert run.end_ns == 8_000_000_000


def test_one_reading_a_period_at_the_nodes_own_phase():
    run = collect().require_success()
    for node in (1, 2, 3):
        times = [time_ns for time_ns, event in run.of(MessageSent) if event.source == node]
        assert [b - a for a, b in itertools.pairwise(times)] == [2_000_000_000] * 2
        assert 1_000_000_000 <= times[0] < 3_001_000_001


def test_refused_readings_are_counted():
    run = collect(medium=ScriptedMedium([rule(DROP, source=3)])).require_success()
    assert records(run)[3] == {"count": 3, "refused": 3}
    assert records(run)[0] == {"count": 6, "sources": 2}


def test_without_a_sink_it_is_told():
    with pytest.raises(AlgorithmError, match="sink"):
        collect(sinks=()).require_success()
