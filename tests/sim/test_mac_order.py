"""With every MAC: simultaneous events in any order give the same run, equal seeds the same, another seed another."""

import pytest
from scenarios_for_tests import Shuffled, run, small
from test_order import by_instant, comparable

from netsim.trace.events import Frame

MACS = {
    "aloha": "{type: aloha, acknowledge: true, backoff_s: 0.05}",
    "tdma": "{type: tdma}",
    "x-mac": "{type: lpl}",
    "b-mac": "{type: lpl, variant: b-mac, wake_interval_ms: 60}",
}
SETTINGS = {
    "duration_s": 3,
    "algorithm": '{type: "sim_algorithms:Together"}',
    "battery": "{type: capacity, energy_j: 0.1}",
}


@pytest.fixture(scope="module", params=MACS)
def loaded(request, tmp_path_factory):
    return small(tmp_path_factory.mktemp("order"), mac=MACS[request.param], **SETTINGS)


@pytest.fixture(scope="module")
def reference(loaded):
    return run(loaded)[0]


def test_there_is_something_to_compare(reference):
    assert sum(isinstance(event, Frame) for _, event in reference) > 100


@pytest.mark.parametrize("seed", range(2))
def test_a_shuffle_of_simultaneous_events_changes_nothing(loaded, reference, seed):
    assert by_instant(run(loaded, Shuffled(seed))[0]) == by_instant(reference)


def test_equal_seeds_give_equal_runs(loaded, reference):
    again = run(loaded)[0]
    assert [(time_ns, comparable(event)) for time_ns, event in again] == [
        (time_ns, comparable(event)) for time_ns, event in reference
    ]
