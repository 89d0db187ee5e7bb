"""The table at the end of a run: what befell the nodes is told if anything did."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import netsim
from netsim.cli.summary import summary_table


@pytest.fixture(scope="module")
def quiet(scenarios: Path) -> tuple[netsim.Result, netsim.LoadedScenario]:
    loaded = netsim.load(scenarios / "lifetime.yaml", ["duration_s=1"])
    return netsim.run(loaded, trace=False), loaded


def told(quiet: tuple[netsim.Result, netsim.LoadedScenario], figures: Mapping[str, Any]) -> dict[str, str]:
    """The rows of the table for a run with these figures besides its own."""
    result, loaded = quiet
    columns = summary_table(replace(result, metrics={**result.metrics, **figures}), loaded).columns
    return {str(what).strip(): str(figure) for what, figure in zip(*(column.cells for column in columns), strict=True)}


def test_a_quiet_run_tells_of_no_incidents(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    rows = told(quiet, {"frames_lost_by_reason": {}, "frames_unicast_data": 0, "crashes": 0, "energy_harvested_j": 0.0})
    words = ("lost", "crash", "allowance", "refused", "clock", "harvest", "empty", "unicast data frames")
    assert not [what for what in rows if any(word in what for word in words)]


def test_losses_are_told_with_the_most_frequent_first(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    figures = {"frame_reception_ratio_unicast": 0.875, "frames_lost_by_reason": {"busy": 2, "jammed": 1_300, "weak": 7}}
    rows = told(quiet, {"frames_unicast_data": 10_472, **figures})
    assert rows["unicast data frames received"] == "87.50 %"
    assert rows["lost, at the addressee"] == "1,300 jammed, 7 weak, 2 busy"


def test_incidents_are_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    rows = told(
        quiet,
        {
            "crashes": 3,
            "reboots": 2,
            "energy_allowance_short": 1,
            "energy_allowance_short_nodes": 1,
            "energy_refused": {"send": 4, "sense": 1},
            "clock_error_max_s": 0.0008949,
            "clock_error_rms_s": 0.0002558,
            "clock_spread_last_s": 0.00002,
            "energy_harvested_j": 0.5,
            "energy_spilled_j": 0.1,
        },
    )
    assert rows["crashes"] == "3 (2 came back)"
    assert rows["energy allowance used up"] == "1 time, on 1 of 31 nodes"
    assert rows["refused for want of it"] == "4 send, 1 sense"
    assert rows["clock error, largest"] == "0.0008949 s (root mean square 0.0002558 s)"
    assert rows["spread among the nodes at the last sample"] == "2e-05 s"
    assert rows["energy harvested"] == "0.5 J (0.1 J of it found the battery full)"


def test_frames_are_told_by_kind_where_some_are_control(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    sent = {"radio_messages_by_kind": {"reading": 3}}
    assert "by kind" not in told(quiet, sent | {"frames_by_kind": {"ack": 2, "reading": 3}})
    rows = told(quiet, sent | {"frames_by_kind": {"ack": 2, "beacon": 40, "reading": 3}})
    assert rows["by kind"] == "40 beacon, 3 reading, 2 ack"


def test_tracking_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    figures = {
        "estimates": 40,
        "estimates_unassigned": 0,
        "position_error_mean_m": 1.25,
        "ospa_mean_m": 2.5,
        "targets_missed_mean": 0.5,
        "tracks_false_mean": 0.0,
        "track_switches": 3,
        "track_losses": 1,
        "nees_estimates": 40,
        "nees_mean": 2.5,
        "nees_mean_low": 1.428,
        "nees_mean_high": 2.666,
    }
    rows = told(quiet, figures)
    assert rows["position error, mean of 40 estimates"] == "1.25 m"
    assert rows["targets missed, false tracks (means)"] == "0.5 and 0"
    assert rows["switches of tracks, losses"] == "3 and 1"
    assert rows["NEES, mean (consistent: 1.428 to 2.666)"] == "2.5"
    assert "of tracks that follow no target, left out" not in rows
    lost = told(quiet, {**figures, "position_error_mean_m": None, "estimates_unassigned": 40, "nees_estimates": 0})
    assert lost["position error, mean of 40 estimates"] == "-"
    assert lost["of tracks that follow no target, left out"] == "40"


def test_who_is_who_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    figures = FOLLOWED | {"identity_accuracy": 0.75, "identity_probability_last": 0.98}
    rows = told(quiet, figures | {"identity_messages": 1234})
    assert rows["identities right, of tracks with a target"] == "75.00 %"
    assert rows["probability of the right one in the end, mean"] == "98.00 %"
    assert rows["messages about it"] == "1,234"
    lost = told(quiet, figures | {"identity_accuracy": None, "identity_probability_last": None, "identity_messages": 0})
    assert lost["identities right, of tracks with a target"] == "-"
    assert "messages about it" not in lost


def test_groups_and_what_they_send_are_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    groups = {
        "reading_error_mean_m": 5.9, "reading_nees_mean": 3.0, "group_reports": 9, "group_merges": 1, "group_splits": 1,
        "joint_readings_share": 0.25, "report_distance_mean_m": 86.5, "track_leader_changes": 31,
        "track_two_leaders_longest_s": 0.5, "track_two_leaders_s": 1.0, "radio_messages_by_kind": {"given": 26, "call": 3},
    }  # fmt: skip
    rows = told(quiet, FOLLOWED | groups)
    assert rows["NEES at the reading (expected: 2)"] == "3"
    assert rows["merges and splits of groups"] == "1 and 1"
    assert rows["messages with a belief"] == "26"
    assert "messages with a belief" not in told(quiet, FOLLOWED | groups | {"radio_messages_by_kind": {"call": 3}})


def test_energy_that_is_not_listening_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    assert told(quiet, {"energy_beyond_listening_j": 5.847})["of it beyond listening, sleep and idling"] == "5.847 J"


def test_what_was_proved_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    assert told(quiet, {"map_proved": 1, "map_proved_share": 1.0})["most probable answer"] == "proved MAP"
    part = told(quiet, {"map_proved": 0, "map_proved_share": 0.25})["most probable answer"]
    assert part == "not proved (25.00 % of the vertices are)"
    assert "most probable answer" not in told(quiet, {})


FOLLOWED = {
    "estimates": 72,
    "estimate_error_mean_m": 13.25,
    "estimate_error_mean_after_start_m": 11.5,
    "estimates_lost_share": 0.0,
    "targets_mean": 1.0,
    "targets_followed_share": 0.96,
    "track_switches": 0,
    "track_losses": 0,
    "nees_estimates": 0,
    "beliefs": 72,
    "belief_variance_mean_m2": 265.0,
    "belief_cells_mean": 126.25,
    "handoffs": 71,
    "handoff_neighbours_mean": 3.4375,
    "handoff_mean_byte": 648.0,
    "handoff_max_byte": 4602,
    "handoff_divergence_mean_bit": 4e-16,
    "handoffs_by_form": {"grid": 71},
    "leader_nodes": 21,
    "outages": 0,
    "two_leaders_s": 0.0,
    "belief_messages_astray": 0,
}


def test_a_belief_that_wanders_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    rows = told(quiet, FOLLOWED)
    assert rows["distance of estimate and target, mean of 72"] == "13.25 m"
    assert rows["variance of the belief, mean"] == "265 m²"
    assert rows["hand-offs, among 3.4 neighbours"] == "71"
    assert rows["belief with header, mean"] == "648 byte (at most 4,602)"
    assert rows["times without a leader"] == "none"
    noise = ("OSPA", "left out", "track lost", "lost by", "laid out", "two leaders", "switches", "others than", "NEES")
    assert not [what for what in rows if any(word in what for word in noise)]


def test_of_several_targets_those_are_told_apart_that_have_left(
    quiet: tuple[netsim.Result, netsim.LoadedScenario],
) -> None:
    """An estimate of a target that has left is compared with another one, however far: the mean says little then."""
    left = {"estimates_lost_share": 0.125, "targets_mean": 1.5, "estimates_unassigned": 9, "position_error_mean_m": 5.5}
    rows = told(quiet, FOLLOWED | left)
    assert rows["beyond the cut-off: target lost or gone"] == "12.50 %"
    assert rows["of tracks that follow a target, 63 estimates"] == "5.5 m"


def test_what_goes_wrong_with_a_belief_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    wrong = {"estimates_lost_share": 0.125, "belief_messages_astray": 2, "two_leaders_s": 0.5} | {
        "two_leaders_longest_s": 0.25, "outages": 2, "outage_longest_s": 1.5, "outage_total_s": 2.0,
        "handoffs_by_form": {"gaussian": 30, "grid": 41}, "handoff_divergence_mean_bit": None,
    }  # fmt: skip
    rows = told(quiet, FOLLOWED | wrong)
    assert rows["beyond the cut-off: track lost"] == "12.50 %"
    assert rows["laid out as"] == "30 gaussian, 41 grid"
    assert rows["lost by the layout, mean"] == "infinite"
    assert rows["times without a leader"] == "2 (longest 1.5 s, in all 2 s)"
    assert rows["with two leaders of a track, longest"] == "0.25 s (in all 0.5 s)"
    assert rows["beliefs sent to others than the next leader"] == "2"


def test_a_central_belief_has_no_leaders(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    central = {name: value for name, value in FOLLOWED.items() if not name.startswith(("handoff", "leader", "outage"))}
    rows = told(quiet, central)
    assert "cells of nonzero probability, mean" in rows
    assert not [what for what in rows if "hand-off" in what or "leader" in what or "led" in what.split()]


def test_many_kinds_of_message_are_told_by_the_largest(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    kinds = {"belief": 133, "host": 5, "notice": 812, "request": 26}
    assert told(quiet, {"radio_messages": 976, "radio_messages_by_kind": kinds})["radio messages"] == (
        "976 (812 notice, 133 belief, 31 other)"
    )


def test_what_was_taken_over_from_the_dead_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    rows = told(quiet, {"crashes": 2, "reboots": 1, "rehostings": 3, "hosts_stepped_down": 1})
    assert rows["variables taken over from dead hosts"] == "3 (1 given back)"


PAIRS = {
    "gated_pairs": 46,
    "gated_pairs_told_share": 1.0,
    "pair_error_linf": 0.0024,
    "pair_error_bp_linf": 0.02,
    "interval_width_max": 0.04,
    "interval_width_mean": 0.008,
    "interval_misses": 0,
    "events_incomplete_share": 0.25,
    "decay_depth_mean": 4.1,
}
SILENT = {"pair_error_linf": None, "interval_width_max": None, "interval_misses": None}


def test_what_is_certified_of_pairs_is_told(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    rows = told(quiet, PAIRS)
    assert rows["certified intervals, widest and mean"] == "0.04, 0.008"
    assert rows["exact probabilities outside"] == "none"
    assert rows["events that miss a report"] == "25.00 %"
    assert told(quiet, PAIRS | {"interval_misses": 3})["exact probabilities outside"] == "3"


@pytest.mark.parametrize(
    ("figures", "why"),
    [
        ({"gated_pairs_told_share": 0.0, "nodes_finished": 0}, "nothing told: raise duration_s"),
        ({"gated_pairs_told_share": 0.0, "nodes_finished": 31}, "nothing told"),
        ({"gated_pairs_told_share": None}, "no measurement may be of an event"),
        ({"gated_pairs_told_share": 0.5}, "exact sums out of reach"),
    ],
)
def test_it_is_told_why_there_is_no_error_of_pairs(
    quiet: tuple[netsim.Result, netsim.LoadedScenario], figures: Mapping[str, Any], why: str
) -> None:
    rows = told(
        quiet, {**PAIRS, **SILENT, **dict.fromkeys(("nodes_failed", "nodes_died", "nodes_crashed"), 0), **figures}
    )
    assert rows["largest error of a probability"] == f"not computed: {why}"


def test_joules_beyond_listening_stand_beside_all_joules(quiet: tuple[netsim.Result, netsim.LoadedScenario]) -> None:
    assert told(quiet, {"energy_beyond_listening_j": 1.25})["of it beyond listening, sleep and idling"] == "1.25 J"
