"""The README's examples do what it says."""

import re
import subprocess
import sys
from pathlib import Path

import in_process
import pytest

import netsim
from netsim.scenario.load import load
from netsim.study.plan import load_plan
from netsim.study.run import run_study
from netsim.testing import run_algorithm
from netsim.trace.events import Log

README = Path(__file__).parent.parent / "README.md"
ROOT = README.parent


def blocks(language: str) -> list[str]:
    """The README's code blocks in one language."""
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(), re.DOTALL)


def block(language: str, mark: str) -> str:
    """The code block in a language that holds a mark."""
    (found,) = [text for text in blocks(language) if mark in text]
    return found


def test_checks_run_the_same_test_command() -> None:
    command = next(block for block in blocks("sh") if "pytest" in block).strip()
    assert command in (ROOT / ".ci" / "run").read_text()


def test_scenario_example_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(block("yaml", "kind: scenario"))
    assert load(path).scenario.name == "mine"


def test_study_example_is_the_shipped_one(tmp_path: Path) -> None:
    text = block("yaml", "kind: study").replace("../chen2006", str(ROOT / "scenarios" / "chen2006"))
    path = tmp_path / "study.yaml"
    path.write_text(text)
    shipped = load_plan(ROOT / "scenarios" / "studies" / "csmp-tolerance.yaml")
    assert [each.digest for each in load_plan(path).variants] == [each.digest for each in shipped.variants]


def test_notebook_example_groups_the_trials_of_a_study(tmp_path: Path) -> None:
    study = load_plan(ROOT / "scenarios" / "studies" / "quick.yaml", ["repetitions=1"])
    run_study(study, tmp_path, "netsim study quick.yaml")
    lines = block("python", "load_results").replace("runs/csmp-tolerance", str(tmp_path)).splitlines()
    names = {"netsim": netsim}
    exec(lines[0], names)
    assert len(eval(lines[1], names)) == 6


def test_algorithm_example_hears_the_others() -> None:
    names: dict[str, type] = {}
    exec(block("python", "class Hello"), names)
    result = run_algorithm(names["Hello"], nodes=3)
    assert not result.failures
    heard = [event.message for _, event in result.events if isinstance(event, Log)]
    assert sorted(heard) == sorted(f"heard node {other}" for node in range(3) for other in range(3) if other != node)


def test_python_example_prints_error_and_energy(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", block("python", "result = netsim.run")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    error, energy_j = map(float, ended.stdout.split())
    assert 0.0 <= error <= 1.0
    assert energy_j > 0.0


def test_nothing_is_left_open_and_every_link_leads_somewhere() -> None:
    text = README.read_text()
    assert not re.findall(r"@[A-Z_]+@|TODO", text)
    files = [link for link in re.findall(r"\]\(([^)]+)\)", text) if "://" not in link]
    assert files
    assert [link for link in files if not (ROOT / link).exists()] == []


def test_commands_exist() -> None:
    commands = set(re.findall(r"^netsim ([a-z]+)", "\n".join(blocks("sh")), re.MULTILINE))
    help_text = in_process.netsim("--help").stdout
    assert commands
    assert all(f" {command} " in help_text for command in commands)
