"""What a tracking scenario is warned of: targets that nobody can track, sensors that are off while they listen."""

import pytest

from netsim.scenario.load import load
from netsim.scenario.warnings import scenario_warnings

SCENARIO = """\
kind: scenario
schema_version: 1
name: odd
duration_s: 5
field: {width_m: 100, height_m: 100}
nodes:
  - name: a
    placement: {type: grid, rows: 2, columns: 2, spacing_m: 50}
    SENSOR
problem:
  type: tracking
  targets: [{track: TRACK}]
  MORE
algorithm: {type: idsq}
"""
GOOD = "{type: straight, from_m: [50, 0], to_m: [50, 100]}"


@pytest.mark.parametrize(
    ("track", "sensor", "more", "words"),
    [
        (GOOD, "", "", []),
        (
            "{type: straight, from_m: [50, 0], to_m: [50, 100], enters_s: 6}",
            "",
            "",
            ["enters at 6 s, but the run ends"],
        ),
        ("{type: straight, from_m: [150, 0], to_m: [150, 100]}", "", "", ["is at no reading inside the field"]),
        (
            "{type: waypoints, points: [{at_s: 1.1, x_m: 1, y_m: 1}, {at_s: 1.4, x_m: 2, y_m: 1}]}",
            "",
            "",
            ["is at no reading"],
        ),
        ("{type: straight, from_m: [50, 0], to_m: [50, 100], speed_m_per_s: 20}", "", "", ["goes at up to 20 m/s"]),
        ("{type: straight, from_m: [50, 0], to_m: [50, 100], speed_m_per_s: 15}", "", "", []),
        ("{type: manoeuvre, speed_m_per_s: 30, speed_sd_m_per_s: 0}", "", "", ["problem.max_speed_m_per_s is 15 m/s"]),
        ("{type: file, file: none.csv}", "", "", []),
        (
            GOOD,
            "",
            "bearings: sampled",
            ["sensor.sample_time_s is 0.01 s, but 512 samples of a microphone take 0.102 s"],
        ),
        (GOOD, "sensor: {sample_time_s: 0.1024}", "bearings: sampled", []),
        (GOOD, "", "{bearings: sampled, bearing_share: 0}", []),
    ],
)
def test_odd_targets_and_microphones(tmp_path, track, sensor, more, words):
    more = more.strip("{}").replace(", ", "\n  ")
    text = SCENARIO.replace("TRACK", track).replace("SENSOR", sensor).replace("MORE", more)
    (tmp_path / "odd.yaml").write_text(text, encoding="utf-8")
    warnings = list(scenario_warnings(load(tmp_path / "odd.yaml")))
    assert len(warnings) == len(words)
    assert all(word in warning for word, warning in zip(words, warnings, strict=True))


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ([], []),
        (["problem.first_leader=none"], ["nobody ever begins a track"]),
        (["problem.first_leader=none", "problem.watchdogs=all", "algorithm.robust=true"], []),
        (["problem.reading_s=9"], ["there is no reading after time 0"]),
        (["algorithm.sleep={}"], []),
        (["algorithm.sleep={window_s: 0.49}"], ["algorithm.sleep: a window with its guard times is 0.5 s"]),
        (["algorithm.sleep={}", "medium={type: log-distance}", "mac={type: lpl}"], ["sleep with mac lpl"]),
        (["algorithm.threads=4"], []),  # the others of four nodes, 50 m apart: more than 40 m, so three by number
        (["algorithm.threads=5"], ["algorithm.threads is 5, but", "no node has more than 3"]),
        (["algorithm.threads=5", "nodes[0].placement.spacing_m=10"], ["no node has more than 3"]),
        (["nodes[0].algorithm={type: idsq, threads: 9}"], ["nodes[0].algorithm.threads is 9"]),
    ],
)
def test_settings_of_a_tracker_that_rarely_do_what_was_meant(tmp_path, overrides, words):
    text = SCENARIO.replace("TRACK", GOOD).replace("SENSOR", "").replace("MORE", "")
    (tmp_path / "odd.yaml").write_text(text, encoding="utf-8")
    warnings = list(scenario_warnings(load(tmp_path / "odd.yaml", overrides)))
    assert len(warnings) == bool(words)
    assert all(word in warnings[0] for word in words)
