"""`netsim study` as a user meets it: what it says, what it refuses, how it ends."""

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from in_process import netsim as command

from netsim.cli.study_progress import duration, remarks
from netsim.study.dispatch import Standing

ROOT = Path(__file__).parents[2]


def write(folder: Path, **changes: object) -> Path:
    study = {
        "kind": "study",
        "schema_version": 1,
        "name": "small",
        "question": "What does tolerance save?",
        "scenario": str(ROOT / "scenarios" / "quickstart.yaml"),
        "set": {"duration_s": 7, "algorithm.rounds": 1},
        "repetitions": 1,
        "sweep": [{"path": "algorithm.tolerance", "values": [0, 1]}],
    }
    path = folder / "study.yaml"
    path.write_text(json.dumps({**study, **changes}))
    return path


def test_a_study_says_what_it_does_and_where_its_results_are(tmp_path: Path) -> None:
    write(tmp_path)
    done = command("study", "study.yaml", "--jobs", 1, "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines() == [
        "small: 2 variants x 1 repetition = 2 trials",
        "2 trials to run by this process",
    ]
    said = done.stdout.splitlines()
    assert said[0].startswith("2 trials in ")
    assert said[1].startswith("A trial took ")
    assert said[2].startswith("Results in runs/small: results.parquet, results.csv")
    files = {path.name for path in (tmp_path / "runs" / "small").iterdir()}
    assert files == {
        *("study.yaml", "study.json", "trials.jsonl", "variants"),
        *("results.csv", "results.parquet", "nodes.csv", "nodes.parquet"),
    }
    info = json.loads((tmp_path / "runs" / "small" / "study.json").read_text())
    assert info["command"] == "netsim study study.yaml --jobs 1 --no-report"
    again = command("study", "study.yaml", "--jobs", 1, "--no-report", cwd=tmp_path)
    assert "Results in runs/small-2: " in again.stdout
    resumed = command("study", "study.yaml", "--resume", "--no-report", cwd=tmp_path)
    assert resumed.returncode == 0
    assert "2 are finished already" in resumed.stderr
    assert resumed.stdout.startswith("Nothing to run: every trial is finished\nResults in runs/small-2: ")


def test_what_is_in_the_way_is_not_touched(tmp_path: Path) -> None:
    write(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.tex").write_text("precious")
    for flags in ((), ("--force",)):
        refused = command("study", "study.yaml", "--out", "out", *flags, cwd=tmp_path)
        assert (refused.returncode, refused.stdout) == (2, "")
        assert refused.stderr == "error: out holds files, but no study: choose another folder (--out)\n"
    resumed = command("study", "study.yaml", "--out", "out", "--resume", cwd=tmp_path)
    assert resumed.returncode == 2
    assert resumed.stderr.startswith("error: out holds no study that could be resumed")
    assert [path.name for path in out.iterdir()] == ["thesis.tex"]


def test_force_replaces_a_study_and_nothing_else(tmp_path: Path) -> None:
    write(tmp_path)
    first = command("study", "study.yaml", "--out", "out", "--jobs", 1, "--no-report", cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    (tmp_path / "out" / "notes.txt").write_text("mine")
    refused = command("study", "study.yaml", "--out", "out", cwd=tmp_path)
    assert refused.returncode == 2
    assert refused.stderr == (
        "error: out exists and is not empty: go on with the study there (--resume), replace it (--force), or choose "
        "another folder (--out)\n"
    )
    arguments = ("--out", "out", "--force", "--jobs", 1, "--no-report", "--set", "algorithm.tolerance=2")
    write(tmp_path, sweep=[])
    forced = command("study", "study.yaml", *arguments, cwd=tmp_path)
    assert forced.returncode == 0, forced.stderr
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"
    assert [path.name for path in (tmp_path / "out" / "variants").iterdir()] == ["000"]
    assert "tolerance: 2" in (tmp_path / "out" / "variants" / "000" / "scenario.yaml").read_text()


def test_more_repetitions_extend_a_study(tmp_path: Path) -> None:
    write(tmp_path)
    common = ("study", "study.yaml", "--jobs", 1, "--out", "out", "--no-report")
    assert command(*common, cwd=tmp_path).returncode == 0
    more = command(*common, "--repetitions", 2, "--resume", cwd=tmp_path)
    assert more.returncode == 0, more.stderr
    assert "more repetitions than before (repetitions: 0 alone before, 0 to 1 now)" in more.stderr
    assert more.stdout.startswith("2 trials in ")
    fewer = command(*common, "--resume", cwd=tmp_path)
    assert fewer.returncode == 2
    assert "repetitions: 0 to 1 before, 0 alone now" in fewer.stderr
    assert "2 of 4 finished trials still count: --allow-changed goes on with them" in fewer.stderr
    allowed = command(*common, "--resume", "--allow-changed", cwd=tmp_path)
    assert allowed.returncode == 0
    assert len((tmp_path / "out" / "results.csv").read_text().splitlines()) == 3


def test_a_failed_trial_is_told_with_the_command_that_shows_it(tmp_path: Path) -> None:
    write(tmp_path, set={"duration_s": 7, "algorithm.rounds": 1, "problem": {"type": "none"}}, sweep=[])
    refused = command("study", "study.yaml", cwd=tmp_path)
    assert refused.returncode == 2  # what is wrong with every trial is found before the first
    (tmp_path / "odd.py").write_text(
        '"""Odd."""\n\n\nclass Odd:\n    """Fails."""\n\n    def run(self, node):\n'
        "        yield from node.pause(5)\n        raise ValueError('odd')\n"
    )
    base = {
        "kind": "scenario",
        "extends": str(ROOT / "scenarios" / "quickstart.yaml"),
        "algorithm": {"type": "odd:Odd"},
    }
    (tmp_path / "base.yaml").write_text(json.dumps(base))
    write(tmp_path, scenario="base.yaml", set={}, sweep=[])
    done = command("study", "study.yaml", "--jobs", 1, "--out", "out", "--no-report", cwd=tmp_path)
    assert done.returncode == 1
    assert "1 trial (1 failed) in " in done.stdout
    *_, first, see, again = done.stderr.splitlines()
    assert first == (
        "error: 1 of 1 trials failed; the first is trial 0 (repetition 0): node 0: the algorithm raised ValueError('odd') "
        "(odd.py, line 9) (and 8 nodes more)"
    )
    assert see == "  see it: cd out && netsim run variants/000/scenario.yaml --set repetition=0 --debug"
    assert again == "  run the failed ones again: netsim study study.yaml --jobs 1 --no-report --out out --resume"
    words = see.partition("&& netsim ")[2].split()
    seen = command(*words, cwd=tmp_path / "out")
    assert seen.returncode == 1
    assert "ValueError: odd" in seen.stderr


def test_two_studies_in_one_folder_at_once(tmp_path: Path) -> None:
    from netsim.study.journal import Journal

    write(tmp_path)
    assert command("study", "study.yaml", "--jobs", 1, "--out", "out", "--no-report", cwd=tmp_path).returncode == 0
    with Journal(tmp_path / "out" / "trials.jsonl"):
        for flag in ("--resume", "--force"):
            second = command("study", "study.yaml", "--out", "out", flag, "--no-report", cwd=tmp_path)
            assert second.returncode == 1
            assert second.stderr.splitlines()[-1].startswith(
                "error: out: another `netsim study` is at work in this folder"
            )
    assert (tmp_path / "out" / "results.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--resume", "--force"), "--resume and --force exclude each other"),
        (("--jobs", 2, "--scheduler", "tcp://h:1"), "--jobs and --scheduler exclude each other"),
        (("--allow-changed",), "--allow-changed belongs to --resume"),
        (("--resume",), "no study to resume at runs/small"),
        (("--set", "nonsense"), "path=value"),
        (("--set", "algorithm.tolerence=1"), "--set algorithm.tolerence: expected"),
        (("--set", "algorithm.tolerance=1"), "a path that is set once, not also by `set`"),
        (("--set", "repetitions=-1"), "--set repetitions: expected a whole number > 0, got -1"),
    ],
)
def test_what_is_refused_in_a_line(tmp_path: Path, arguments: tuple[object, ...], words: str) -> None:
    write(tmp_path)
    refused = command("study", "study.yaml", *arguments, cwd=tmp_path)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert words in refused.stderr
    assert len(refused.stderr.splitlines()) <= 2
    assert not (tmp_path / "runs").exists()


def test_without_dask_the_extra_is_named(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "distributed.py").write_text("raise ImportError('not here')\n")
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    words = [sys.executable, "-m", "netsim", "study", "study.yaml", "--scheduler", "tcp://127.0.0.1:1"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    assert done.returncode == 2
    assert done.stderr == "error: --scheduler needs Dask, which is not installed: pip install dask distributed\n"


def test_run_and_study_point_at_each_other(tmp_path: Path) -> None:
    write(tmp_path)
    run = command("run", "study.yaml", cwd=tmp_path)
    assert run.returncode == 2
    assert run.stderr == "error: study.yaml is a study, not a scenario: run it with `netsim study study.yaml`\n"
    quickstart = ROOT / "scenarios" / "quickstart.yaml"
    study = command("study", quickstart, cwd=tmp_path)
    assert study.returncode == 2
    assert study.stderr == f"error: {quickstart} is a scenario, not a study: run it with `netsim run {quickstart}`\n"


def test_check_reads_every_variant_of_a_study(tmp_path: Path) -> None:
    write(tmp_path)
    good = command("check", "study.yaml", cwd=tmp_path)
    assert good.returncode == 0
    assert good.stdout == "study.yaml: ok (small: 2 variants x 1 repetition = 2 trials)\n"
    write(tmp_path, sweep=[{"path": "algorithm.tolerance", "values": [0, -1]}], metrics=["enrgy_j"])
    bad = command("check", "study.yaml", cwd=tmp_path)
    assert bad.returncode == 2
    assert "study.yaml:1: metrics[0]: expected the name of a metric, got `enrgy_j`; did you mean energy_j" in bad.stderr
    write(tmp_path, sweep=[{"path": "algorithm.tolerance", "values": [0, -1]}])
    bad = command("check", "study.yaml", cwd=tmp_path)
    assert "study.yaml:1: algorithm.tolerance: expected a number >= 0 or adaptive, got -1" in bad.stderr
    assert bad.stderr.endswith("1 error\n")


def test_check_builds_the_variants(tmp_path: Path) -> None:
    write(tmp_path, sweep=[{"path": "nodes[0].radio", "values": ["cc2420", "no_such_radio"]}])
    bad = command("check", "study.yaml", cwd=tmp_path)
    assert bad.returncode == 2
    assert "no_such_radio" in bad.stderr
    assert "Traceback" not in bad.stderr


def test_the_schema_of_studies_is_up_to_date(scenarios: Path, tmp_path: Path) -> None:
    printed = command("schema", "--study", cwd=tmp_path)
    assert printed.stdout == (scenarios / "netsim-study.schema.json").read_text(), (
        "run: netsim schema --study > scenarios/netsim-study.schema.json"
    )
    assert "| `sweep[].range.scale` |" in command("schema", "--study", "--reference", cwd=tmp_path).stdout


def test_on_a_terminal_a_bar_shows_how_far_it_is(tmp_path: Path) -> None:
    write(tmp_path, repetitions=4)
    master, slave = pty.openpty()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "120"}
    words = [sys.executable, "-m", "netsim", "study", "study.yaml", "--jobs", "1", "--no-report"]
    process = subprocess.Popen(words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=slave, text=True)
    os.close(slave)
    seen = b""
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # its other end is closed
            break
        if not part:
            break
        seen += part
    os.close(master)
    assert process.wait(timeout=60) == 0
    process.stdout.close()
    text = seen.decode()
    assert "of 8" in text
    assert "trials/s" in text


def test_remarks_and_durations() -> None:
    standing = Standing(trials=10, done=6, ran=4, ran_failed=1, workers=2, trial_wall_s=40.0)
    assert remarks(standing, 20.0) == "1 failed, 0.2 trials/s, about 20 s left"
    assert remarks(Standing(trials=10, workers=3), 1.0) == "3 at a time"
    assert remarks(Standing(trials=10, ran=3, workers=0), 1.0) == "no worker there: waiting for one"
    assert [duration(time_s) for time_s in (0.4, 59.4, 200, 7500)] == ["0 s", "59 s", "3 min 20 s", "2 h 5 min"]
