"""`netsim lifetime` on the folder of a run."""

import math
from pathlib import Path

import pytest
from in_process import netsim

from netsim.cli.lifetime import _days
from netsim.errors import ScenarioError
from netsim.scenario.outlook import outlook


def test_days_and_assumptions_are_printed(scenarios: Path, tmp_path: Path) -> None:
    folder = str(tmp_path / "run")
    assert netsim("run", str(scenarios / "quickstart.yaml"), "--out", folder, "--no-trace").returncode == 0
    done = netsim("lifetime", folder, "--per-day", "24", "--self-discharge", "3")
    assert done.returncode == 0, done.stderr
    assert "first dead" in done.stdout
    assert "sensors" in done.stdout
    assert "24 a day take" in done.stdout
    assert "- Linear: every activity costs each node what it cost in this run" in done.stdout
    assert "not known, for the folder has no trace.mcap" in " ".join(done.stdout.split())
    without = netsim("lifetime", folder)
    assert without.returncode == 2
    assert "duty_plan" in without.stderr
    assert "Traceback" not in without.stderr


def test_milestones_are_printed_of_a_run_with_a_trace(scenarios: Path, tmp_path: Path) -> None:
    folder = str(tmp_path / "run")
    assert netsim("run", str(scenarios / "allowance.yaml"), "--out", folder).returncode == 0
    done = netsim("lifetime", folder)
    assert done.returncode == 0, done.stderr
    first, apart, lost = (line for line in done.stdout.splitlines() if line.startswith(("First", "Network")))
    assert first.startswith("First node dead: ")
    assert first.endswith(" days")
    assert apart.startswith("Network falls apart: ")
    assert "does not apply" in lost  # no sink, and nothing to find out


def test_a_folder_without_a_run_is_said_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        outlook(tmp_path, {})
    text = str(caught.value)
    assert text.count(str(tmp_path)) == 1
    assert "got: no such file; give the folder that `netsim run` wrote" in text


def test_times_under_a_day_are_in_hours_or_seconds() -> None:
    assert [_days(days) for days in (math.inf, 2.5, 0.5, 0.001)] == ["never", "2.5", "12 h", "86.4 s"]
