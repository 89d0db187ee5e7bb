"""`netsim compare`: what it prints, and when it fails."""

import json
from collections.abc import Mapping
from pathlib import Path

import pytest
import typer

import netsim
from netsim.cli.compare import compare_command
from netsim.study.plan import load_plan
from netsim.study.run import run_study
from netsim.study.tabulate import refresh_tables


@pytest.fixture(scope="module")
def runs(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    made = {}
    folder = tmp_path_factory.mktemp("runs")
    for name, changes in (("one", []), ("tolerant", ["algorithm.tolerance=0.5"]), ("seed", ["seed=11"])):
        made[name] = folder / name
        made[name].mkdir()
        netsim.run(netsim.load(scenarios / "quickstart.yaml", changes), folder=made[name], trace=name != "seed")
    return made


def compared(paths: list[Path], *gates: str, everything: bool = False, as_json: bool = False) -> None:
    compare_command(paths, gates, everything=everything, as_json=as_json)


def test_two_runs(runs: Mapping[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    compared([runs["one"], runs["tolerant"]])
    told = capsys.readouterr().out
    lines = [" ".join(line.split()) for line in told.splitlines()]
    figures = [json.loads((runs[name] / "metrics.json").read_text()) for name in ("one", "tolerant")]
    first, later = (each["radio_messages"] for each in figures)
    assert "algorithm.tolerance 0.1 0.5" in lines
    assert f"radio_messages {first} {later} {later - first:+} ({100 * (later - first) / first:+.3g} %)" in lines
    assert "energy_by_node_j" not in told
    assert any(line.startswith("equal: ") and "simulated_s" in line for line in lines)
    assert f"{runs['tolerant']} parts from {runs['one']} after " in told
    assert "round 1 sends no graph message of" in told
    compared([runs["one"], runs["tolerant"]], everything=True)
    assert "energy_by_node_j.n00" in capsys.readouterr().out


def test_more_runs_and_a_missing_trace(runs: Mapping[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    compared([runs["one"], runs["tolerant"], runs["seed"]])
    told = capsys.readouterr().out
    assert f"Where {runs['seed']} parts from {runs['one']} is not known: no trace in {runs['seed']}." in told


def test_gates_decide_the_exit_status(runs: Mapping[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    compared([runs["one"], runs["tolerant"]], "error_rel > 1")
    assert f"passed: {runs['tolerant']}: not error_rel > 1 (error_rel = 0.333333)" in capsys.readouterr().out
    with pytest.raises(typer.Exit) as ended:
        compared([runs["one"], runs["tolerant"]], "error_rel > 1", "error_rel > 0.02")
    assert ended.value.exit_code == 1
    assert capsys.readouterr().err == f"failed: {runs['tolerant']}: error_rel > 0.02 (error_rel = 0.333333)\n"


def test_json_holds_everything(runs: Mapping[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit):
        compared([runs["one"], runs["tolerant"]], "association_error_diff > 0", as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["runs"] == [str(runs["one"]), str(runs["tolerant"])]
    assert told["scenarios"] == [{"path": "algorithm.tolerance", "values": ["0.1", "0.5"]}]
    figures = json.loads((runs["one"] / "metrics.json").read_text())
    assert told["metrics"]["energy_j"]["values"][0] == figures["energy_j"]
    assert told["metrics"]["association_differs_from_exact_map"]["relative"] == ["inf"]
    parting = told["partings"][0]
    assert (parting["traces"], parting["first"]["topic"]) == ("part", "/model/messages")
    assert told["gates"][0]["failed"] is True


def test_studies(scenarios: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changes = ["repetitions=2", "sweep=[{path: algorithm.tolerance, values: [0, 1]}]"]
    folders = [tmp_path / name for name in ("one", "half")]
    for folder, more in zip(folders, ([], ["set={algorithm.payload: float16}"]), strict=True):
        folder.mkdir()
        plan = load_plan(scenarios / "studies" / "quick.yaml", [*changes, *more])
        run_study(plan, folder, "netsim study quick.yaml")
    compared(folders)
    told = capsys.readouterr().out
    assert f"{folders[1]} against {folders[0]}: differences within pairs of one seed and repetition" in told
    assert "Of 2 variants that both have, the scenarios of 2 differ." in told
    assert "Over 2 variants" in told
    assert "Each variant" in told
    with pytest.raises(typer.Exit):
        compared(folders, "frame_byte_rel < 0", as_json=True)
    match = json.loads(capsys.readouterr().out)["matches"][0]
    assert (match["paired"], match["changed_scenarios"]) == (True, 2)
    assert match["overall"]["frame_byte"]["difference"] < 0
    assert set(match["variants"]) == {"tolerance=0", "tolerance=1"}
    journal = folders[1] / "trials.jsonl"
    outcomes = [json.loads(line) for line in journal.read_text().splitlines()]
    outcomes[1].update(status="failed", error="boom", figures={}, nodes={})
    journal.write_text("".join(json.dumps(outcome) + "\n" for outcome in outcomes[:3]))
    refresh_tables(folders[1])
    with pytest.raises(typer.Exit) as ended:
        compared(folders, "frame_byte_rel > 1")
    assert ended.value.exit_code == 1
    told = capsys.readouterr()
    assert f"warning: in {folders[1]} 1 of 4 trials failed: tolerance=1, repetition 0\n" in told.out
    assert f"warning: in {folders[1]} 1 of 4 trials were not run: tolerance=1, repetition 1\n" in told.out
    assert "passed" not in told.out
    assert "could not be judged on all trials: 2 of 4 trials that ended well" in told.err
    with pytest.raises(typer.Exit):
        compared(folders, "frame_byte_rel > 1", as_json=True)
    assert "2 of 4 trials" in json.loads(capsys.readouterr().out)["gates"][0]["unjudged"]
