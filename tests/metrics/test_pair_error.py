"""Errors of association probabilities from hand-made events, and that a trace has all that they are computed from."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from netsim.kernels.event_association import EventAssociationInstance, EventModel, PredictedEvent
from netsim.metrics.collect import metrics_of
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import AlgorithmRecord, PairProbabilities, Problem
from netsim.trace.fingerprint import fingerprint
from netsim.trace.reader import read_trace

UNIT = EventModel((1.0, 0.0, 1.0), 4.0, 0.5, 1 / (2 * np.pi))
"""With it a pair weighs exp(-d^2 / 2)."""


def instance(points_m, events_m=((0.0, 0.0), (9.0, 0.0))):
    events = tuple(PredictedEvent(number, 0, *place) for number, place in enumerate(events_m))
    return EventAssociationInstance((0,) * len(points_m), np.array(points_m, float).reshape(-1, 2), events, UNIT)


THREE = instance([(0.0, 0.0), (0.0, 0.0), (50.0, 50.0)])
"""Two measurements at the first event, each of it with probability 1 / 3, and one of nothing."""


def figures(*told, problem=THREE, more=()):
    said = [(5, PairProbabilities(0, j, [k], [p], [low], [high], depth)) for j, k, p, low, high, depth in told]
    return metrics_of([(0, Problem("event-association", problem.to_json())), *said, *more])


ONE = sum(math.comb(12, k) * math.comb(9, k) * math.factorial(k) for k in range(10))
"""Ways in which twelve measurements and nine events in one place can be pairs."""


def test_errors_are_distances_from_the_exact_probabilities():
    found = figures((0, 0, 0.5, 0.3, 0.6, 4), (1, 0, 0.3, 0.3, 0.4, 6))
    assert found["gated_pairs"] == 2
    assert found["gated_pairs_told_share"] == 1.0
    assert found["matchings"] == 3
    assert found["pair_error_linf"] == pytest.approx(1 / 6)
    assert found["pair_error_mean"] == pytest.approx((1 / 6 + 1 / 30) / 2)
    assert found["interval_misses"] == 0
    assert found["interval_width_max"] == pytest.approx(0.3)
    assert found["interval_width_mean"] == pytest.approx(0.2)
    assert (found["decay_depth"], found["decay_depth_mean"]) == (6, 5.0)
    assert found["pair_error_bp_linf"] == pytest.approx(0.0, abs=1e-6)  # a tree


def test_an_interval_beside_the_truth_is_a_miss_and_rounding_is_none():
    third = 1 / 3
    assert figures((0, 0, 0.3, 0.2, third - 1e-12, 2))["interval_misses"] == 0
    assert figures((0, 0, 0.3, 0.2, third - 1e-8, 2), (1, 0, 0.4, third + 1e-8, 0.5, 2))["interval_misses"] == 2


def test_of_a_measurement_stated_twice_the_last_counts():
    found = figures((0, 0, 0.9, 0.0, 1.0, 2), (0, 0, 1 / 3, 0.3, 0.4, 4))
    assert found["pair_error_linf"] == pytest.approx(0.0, abs=1e-12)
    assert found["gated_pairs_told_share"] == 0.5


def test_an_interval_that_rounding_turned_round_has_no_width():
    found = figures((0, 0, 1 / 3, 1 / 3, 1 / 3 - 1e-17 - 5.6e-17, 2))
    assert (found["interval_width_max"], found["interval_width_mean"]) == (0.0, 0.0)
    assert found["interval_misses"] == 0


def test_a_pair_that_is_none_counts_as_an_error_and_not_as_told():
    """As rounded positions may have it."""
    found = figures((0, 1, 0.25, 0.2, 0.3, 2))
    assert found["gated_pairs_told_share"] == 0.0
    assert found["pair_error_linf"] == 0.25
    assert found["interval_misses"] == 1


def test_without_pairs_or_words_there_is_nothing_to_measure():
    nothing = figures()
    assert (nothing["pair_error_linf"], nothing["interval_misses"], nothing["decay_depth"]) == (None, None, None)
    assert nothing["gated_pairs_told_share"] == 0.0
    assert figures(problem=instance([(50.0, 50.0)]))["gated_pairs_told_share"] is None
    assert "gated_pairs" not in metrics_of([(0, Problem("none", "{}"))])


def test_out_of_reach_only_the_errors_are_missing():
    """30 measurements of 21 events, all in one place."""
    found = figures((0, 0, 0.1, 0.0, 0.2, 2), problem=instance([(0.0, 0.0)] * 30, [(0.0, 0.0)] * 21))
    assert found["gated_pairs"] == 630
    assert all(
        found[name] is None for name in ("matchings", "pair_error_linf", "pair_error_bp_linf", "interval_misses")
    )
    assert found["interval_width_max"] == pytest.approx(0.2)


@pytest.mark.parametrize(("places", "right"), [(1, ONE), (4, float(ONE**4)), (36, None)])
def test_large_counts_are_numbers_that_tables_hold(places, right):
    """Twelve measurements and nine events in each place."""
    places_m = [(9.0 * number, 0.0) for number in range(places)]
    points_m, events_m = ([place for place in places_m for _ in range(count)] for count in (12, 9))
    found = figures(problem=instance(points_m, events_m))["matchings"]
    assert found == (None if right is None else pytest.approx(right, rel=1e-15))
    assert type(found) is (int if places == 1 else type(right))


def test_work_is_summed_over_the_nodes():
    fields = dict.fromkeys(("passed_on", "asked", "given_up", "factor_requests", "factors_stood_in"), 2)
    fields |= {"reports": 5, "factor_requests_open": 3, "events": 4, "events_incomplete": 1}
    other = {**fields, "factor_requests_open": 7, "reports": 8}
    more = [
        (9, AlgorithmRecord(node, "correlation_decay", json.dumps(each))) for node, each in enumerate((fields, other))
    ]
    found = figures(more=more)
    assert found["reports_passed_on"] == found["reports_asked_for"] == found["factor_requests"] == 4
    assert found["reports_heard_mean"] == 6.5
    assert found["factor_requests_open"] == 7
    assert found["events_incomplete_share"] == 0.25


SMALL = [
    "duration_s=40",
    "field={width_m: 60, height_m: 40}",
    "nodes.0.placement.count=12",
    "medium={type: ideal, delay_s: 0.001}",
    "mac={type: ideal}",
    "network={type: one-hop}",
    "fidelity=null",
    "problem.events.count=5",
    "problem.measurements.count=15",
    "algorithm={type: correlation-decay, depth: 4, estimator: literal, factors: requests, until_s: 30,"
    " flood: {graph: overlay, hops: 2}}",
]


def test_a_trace_has_everything(scenarios: Path, tmp_path: Path):
    result = run(load(scenarios / "oh2010" / "network.yaml", SMALL), folder=tmp_path)
    assert not result.failures
    again = metrics_of(read_trace(tmp_path / "trace.mcap"))
    names = [
        name for name in result.metrics if name.startswith(("pair", "interval", "decay", "gated", "factor", "report"))
    ]
    assert len(names) > 12
    assert {name: again[name] for name in names} == {name: result.metrics[name] for name in names}
    assert result.metrics["interval_misses"] == 0
    assert result.metrics["factor_requests"] > 0


@pytest.mark.slow
def test_a_trace_is_the_same_in_every_process(scenarios: Path, tmp_path: Path):
    """Whatever the order in which sets of words are walked through there."""
    arguments = [argument for each in SMALL for argument in ("--set", each)]
    scenario, prints = scenarios / "oh2010" / "network.yaml", set()
    for seed in ("1", "77"):
        command = [sys.executable, "-m", "netsim", "run", scenario, *arguments, "--out", tmp_path / seed]
        subprocess.run(command, check=True, capture_output=True, env={**os.environ, "PYTHONHASHSEED": seed})
        prints.add(fingerprint(tmp_path / seed / "trace.mcap"))
    assert len(prints) == 1
