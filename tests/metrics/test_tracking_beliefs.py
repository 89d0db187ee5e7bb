"""Beliefs, hand-offs and errors without a cut-off, from streams of events by hand and from the shipped tracker."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from netsim.kernels.grid_belief import uniform
from netsim.metrics.collect import metrics_of
from netsim.metrics.tracking_beliefs import belief_of
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import Belief, Estimate, Event, Handoff, Problem, TruthTargets
from netsim.trace.reader import read_trace
from netsim.units import s_to_ns

TARGET = TruthTargets([0], [0.0], [0.0])


def figures_of(*rows: tuple[float, Event]) -> dict[str, object]:
    """All metrics of some events, times in seconds."""
    return metrics_of((s_to_ns(time_s), event) for time_s, event in rows)


def belief(track: int, step: int, cells: Sequence[int], probability: Sequence[float]) -> Belief:
    """On a grid of 5 m cells, 10 a row, from (-25, -25) m."""
    return Belief(0, track, step, -25.0, -25.0, 5.0, 10, cells, probability)


def handoff(candidates: Sequence[int], form: str, payload_byte: int, divergence_bit: float) -> Handoff:
    return Handoff(1, 0, 4, candidates[0], candidates, [0.0] * len(candidates), form, payload_byte, divergence_bit)


def test_errors_are_those_of_all_estimates_however_far() -> None:
    figures = figures_of(
        (0.0, TARGET),
        (0.0, Estimate(3, 0, 300.0, 400.0, [])),
        (0.5, Estimate(4, 0, 3.0, 4.0, [])),
        (1.0, Estimate(5, 0, 0.0, 7.0, [])),
        (1.0, Estimate(6, 1, 10.0, 0.0, [])),  # the first of another track
        (1.5, Estimate(7, 0, math.nan, 0.0, [])),
    )
    assert figures["estimate_error_mean_m"] == pytest.approx((500 + 5 + 7 + 10) / 4)
    assert figures["estimate_error_mean_after_start_m"] == pytest.approx((5 + 7) / 2)
    assert figures["estimate_error_max_m"] == 500.0
    assert figures["estimates_lost_share"] == pytest.approx(2 / 4)  # 10 m is at the cut-off


def test_the_nearest_target_counts_and_none_after_all_have_left() -> None:
    figures = figures_of(
        (0.0, TruthTargets([0, 1], [0.0, 100.0], [0.0, 0.0])),
        (1.0, Estimate(3, 0, 98.0, 0.0, [])),
        (2.0, TruthTargets([], [], [])),
        (3.0, Estimate(3, 0, 500.0, 0.0, [])),
    )
    assert figures["estimate_error_mean_m"] == 2.0
    assert figures["estimate_error_mean_after_start_m"] is None


def test_a_tracking_problem_says_where_a_track_is_lost() -> None:
    rows = ((0.0, TARGET), (1.0, Estimate(3, 0, 30.0, 0.0, [])))
    problem = 0.0, Problem("tracking", json.dumps({"cut_off_m": 50.0}))
    other = 0.0, Problem("none", json.dumps({"cut_off_m": 50.0}))
    for figures in (figures_of(*rows), figures_of(other, *rows)):
        assert (figures["estimates_unassigned"], figures["estimates_lost_share"]) == (1, 1.0)
        assert figures["ospa_mean_m"] == 10.0
    figures = figures_of(problem, *rows)
    assert (figures["estimates_unassigned"], figures["estimates_lost_share"]) == (0, 0.0)
    assert figures["position_error_mean_m"] == figures["ospa_mean_m"] == 30.0


def test_the_spread_of_beliefs_by_hand() -> None:
    """Two cells 5 m apart: 6.25 m2; three in a row at 1/4, 1/2, 1/4: 12.5 m2."""
    figures = figures_of(
        (0.0, belief(0, 0, [11, 12], [0.5, 0.5])),
        (0.5, belief(0, 1, [10, 20, 30], [0.25, 0.5, 0.25])),
        (1.0, belief(0, 2, [99], [1.0])),
    )
    assert figures["beliefs"] == 3
    assert figures["belief_variance_mean_m2"] == pytest.approx((6.25 + 12.5 + 0.0) / 3)
    assert figures["belief_variance_mean_after_start_m2"] == pytest.approx((12.5 + 0.0) / 2)
    assert figures["belief_cells_mean"] == 2.0
    assert figures["belief_cells_mean_after_start"] == 2.0


def test_a_belief_is_judged_at_its_reading_and_has_an_age() -> None:
    """The target goes east at 10 m/s from (-22.5, -22.5) m; the belief of step 2 says where it was then, 0.4 s later."""
    rows = (
        (0.0, TruthTargets([0], [-22.5], [-22.5])),
        (0.1, belief(0, 0, [99], [1.0])),
        (1.4, belief(0, 2, [2], [1.0])),
        (2.0, TruthTargets([0], [-2.5], [-22.5])),
    )
    figures = figures_of((0.0, Problem("tracking", json.dumps({"reading_s": 0.5}))), *rows)
    assert figures["belief_error_mean_after_start_m"] == pytest.approx(0.0, abs=1e-9)
    assert (figures["belief_age_mean_s"], figures["belief_age_max_s"]) == (pytest.approx(0.25), pytest.approx(0.4))
    assert "belief_age_mean_s" not in figures_of(*rows)


def test_a_belief_is_read_as_it_was_written() -> None:
    told = belief_of(belief(0, 0, list(range(100)), [0.01] * 100))
    assert told.grid.size == 100
    np.testing.assert_allclose(told.mean_m, [0.0, 0.0], atol=1e-12)
    assert told.variance_m2 == pytest.approx(uniform(told.grid).variance_m2)


def test_hand_offs_by_hand() -> None:
    rows = [(0.5, handoff([2, 3], "grid", 600, 0.0)), (1.0, handoff([4, 5, 6], "gaussian", 20, 0.5))]
    figures = figures_of(*rows)
    assert (figures["handoffs"], figures["handoff_neighbours_mean"]) == (2, 2.5)
    assert (figures["handoff_mean_byte"], figures["handoff_max_byte"]) == (310.0, 600)
    assert figures["handoff_divergence_mean_bit"] == 0.25
    assert figures["handoffs_by_form"] == {"gaussian": 1, "grid": 1}
    assert figures_of(*rows, (2.0, handoff([4], "grid", 9, math.inf)))["handoff_divergence_mean_bit"] is None


def test_the_shipped_tracker_gives_the_figures_of_its_trace(scenarios: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    figures = run(load(scenarios / "liu2002" / "tracking.yaml", ["duration_s=8"]), folder=folder).metrics
    events = [event for _, event in read_trace(folder / "trace.mcap", {Belief.topic, Handoff.topic})]
    again = metrics_of(read_trace(folder / "trace.mcap"))
    assert {name: figures[name] for name in again} == again
    spreads = [belief_of(event).variance_m2 for event in events if isinstance(event, Belief)]
    assert figures["belief_variance_mean_m2"] == pytest.approx(np.mean(spreads))
    assert figures["handoffs"] == figures["beliefs"] - 1 == 15
    assert figures["leader_changes"] == figures["belief_messages"] == figures["handoffs"]
    assert figures["belief_messages_astray"] == figures["outages"] == figures["two_leaders_s"] == 0
