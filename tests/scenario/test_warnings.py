"""What a valid scenario is warned of."""

from pathlib import Path

import pytest

from netsim.scenario.load import load
from netsim.scenario.warnings import scenario_warnings

SCENARIO = """\
kind: scenario
schema_version: 1
name: odd
duration_s: 5
nodes:
  - name: a
    placement: {type: grid, rows: 1, columns: 2, spacing_m: 5}
    EXTRA
medium: {type: log-distance}
algorithm: {type: neighbour-traffic, period_s: 1, rounds: 1}
"""


@pytest.mark.parametrize(
    ("group", "more", "words"),
    [
        ("", "", []),
        ("", "time_sync: {type: ftsp}", ["all clocks are perfect"]),
        ("clock: {}", "time_sync: {type: ftsp}", []),
        ("", "faults: [{type: crash, at_s: 9}]", ["faults[0]: the crash at 9 s never comes"]),
        ("", "faults: [{type: outage, links: [[0, 0]]}]", ["a link of node 0 with itself"]),
        ("", "faults: [{type: outage, links: [[a, a]]}]", []),
        ("duty_cycle: {period_s: 1, on_s: 0.5}", "mac: {type: lpl}", ["duty_cycle with mac lpl"]),
        ("duty_cycle: {period_s: 1, on_s: 0.5}", "", []),
        ("duty_cycle: {period_s: 1, on_s: 0.000001}", "", ["to start: it never listens"]),
        ("clock: {offset_sd_s: 0.01}", "mac: {type: tdma}", ["more than mac.guard_ms, 1 ms"]),
    ],
)
def test_odd_combinations(group: str, more: str, words: list[str], tmp_path: Path) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(SCENARIO.replace("EXTRA", group) + more + "\n", encoding="utf-8")
    warnings = list(scenario_warnings(load(path)))
    assert len(warnings) == len(words)
    assert all(word in warning for word, warning in zip(words, warnings, strict=True))


PASSING = """\
kind: scenario
schema_version: 1
name: idle settings
duration_s: 30
nodes:
  - {name: a, placement: {type: grid, rows: 2, columns: 2, spacing_m: 5}, sensor: {}}
medium: {type: log-distance}
problem: {type: association, PROBLEM}
algorithm: {type: csmp, ALGORITHM}
"""


@pytest.mark.parametrize(
    ("problem", "algorithm", "more", "words"),
    [
        ("model: hybrid", "tolerance: 0.2", "", []),
        ("bearing_sd_rad: 0.2", "asks: 3", "", ["problem.bearing_sd_rad: does nothing", "asks: does nothing"]),
        ("bearing_sd_rad: 0.2, measures: bearing", "asks: 3, silence: notice", "", []),
        ("model: hybrid", "rehost: true", "mac: {type: ideal}", ["rehost: nobody can notice a death"]),
        ("model: hybrid", "rehost: true", "", []),
        ("model: hybrid", "rehost: true, silence: notice", "mac: {type: ideal}", []),
        ("model: hybrid", "sleep: scheduled", "mac: {type: lpl}", ["sleep: scheduled with mac lpl"]),
        ("model: hybrid", "sleep: when_quiet", "mac: {type: tdma}", ["sleep: when_quiet with mac tdma"]),
        ("model: hybrid", "sleep: scheduled", "mac: {type: tdma, listen: always}", []),
        ("model: hybrid", "quiet_rounds: 4, sleep: scheduled", "", ["quiet_rounds: does nothing without sleep: when_quiet"]),
        ("model: hybrid", "tolerance: adaptive, support: projected", "", ["support: does nothing with tolerance: adaptive"]),
        ("model: hybrid", "tolerance_when_short: 1", "", ["no group has an allowance"]),
    ],
)  # fmt: skip
def test_settings_without_effect(problem: str, algorithm: str, more: str, words: list[str], tmp_path: Path) -> None:
    path = tmp_path / "idle.yaml"
    text = PASSING.replace("PROBLEM", problem).replace("ALGORITHM", algorithm)
    path.write_text(text + more + "\n", encoding="utf-8")
    warnings = list(scenario_warnings(load(path)))
    assert len(warnings) == len(words)
    assert all(word in warning for word, warning in zip(words, warnings, strict=True))


CRASH = "faults=[{type: role-crash, role: ROLE, at_s: 1}]"


@pytest.mark.parametrize(
    ("scenario", "role", "words"),
    [
        ("liu2002/tracking.yaml", "leader", []),
        ("liu2002/tracking.yaml", "guard", []),
        ("liu2002/tracking.yaml", "leeder", ["faults[0]", "the role `leeder`", "idsq takes `leader` or `guard`"]),
        ("liu2002/central.yaml", "leader", ["central-bayes takes `centre`"]),
        ("quickstart.yaml", "leader", ["csmp tells no roles"]),
    ],
)
def test_crashes_of_roles_that_nobody_takes(scenario: str, role: str, words: list[str]) -> None:
    loaded = load(Path("scenarios") / scenario, [CRASH.replace("ROLE", role)])
    warnings = list(scenario_warnings(loaded))
    assert len(warnings) == bool(words)
    assert all(word in warnings[0] for word in words)


def test_roles_of_own_algorithms_are_not_known(tmp_path: Path) -> None:
    (tmp_path / "mine_with_roles.py").write_text(
        "class Mine:\n    def run(self, node):\n        yield from ()\n", encoding="utf-8"
    )
    path = tmp_path / "odd.yaml"
    text = SCENARIO.replace("EXTRA", "algorithm: {type: 'mine_with_roles:Mine'}")
    path.write_text(text, encoding="utf-8")
    assert not list(scenario_warnings(load(path, [CRASH.replace("ROLE", "boss")])))
