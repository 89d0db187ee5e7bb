"""What tracking by groups is warned of: targets that nobody reads, steps that leave no time."""

import pytest

from netsim.scenario.load import load
from netsim.scenario.warnings import scenario_warnings

SCENARIO = """\
kind: scenario
schema_version: 1
name: odd
duration_s: 10
field: {width_m: 100, height_m: 100}
nodes:
  - name: a
    placement: {type: grid, rows: 3, columns: 3, spacing_m: 40}
    cpu: cortex_m4
problem:
  type: energy-tracking
  sensing_range_m: 50
  targets:
    - track: {type: straight, from_m: [0, 0], to_m: [100, 100], speed_m_per_s: 15}
    - track: {type: straight, from_m: [100, 0], to_m: [0, 100], speed_m_per_s: 15}
algorithm: {type: joint-tracking, separate_m: 90}
"""


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ([], []),
        (["problem.targets[0].track.enters_s=11"], ["targets[0]: enters at 11 s, but the run ends at 10 s"]),
        (
            ["problem.targets[1].track={type: straight, from_m: [900, 0], to_m: [900, 100]}"],
            ["targets[1]: at no reading"],
        ),
        (["problem.targets[1].track={type: straight, from_m: [129, 0], to_m: [129, 100]}"], []),
        (["problem.targets[0].track.speed_m_per_s=46"], ["targets[0]: goes at up to 46 m/s", "is 45 m/s"]),
        (["problem.targets[0].track={type: file, file: none.csv}"], []),
        (["problem.reading_s=11", "algorithm.give_s=1"], ["there is no reading after time 0"]),
        (["algorithm.separate_m=101"], ["groups collide at most twice", "100 m"]),
        (["algorithm.separate_m=101", "algorithm.switch=latched"], []),
        (["algorithm.give_s=1"], ["algorithm.give_s is 1 s, but there is a reading every 1 s"]),
        (["algorithm.particles=65000"], ["algorithm.particles is 65,000", "0.5 s are left"]),
        (["algorithm.joint_particles=65000"], ["algorithm.joint_particles is 65,000"]),
        (["algorithm.joint_particles=65000", "algorithm.switch=never"], []),
        (["nodes[0].algorithm={type: joint-tracking, give_s: 2, separate_m: 90}"], ["nodes[0].algorithm.give_s"]),
    ],
)
def test_odd_settings(tmp_path, overrides, words):
    (tmp_path / "odd.yaml").write_text(SCENARIO, encoding="utf-8")
    warnings = list(scenario_warnings(load(tmp_path / "odd.yaml", overrides)))
    assert len(warnings) == bool(words)
    assert all(word in warnings[0] for word in words)
