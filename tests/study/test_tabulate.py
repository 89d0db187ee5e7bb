"""Tables made of a journal: the same as those of a study that ended by itself, and by what its trials were run."""

import json
import shutil
from pathlib import Path

import pytest
from in_process import netsim as netsim_command
from report_studies import written
from study_rig import same_tables, write_study

import netsim
from netsim.cli.report import report_command
from netsim.errors import ScenarioError
from netsim.study.build_id import versions
from netsim.study.compare_studies import compare_studies
from netsim.study.info import INFO_FILE, JOURNAL_FILE, BuildInfo, read_info
from netsim.study.plan import load_plan
from netsim.study.report import write_report
from netsim.study.results import load_study
from netsim.study.run import run_study
from netsim.study.tabulate import refresh_tables

TABLES = ("results.parquet", "results.csv", "nodes.parquet", "nodes.csv")


@pytest.fixture(autouse=True)
def words_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without plots, which take most of the time."""
    monkeypatch.setattr("netsim.study.report.draw", lambda view: {})


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with two variants of two seeds, two repetitions."""
    folder = tmp_path_factory.mktemp("whole")
    sweep = [{"name": "draw", "path": "seed", "values": [3, 2**70]}]
    out = folder / "out"
    out.mkdir()
    run_study(load_plan(write_study(folder, sweep=sweep)), out, "netsim study study.yaml")
    return out


@pytest.fixture
def finished(whole: Path, tmp_path: Path) -> Path:
    """A copy of that study's folder."""
    return shutil.copytree(whole, tmp_path / "out")


@pytest.fixture
def other(whole: Path, tmp_path: Path) -> Path:
    """Another copy."""
    return shutil.copytree(whole, tmp_path / "other")


def interrupt(folder: Path, trials: int) -> None:
    """Leave what a study killed after so many trials leaves: no tables, a torn line."""
    for name in TABLES:
        (folder / name).unlink()
    lines = (folder / JOURNAL_FILE).read_text().splitlines(keepends=True)
    (folder / JOURNAL_FILE).write_text("".join(lines[:trials]) + lines[-1][:40])


def test_tables_of_a_journal_are_those_of_the_study(finished: Path, tmp_path: Path) -> None:
    before = {name: (finished / name).read_bytes() for name in (*TABLES, INFO_FILE)}
    for name in TABLES:
        (finished / name).unlink()
    refresh_tables(finished)
    assert {name: (finished / name).read_bytes() for name in before} == before


def test_a_study_that_was_killed_is_reported_as_far_as_it_got(finished: Path) -> None:
    whole = netsim.load_results(finished)
    interrupt(finished, 3)
    report_command(finished, open_page=False)
    rows = netsim.load_results(finished)
    assert rows.to_csv() == whole[:3][list(rows)].to_csv()
    assert rows["seed"].astype(str).tolist() == ["3", str(2**70), "3"]
    assert "only 3 of them were run so far" in (finished / "report.md").read_text()


def test_a_table_behind_its_journal_is_made_anew(finished: Path) -> None:
    lines = (finished / JOURNAL_FILE).read_text()
    interrupt(finished, 2)
    refresh_tables(finished)
    (finished / JOURNAL_FILE).write_text(lines)
    report_command(finished, open_page=False)
    assert len(netsim.load_results(finished)) == 4


def test_without_tables_the_way_to_them_is_told_in_one_line(finished: Path, other: Path) -> None:
    interrupt(finished, 3)
    remedies = rf"`netsim report {finished}`, or go on with it: netsim study study.yaml --out {finished} --resume"
    for ask in (
        lambda: netsim.load_results(finished),
        lambda: netsim.load_results(finished / "results.csv"),
        lambda: load_study(finished),
        lambda: compare_studies([other, finished]),
    ):
        with pytest.raises(ScenarioError, match=remedies) as caught:
            ask()
        assert "\n" not in str(caught.value)
    done = netsim_command("compare", other, finished)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)


def test_where_no_trial_is_finished_there_is_nothing_to_report(finished: Path) -> None:
    interrupt(finished, 0)
    with pytest.raises(ScenarioError, match=r"no trial is finished yet; go on with it: .* --resume"):
        report_command(finished, open_page=False)


def test_tables_without_a_journal_stay(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    written(folder, {"tolerance": [0, 1]}, 2, lambda levels, repetition: {"frames": 1})
    before = (folder / "results.csv").read_bytes()
    refresh_tables(folder)
    assert (folder / "results.csv").read_bytes() == before


def test_a_folder_of_an_early_version_is_read(finished: Path) -> None:
    """It had neither warnings nor builds nor seeds of variants."""
    given = json.loads((finished / INFO_FILE).read_text())
    del given["warnings"], given["builds"]
    for variant in given["variants"]:
        del variant["seed"]
    (finished / INFO_FILE).write_text(json.dumps(given))
    info = read_info(finished)
    assert (info.warnings, info.trial_versions, info.variants[0].seed) == ((), info.versions, None)
    report_command(finished, open_page=False)  # of the tables that are there
    interrupt(finished, 3)
    with pytest.raises(ScenarioError, match="does not tell the variants' seeds; go on with it"):
        refresh_tables(finished)
    (finished / INFO_FILE).write_text(json.dumps(given | {"seeds": [3]}))
    refresh_tables(finished)
    assert set(netsim.load_results(finished)["seed"]) == {3}


def test_by_what_trials_were_run_is_told_of_all_and_in_no_table(finished: Path, other: Path) -> None:
    own = versions()
    assert read_info(finished).builds == (BuildInfo(own, 4),)
    lines = [json.loads(line) for line in (finished / JOURNAL_FILE).read_text().splitlines()]
    lines[0]["packages"]["numpy"] = "1.0"
    del lines[1]["packages"]  # as an early version wrote it
    lines[1]["netsim_version"] = "0.0.7"
    (finished / JOURNAL_FILE).write_text("".join(json.dumps(line) + "\n" for line in lines))
    report_command(finished, open_page=False)
    same_tables(finished, other)
    told = read_info(finished).trial_versions
    assert told["netsim"] == f"{own['netsim']} (3 trials) and 0.0.7 (1 trial)"
    assert told["numpy"] == f"{own['numpy']} (2 trials) and unknown (1 trial) and 1.0 (1 trial)"
    report = (finished / "report.md").read_text()
    assert "0.0.7 (1 trial)" in report
    assert "run by different versions" in report
    write_report(other)
    assert "run by different versions" not in (other / "report.md").read_text()
    assert [setting.path for setting in compare_studies([other, finished]).versions] == list(own)
