"""`netsim inspect`: the same summary as that of the run, where the energy went, who talked to whom."""

import re
from pathlib import Path

import pytest

import netsim
from netsim.cli.inspect import inspect_command
from netsim.errors import ScenarioError
from netsim.trace.events import EnergyLedger
from netsim.trace.reader import read_trace
from netsim.trace.writer import TraceWriter


@pytest.fixture(scope="module")
def run(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> netsim.Result:
    loaded = netsim.load(scenarios / "lifetime.yaml", ["duration_s=2"])
    return netsim.run(loaded, folder=tmp_path_factory.mktemp("run") / "out")


def numbers(text: str, pattern: str) -> list[int]:
    return [int(found.replace(",", "")) for found in re.findall(pattern, text, re.MULTILINE)]


def test_the_whole_run_adds_up(run: netsim.Result, capsys: pytest.CaptureFixture[str]) -> None:
    assert run.folder is not None
    inspect_command(run.folder, None, 1000)
    told = capsys.readouterr().out
    assert "unicast data frames received" in told
    assert f"energy in all: {run.metrics['energy_j']:.6g} J" in told
    frames = numbers(told, r"^  n\d\d +n\d\d +([\d,]+) ")
    assert sum(frames) == run.metrics["frames_unicast_data"]
    retries = numbers(told, r"^  n\d\d +n\d\d +[\d,]+ +([\d,]+) ")
    assert sum(retries) == run.metrics["frames_retry"]


def test_one_node_has_its_own_ledger_and_its_own_pairs(run: netsim.Result, capsys: pytest.CaptureFixture[str]) -> None:
    assert run.trace is not None
    inspect_command(run.trace, "n07", 2)
    told = capsys.readouterr().out
    assert f"energy in all: {run.metrics['energy_by_node_j']['n07']:.6g} J" in told
    assert "unicast data frames received" not in told
    assert len(re.findall(r"^  n\d\d +n\d\d ", told, re.MULTILINE)) == 2
    assert "more pairs: see --top" in told
    with pytest.raises(ScenarioError, match=r"nodes: expected some of n00, .*; got n77"):
        inspect_command(run.trace, "n77", 2)


def test_of_a_run_that_was_killed_the_rest_is_told(
    run: netsim.Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run.trace is not None
    cut = tmp_path / "cut.mcap"
    with TraceWriter(cut, {}) as writer:
        for time_ns, event in read_trace(run.trace):
            if not isinstance(event, EnergyLedger):
                writer.write(event, time_ns)
    inspect_command(cut, None, 5)
    told = capsys.readouterr().out
    assert "no energy ledger: the run did not come to its end" in told
    assert "radio messages" in told
