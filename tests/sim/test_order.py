"""Nothing rests on the order in which simultaneous events are handled; equal seeds give equal runs."""

from collections import Counter
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from scenarios_for_tests import ROOT, Shuffled, run, small

from netsim.rng import Streams
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.trace.events import OUTCOMES, Frame, MessageSent, NodeLife, NodeTable, RadioState

TOGETHER = {"mac": "{type: csma, min_be: 2}", "algorithm": '{type: "sim_algorithms:Together"}'}
IDS = {"frame_id", "message_id", "causes"}


def plain(value):
    """Something that compares with ==."""
    return (
        tuple(value.tolist()) if isinstance(value, np.ndarray) else tuple(value) if isinstance(value, list) else value
    )


def comparable(event, but=frozenset()):
    """A record as a tuple, without some of its fields."""
    names = [name for name in type(event).__slots__ if name not in but]
    return (type(event).__name__, *(plain(getattr(event, name)) for name in names))


def by_instant(events):
    """The log with the events of each instant sorted: what a run is, up to the order of simultaneous events.

    Numbers of frames and messages are given in the order of handling, so they are left out; radio states that last no
    time depend on what is handled first, so only the last of each node and instant counts.
    """
    log = []
    for time_ns, group in groupby(events, key=lambda entry: entry[0]):
        last, rest = {}, []
        for _, event in group:
            if isinstance(event, RadioState):
                last[event.node] = event.state
            else:
                rest.append(repr(comparable(event, IDS)))
        log.append((time_ns, sorted(last.items()), sorted(rest)))
    return log


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    battery = "{type: capacity, energy_j: 0.0225}"  # for 400 ms: the nodes die while they speak
    return small(tmp_path_factory.mktemp("order"), battery=battery, **TOGETHER)


@pytest.fixture(scope="module")
def reference(loaded):
    return run(loaded)[0]


def test_the_small_scenario_is_busy_enough_to_tell_anything(reference):
    outcomes, starts = Counter(), Counter()
    for _, event in reference:
        if isinstance(event, Frame):
            starts[event.t_start_ns] += 1
            outcomes.update(OUTCOMES[code] for code in event.rx_outcome)
    assert min(outcomes[name] for name in ("received", "overheard", "collided", "half_duplex", "busy", "asleep")) > 4
    assert sum(count > 1 for count in starts.values()) > 4
    assert sum(isinstance(event, NodeLife) and event.event == "died" for _, event in reference) == 9


@pytest.mark.parametrize("seed", range(20))
def test_a_shuffle_of_simultaneous_events_changes_nothing(loaded, reference, seed):
    assert by_instant(run(loaded, Shuffled(seed))[0]) == by_instant(reference)


def test_equal_seeds_give_equal_runs(loaded, reference):
    again = run(loaded)[0]
    assert [(time_ns, comparable(event)) for time_ns, event in again] == [
        (time_ns, comparable(event)) for time_ns, event in reference
    ]


def test_another_seed_gives_another_run(tmp_path, reference):
    other = run(small(tmp_path, seed=2, **TOGETHER))[0]
    assert by_instant(other) != by_instant(reference)


def test_the_quickstart_repeats():
    runs = [run(load(ROOT / "scenarios" / "quickstart.yaml"))[0] for _ in range(2)]
    assert [repr(comparable(event)) for _, event in runs[0]] == [repr(comparable(event)) for _, event in runs[1]]


SINK = """
  - name: sinks
    role: sink
    placement: {type: grid, rows: 1, columns: 1, spacing_m: 1, origin_m: [50, 50]}
"""


def test_streams_do_not_depend_on_each_other():
    first, second = Streams(1), Streams(1)
    second.generator("node/99/backoff").random(1000)
    for name in ("node/0/backoff", "node/0/reception", "placement"):
        assert first.generator(name).random(5).tolist() == second.generator(name).random(5).tolist()
    assert first.generator("a").random() != first.generator("b").random()
    assert Streams(1, 1).generator("a").random() != first.generator("a").random()


def test_another_group_moves_no_position_no_shadowing_and_no_draw(tmp_path):
    """The links among the nine stay what they were; so do their phases."""
    without, with_sink = (build(small(tmp_path, more=more)).simulation.nodes for more in ("", SINK))
    assert set(with_sink) - set(without) == {9}
    for node in range(9):
        assert without[node].identity.position_m == with_sink[node].identity.position_m
        others = [link for link in with_sink[node].identity.neighbours if link.id != 9]
        assert list(without[node].identity.neighbours) == others
    logs = [run(small(tmp_path, more=more))[0] for more in ("", SINK)]
    tables = [event for log in logs for _, event in log if isinstance(event, NodeTable)]
    assert [len(table.node) for table in tables] == [9, 10]
    firsts = [
        {event.source: time_ns for time_ns, event in reversed(log) if isinstance(event, MessageSent)} for log in logs
    ]
    assert {node: firsts[1][node] for node in range(9)} == firsts[0]


def test_frames_under_way_when_the_last_algorithm_ends_still_arrive(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text(
        "kind: scenario\nschema_version: 1\nname: last\nnodes:\n  - name: n\n"
        "    placement: {type: grid, rows: 1, columns: 2, spacing_m: 5}\n"
        "medium: {type: ideal, delay_s: 0.01}\nmac: {type: ideal}\n"
        "algorithm: {type: neighbour-traffic, rounds: 1, period_s: 1e-3}\n"
    )
    events, _ = run(load(path))
    delivered = [event for _, event in events if type(event).__name__ == "MessageDelivered"]
    assert len(delivered) == 2


def test_radios_of_two_physical_layers_cannot_share_a_medium(tmp_path):
    import netsim.models.device_tables as tables
    from netsim.errors import ScenarioError

    source = tables.__file__.replace("device_tables.py", "data/radios/cc2420.yaml")
    (tmp_path / "slow.yaml").write_text(Path(source).read_text().replace("value: 250000", "value: 125000"))
    group = "  - name: {0}\n    radio: {1}\n    placement: {{type: grid, rows: 1, columns: 2, spacing_m: 5}}\n"
    path = tmp_path / "s.yaml"
    path.write_text(
        "kind: scenario\nschema_version: 1\nname: mixed\nalgorithm: {type: neighbour-traffic}\nnodes:\n"
        + group.format("a", "cc2420")
        + group.format("b", "slow.yaml")
    )
    with pytest.raises(ScenarioError, match=r"nodes\[1\].radio: expected a radio with the physical layer of CC2420"):
        build(load(path))
