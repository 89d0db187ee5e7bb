"""The README's examples do what it says."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from netsim.scenario.load import load
from netsim.testing import run_algorithm
from netsim.trace.events import Log

README = Path(__file__).parent.parent / "README.md"
ROOT = README.parent


def blocks(language: str) -> list[str]:
    """The README's code blocks in one language."""
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(), re.DOTALL)


def test_checks_run_the_same_test_command() -> None:
    command = next(block for block in blocks("sh") if "pytest" in block).strip()
    assert command in (ROOT / ".ci" / "run").read_text()


def test_scenario_example_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(blocks("yaml")[0])
    assert load(path).scenario.name == "mine"


def test_algorithm_example_hears_the_others() -> None:
    names: dict[str, type] = {}
    exec(blocks("python")[0], names)
    result = run_algorithm(names["Hello"], nodes=3)
    assert not result.failures
    heard = [event.message for _, event in result.events if isinstance(event, Log)]
    assert sorted(heard) == sorted(f"heard node {other}" for node in range(3) for other in range(3) if other != node)


def test_python_example_prints_error_and_energy(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", blocks("python")[1]], cwd=ROOT, capture_output=True, text=True, check=True
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
    help_text = subprocess.run(
        [sys.executable, "-m", "netsim", "--help"], capture_output=True, text=True, check=True
    ).stdout
    assert commands
    assert all(f" {command} " in help_text for command in commands)
