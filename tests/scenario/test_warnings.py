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
