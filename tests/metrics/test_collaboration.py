"""Figures of collaboration groups, from streams of events by hand."""

import json

import pytest

from netsim.metrics.collaboration import Collaboration
from netsim.trace.events import (
    AlgorithmRecord,
    EnergyLedger,
    Estimate,
    MessageSent,
    NodeLife,
    NodeTable,
    Problem,
    Role,
    TruthTargets,
)
from netsim.units import s_to_ns

NODES = NodeTable(
    [0, 1, 2], ["n0", "n1", "n2"], ["s"] * 3, ["sensor"] * 3, [0, 3, 30], [0, 4, 40], [""] * 3, [""] * 3, [1.0] * 3
)
END = EnergyLedger([], [], [], [], [], [])


def problem(kind="energy-tracking"):
    return Problem(kind, json.dumps({"reading_s": 2.0}))


def figures_of(*rows, kind="energy-tracking"):
    reducer = Collaboration()
    handlers = reducer.handlers()
    for time_s, event in ((0.0, problem(kind)), (0.0, NODES), *rows):
        handlers[type(event)](event, s_to_ns(time_s))
    return reducer.figures()


def estimate(track, x_m, node=0):
    return Estimate(node, track, x_m, 0.0, [])


def sends(source, destination, kind="reading"):
    return MessageSent(1, source, destination, kind, 8, 1, [])


def leads(node, track, holds=1):
    return Role(node, f"leader {track}", holds)


def test_other_problems_have_no_such_figures():
    assert figures_of((1.0, estimate(0, 5.0)), kind="tracking") == {}
    assert figures_of((1.0, sends(1, 0))) == {}, "nor runs without estimates"


def test_reports_are_measured_from_member_to_leader():
    figures = figures_of((0.5, sends(1, 0)), (0.6, sends(2, 0)), (0.7, sends(2, 0, "call")), (1.0, estimate(0, 5.0)))
    assert (figures["group_reports"], figures["report_distance_sum_m"], figures["report_distance_mean_m"]) == (
        2,
        55.0,
        27.5,
    )


def test_errors_are_of_the_reading_and_of_the_best_assignment():
    """Targets at 0 and 10 move on to 8 and 20 while readings are collected; the tracks' numbers do not matter."""
    figures = figures_of(
        (0.0, TruthTargets([0, 1], [0.0, 10.0], [0.0, 0.0])),
        (1.0, estimate(0, 12.0)),
        (1.2, estimate(1, 1.0)),
        (2.0, TruthTargets([0, 1], [8.0, 20.0], [0.0, 0.0])),
        (3.0, estimate(0, 20.0)),
        (3.0, estimate(1, 11.0)),
    )
    assert figures["reading_error_mean_m"] == pytest.approx((2 + 1 + 0 + 3) / 4)


def test_errors_are_squared_in_terms_of_what_was_told():
    told = Estimate(0, 0, 3.0, 4.0, [9.0, 0.0, 4.0])
    figures = figures_of((0.0, TruthTargets([0], [0.0], [0.0])), (1.0, told), (3.0, estimate(0, 1.0)))
    assert figures["reading_nees_mean"] == pytest.approx(3.0**2 / 9.0 + 4.0**2 / 4.0)
    assert figures_of((0.0, TruthTargets([0], [0.0], [0.0])), (3.0, estimate(0, 1.0)))["reading_nees_mean"] is None


def test_without_targets_there_are_no_errors():
    assert figures_of((0.0, TruthTargets([], [], [])), (1.0, estimate(0, 1.0)))["reading_error_mean_m"] is None


def test_switches_and_the_share_of_joint_readings():
    record = lambda kind: AlgorithmRecord(0, kind, "{}")  # noqa: E731
    rows = [(2.0 * step + 1.0, estimate(0, 0.0)) for step in range(4)]
    changes = [
        (1.5, record("merge")),
        (3.0, record("joint")),
        (3.1, record("joint")),
        (3.2, record("split")),
        (3.3, record("other")),
    ]
    figures = figures_of(*sorted([*rows, *changes], key=lambda row: row[0]))
    assert (figures["group_merges"], figures["group_splits"], figures["joint_readings_share"]) == (1, 1, 0.25)


def test_leaders_of_a_track_at_once():
    figures = figures_of(
        (0.0, leads(0, 7)),
        (0.0, leads(2, 8)),
        (1.0, estimate(7, 0.0)),
        (2.0, leads(1, 7)),
        (2.5, leads(0, 7, 0)),
        (3.0, leads(2, 7)),
        (4.0, NodeLife(2, "crashed", "")),
        (5.0, leads(0, 7)),
        (6.5, END),
    )
    assert figures["track_leader_changes"] == 3
    assert figures["track_two_leaders_s"] == pytest.approx(0.5 + 1.0 + 1.5)
    assert figures["track_two_leaders_longest_s"] == pytest.approx(1.5)


def test_a_track_without_a_leader_until_somebody_takes_it_over():
    """From 2 to 4.5 s after a death, not after its end at 6 s; one that is handed over at an instant has no gap."""
    figures = figures_of(
        (0.0, leads(0, 7)),
        (0.0, leads(2, 8)),
        (1.0, estimate(7, 0.0)),
        (2.0, NodeLife(0, "died", "")),
        (3.0, leads(2, 8, 0)),
        (3.0, leads(1, 8)),
        (4.5, leads(1, 7)),
        (6.0, leads(1, 7, 0)),
        (9.0, END),
    )
    assert figures["track_without_leader_s"] == figures["track_without_leader_longest_s"] == pytest.approx(2.5)
    assert figures["track_two_leaders_s"] == 0.0
