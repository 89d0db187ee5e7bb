"""Tracking scores from streams of events by hand, and from a real run."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenario import tracking_scenario

from netsim.kernels.consistency import nees_interval
from netsim.metrics.collect import metrics_of
from netsim.metrics.tracking import Tracking
from netsim.metrics.tracks import TargetTruth
from netsim.scenario.run import run
from netsim.trace.events import Estimate, Event, Identity, TruthTargets
from netsim.trace.reader import read_trace
from netsim.units import s_to_ns

Rows = list[tuple[float, Event]]


def scores(rows: Rows, **settings: float) -> dict[str, float]:
    """The figures of some events, times in seconds."""
    reducer = Tracking(**settings)
    handlers = reducer.handlers()
    for time_s, event in sorted(rows, key=lambda row: row[0]):
        handlers[type(event)](event, s_to_ns(time_s))
    return reducer.figures()


def truth(**places: tuple[float, float]) -> TruthTargets:
    """Targets by number: truth(t0=(x, y), t2=(x, y))."""
    return TruthTargets([int(name[1:]) for name in places], *zip(*places.values(), strict=True))


def track(number: int, x_m: float, y_m: float, covariance_m2: tuple[float, ...] = ()) -> Estimate:
    return Estimate(0, number, x_m, y_m, covariance_m2)


def test_truth_is_on_the_line_between_its_records() -> None:
    history = TargetTruth()
    history.add(truth(t0=(0.0, 0.0), t1=(5.0, 5.0)), 10)
    history.add(truth(t0=(9.0, 9.0), t1=(5.0, 5.0)), 20)
    history.add(truth(t0=(10.0, 0.0), t1=(5.0, 5.0)), 20)  # another word at the same instant
    history.add(truth(t0=(10.0, 4.0)), 30)
    assert history.at(9) == {}
    assert history.at(10) == {0: (0.0, 0.0), 1: (5.0, 5.0)}
    assert history.at(15) == {0: (5.0, 0.0), 1: (5.0, 5.0)}
    assert history.at(25) == {0: (10.0, 2.0), 1: (5.0, 5.0)}  # target 1 leaves at 30
    assert history.at(99) == {0: (10.0, 4.0)}
    assert history.last_ns == 30


def test_an_estimate_is_compared_with_the_truth_at_its_instant() -> None:
    """The target is at 2.5 m then; the estimate is a 3-4-5 triangle off."""
    rows: Rows = [(0, truth(t0=(0.0, 0.0))), (10, truth(t0=(10.0, 0.0))), (2.5, track(7, 5.5, 4.0, (25.0, 0.0, 4.0)))]
    figures = scores(rows)
    assert figures["position_error_mean_m"] == figures["position_error_rms_m"] == pytest.approx(5.0)
    assert figures["nees_mean"] == pytest.approx(9 / 25 + 16 / 4)
    assert figures["nees_estimates"] == 1
    assert (figures["nees_mean_low"], figures["nees_mean_high"]) == nees_interval(1, 2, 0.95)


def test_tracks_are_assigned_all_at_once() -> None:
    """Track 0 is nearest to target 1, but that is all that is left for track 1."""
    rows: Rows = [(0, truth(t0=(0.0, 0.0), t1=(4.0, 0.0))), (1, track(0, 3.0, 0.0)), (1, track(1, 8.0, 0.0))]
    assert scores(rows)["position_error_mean_m"] == pytest.approx((3 + 4) / 2)
    assert scores(rows)["position_error_max_m"] == pytest.approx(4)
    assert scores(rows[:2])["position_error_mean_m"] == pytest.approx(1)
    later: Rows = [*rows[:2], (4, track(1, 8.0, 0.0))]  # the word of track 0 of 3 s ago still counts
    assert scores(later)["position_error_mean_m"] == pytest.approx((1 + 4) / 2)
    latest: Rows = [*rows[:2], (8, track(1, 8.0, 0.0))]  # that of 7 s ago does not
    assert scores(latest)["position_error_mean_m"] == pytest.approx((1 + 4) / 2)


def test_beyond_the_cut_off_a_track_follows_nobody() -> None:
    rows: Rows = [
        (0, truth(t0=(0.0, 0.0))),
        (1, track(0, 10.0, 0.0)),
        (1, track(1, 2.0, 0.0)),
        (2, track(0, math.nan, 0.0)),
    ]
    figures = scores(rows)
    assert (figures["estimates"], figures["estimates_unassigned"]) == (2, 1)
    assert figures["position_error_mean_m"] == 2.0
    assert (figures["targets_mean"], figures["targets_missed_mean"], figures["tracks_false_mean"]) == (1, 0, 1)
    assert figures["nees_mean"] is None
    nobody = scores(rows[:2])
    assert nobody["position_error_mean_m"] is None
    assert nobody["ospa_last_m"] == 10.0
    assert scores(rows[:2], cut_off_m=10.5)["position_error_mean_m"] == 10.0


def test_sets_are_sampled_every_second_and_at_the_end() -> None:
    """Samples at 2, 3 and 3.5 s; the second track appears at 2.5 s, the target rests."""
    rows: Rows = [
        (0, truth(t0=(0.0, 0.0))),
        (1, track(0, 3.0, 0.0)),
        (2.5, track(1, 50.0, 0.0)),
        (3.5, track(0, 1.0, 0.0)),
    ]
    figures = scores(rows)
    with_ghost, last = math.sqrt((9 + 100) / 2), math.sqrt((1 + 100) / 2)
    assert figures["ospa_mean_m"] == pytest.approx((3 + with_ghost + last) / 3)
    assert figures["ospa_last_m"] == pytest.approx(last)
    assert figures["gospa_localisation_rms_m"] == pytest.approx(math.sqrt((9 + 9 + 1) / 3))
    assert figures["gospa_false_rms_m"] == pytest.approx(math.sqrt((50 + 50) / 3))
    assert figures["gospa_missed_rms_m"] == 0.0
    assert figures["tracks_false_mean"] == pytest.approx(2 / 3)
    assert figures["targets_followed_share"] == 1.0


def test_a_track_falls_silent_and_its_target_is_lost_once() -> None:
    """Followed at the samples from 1 s until 5 s after the last word; from 6 s on nobody follows, so it is lost at 10 s."""
    rows: Rows = [(time_s, truth(t0=(0.0, 0.0))) for time_s in range(21)]
    figures = scores([*rows, (0, track(0, 1.0, 0.0))])
    assert figures["targets_followed_share"] == pytest.approx(5 / 20)
    assert figures["track_losses"] == 1
    found_again = scores([*rows, (0, track(0, 1.0, 0.0)), (9.5, track(3, 1.0, 0.0))])
    assert (found_again["track_losses"], found_again["track_switches"]) == (1, 1)  # lost for good at 14.5 + 5 s
    for_four_seconds = scores([*rows[:10], (0, track(0, 1.0, 0.0)), (8.5, track(0, 1.0, 0.0))])
    assert (for_four_seconds["track_losses"], for_four_seconds["track_switches"]) == (0, 0)


def test_a_target_that_leaves_is_not_lost() -> None:
    both = truth(t0=(0.0, 0.0), t1=(50.0, 0.0))
    rows: Rows = [(time_s, both if time_s < 3 else truth(t1=(50.0, 0.0))) for time_s in range(21)]
    said: Rows = [(time_s, track(1, 50.0, 1.0)) for time_s in range(21)]
    figures = scores([*rows, *said, (0, track(0, 1.0, 0.0)), (2, track(0, 1.0, 0.0))])
    assert figures["track_losses"] == 0
    assert figures["targets_followed_share"] == 1.0


def test_tracks_that_change_partners_are_two_switches() -> None:
    """Two targets 100 m apart, whose tracks jump to each other's place at 5 s."""
    places = [(0.0, 0.0), (100.0, 0.0)]
    rows: Rows = [(0, truth(t0=places[0], t1=places[1]))]
    for time_s in range(10):
        for number in (0, 1):
            rows.append((time_s, track(number, *places[number if time_s < 5 else 1 - number])))
    figures = scores(rows)
    assert figures["track_switches"] == 2
    assert figures["position_error_max_m"] == 0.0
    assert figures["targets_followed_share"] == 1.0


def test_tracks_of_near_targets_keep_them_while_they_can() -> None:
    """Noise makes the other assignment shorter for a moment; nobody has switched."""
    rows: Rows = [(0, truth(t0=(0.0, 0.0), t1=(2.0, 0.0)))]
    for time_s in range(6):
        shift = 1.5 if time_s == 3 else 0.0
        rows += [(time_s, track(0, shift, 0.0)), (time_s, track(1, 2.0 - shift, 0.0))]
    assert scores(rows)["track_switches"] == 0


def test_identity_is_judged_by_whom_the_track_follows() -> None:
    rows: Rows = [
        (0, truth(t0=(0.0, 0.0), t1=(50.0, 0.0))),
        (1, Identity(3, 5, [1.0, 0.0])),  # no word of that track yet
        (1, track(5, 49.0, 0.0)),
        (1, Identity(3, 5, [0.3, 0.7])),
        (2, Identity(4, 5, [0.6, 0.4])),
        (2, Identity(4, 5, [1.0])),  # knows of one target only
        (2, Identity(4, 9, [1.0, 0.0])),  # nobody estimates that track
    ]
    figures = scores(rows)
    assert figures["identities"] == 5
    assert figures["identity_accuracy"] == pytest.approx(1 / 4)  # at 1 s both records see what was said at 1 s
    assert figures["identity_probability_mean"] == pytest.approx((0.0 + 0.7 + 0.4 + 0.0) / 4)
    assert "identities" not in scores([row for row in rows if not isinstance(row[1], Identity)])


def test_without_truth_or_estimates_there_are_no_figures() -> None:
    assert scores([(0, truth(t0=(0.0, 0.0)))]) == {}
    assert scores([(0, track(0, 0.0, 0.0))]) == {}


PLACE = st.tuples(st.floats(-15, 15), st.floats(-15, 15))


@given(
    st.lists(PLACE, min_size=1, max_size=4),
    st.lists(st.tuples(st.integers(0, 12), st.integers(0, 3), PLACE), min_size=1),
)
def test_figures_agree_with_each_other_and_do_not_depend_on_names(targets, said) -> None:
    there = TruthTargets(list(range(len(targets))), *zip(*targets, strict=True))
    figures = scores([(0, there), *((time_s, track(number, *place)) for time_s, number, place in said)])
    renamed = scores([(0, there), *((time_s, track(40 - number, *place)) for time_s, number, place in said)])
    parts = (figures[f"gospa_{part}_rms_m"] ** 2 for part in ("localisation", "missed", "false"))
    assert figures["gospa_rms_m"] ** 2 == pytest.approx(sum(parts), abs=1e-9)
    assert 0.0 <= figures["ospa_mean_m"] <= 10.0
    assert figures["targets_followed_share"] * len(targets) + figures["targets_missed_mean"] == pytest.approx(
        len(targets)
    )
    assert figures["position_error_rms_m"] is None or figures["position_error_rms_m"] < 10.0
    for name in ("ospa_mean_m", "gospa_rms_m"):  # where distances are equal, who follows whom is settled by number
        assert renamed[name] == pytest.approx(figures[name], abs=1e-9)


def test_a_run_with_drawn_priors_is_consistent(tmp_path: Path) -> None:
    """Sixty priors drawn with 1 m^2 a coordinate: root mean square error sqrt(2), NEES 2, both within four deviations."""
    folder = tmp_path / "run"
    folder.mkdir()
    metrics = run(tracking_scenario(tmp_path), folder=folder).metrics
    assert metrics["estimates"] == 60
    assert abs(metrics["nees_mean"] - 2.0) < 4 * 2 / math.sqrt(60)
    assert metrics["position_error_rms_m"] == pytest.approx(math.sqrt(metrics["nees_mean"]), rel=1e-12)
    assert metrics["identity_accuracy"] > 0.5
    again = metrics_of(read_trace(folder / "trace.mcap"))
    assert {name: metrics[name] for name in again} == again
    assert metrics["estimates_unassigned"] == 0
    assert metrics["ospa_mean_m"] == pytest.approx(metrics["position_error_rms_m"], rel=1e-12)
    assert metrics["gospa_rms_m"] == pytest.approx(math.sqrt(60) * metrics["position_error_rms_m"], rel=1e-12)


def test_priors_that_are_the_truth_have_no_error(tmp_path: Path) -> None:
    metrics = run(tracking_scenario(tmp_path, "problem.prior_mean=truth")).metrics
    assert metrics["position_error_max_m"] == metrics["ospa_last_m"] == metrics["gospa_localisation_rms_m"] == 0.0
    assert metrics["identity_accuracy"] == 1.0
