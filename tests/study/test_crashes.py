"""Studies whose processes are killed: nothing is lost but time. Real processes, real signals."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from in_process import netsim
from study_rig import (
    children_of,
    is_alive,
    lines_of,
    same_tables,
    start,
    wait_for,
    write_misbehaving,
)

from netsim import load_results

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds worker processes in /proc")
SLOW = {"set": {"algorithm.wall_s": 0.15}, "repetitions": 12}


@pytest.fixture(scope="module")
def slow(tmp_path_factory):
    """A study of a dozen trials of 0.15 s, and the folder of an undisturbed run of it."""
    folder = tmp_path_factory.mktemp("slow")
    file = write_misbehaving(folder, ["none"], **SLOW)
    done = netsim("study", file, "--jobs", 1, "--out", folder / "whole", "--no-report")
    assert done.returncode == 0, done.stderr
    return file, folder / "whole"


def test_a_worker_killed_in_the_middle_costs_nothing_but_time(slow, tmp_path):
    file, whole = slow
    out = tmp_path / "out"
    process = start("study", file, "--jobs", 2, "--out", out, "--no-report")
    wait_for(lambda: lines_of(out / "trials.jsonl") >= 2)
    victim = children_of(process.pid)[0]
    os.kill(victim, signal.SIGKILL)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert lines_of(out / "trials.jsonl") == 12
    same_tables(out, whole)


def test_a_killed_study_resumed_gives_the_uninterrupted_table_and_leaves_no_workers(slow, tmp_path):
    file, whole = slow
    out = tmp_path / "out"
    process = start("study", file, "--jobs", 2, "--out", out, "--no-report")
    wait_for(lambda: lines_of(out / "trials.jsonl") >= 3)
    workers = children_of(process.pid)
    process.kill()
    process.communicate(timeout=60)
    assert len(workers) == 2
    wait_for(lambda: not any(map(is_alive, workers)), timeout_s=30)
    before = lines_of(out / "trials.jsonl")
    assert 3 <= before < 12
    assert not (out / "results.csv").exists()
    done = netsim("study", file, "--jobs", 1, "--out", out, "--resume", "--no-report")
    assert done.returncode == 0, done.stderr
    assert f"{before} are finished already" in done.stderr
    assert done.stdout.startswith(f"{12 - before} trial")
    same_tables(out, whole)


def test_the_first_ctrl_c_finishes_running_trials_and_says_how_to_go_on(slow, tmp_path):
    file, whole = slow
    out = tmp_path / "out"
    process = start("study", file, "--jobs", 2, "--out", out, "--no-report")
    wait_for(lambda: lines_of(out / "trials.jsonl") >= 2)
    workers = children_of(process.pid)
    for pid in [process.pid, *workers]:  # as a terminal does
        os.kill(pid, signal.SIGINT)
    said, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "finishing the" in err
    assert "Ctrl-C once more to stop at once" in err
    finished = lines_of(out / "trials.jsonl")
    assert len(load_results(out)) == finished < 12
    resuming = f"netsim study {file} --jobs 2 --no-report --out {out} --resume"
    assert f"interrupted: {finished} of 12 trials are finished; go on with: {resuming}" in err
    assert said.startswith(f"{finished} trials in ")
    done = netsim(*resuming.split()[1:])
    assert done.returncode == 0, done.stderr
    same_tables(out, whole)


def test_ctrl_c_while_workers_start_hits_none_of_them(slow, tmp_path):
    file, _ = slow
    out = tmp_path / "out"
    process = start("study", file, "--jobs", 2, "--out", out, "--no-report")
    wait_for(lambda: len(children_of(process.pid)) == 2)
    workers = children_of(process.pid)
    for pid in [process.pid, *workers]:
        os.kill(pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert 1 <= lines_of(out / "trials.jsonl") <= 4
    assert set(load_results(out)["status"]) == {"ok"}
    wait_for(lambda: not any(map(is_alive, workers)))


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_second_ctrl_c_stops_at_once(tmp_path, jobs):
    file = write_misbehaving(tmp_path, ["none"], set={"algorithm.wall_s": 30}, repetitions=3)
    out = tmp_path / "out"
    process = start("study", file, "--jobs", jobs, "--out", out, "--no-report")
    assert process.stderr.readline().startswith("small: 1 variant x 3 repetitions = 3 trials")
    assert process.stderr.readline().startswith("3 trials to run")
    if jobs == 2:
        wait_for(lambda: len(children_of(process.pid)) == 2)
    workers = children_of(process.pid)
    process.send_signal(signal.SIGINT)
    assert process.stderr.readline().startswith("finishing the ")
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.splitlines() == [
        f"stopped at once; go on with: netsim study {file} --jobs {jobs} --no-report --out {out} --resume"
    ]
    wait_for(lambda: not any(map(is_alive, workers)), timeout_s=30)


def test_a_trial_that_kills_its_worker_fails_and_the_rest_go_on(tmp_path):
    file = write_misbehaving(tmp_path, ["none", "kill", "kill once"], repetitions=2)
    out = tmp_path / "out"
    done = netsim("study", file, "--jobs", 2, "--out", out, "--no-report")
    assert done.returncode == 1
    trials = load_results(out)
    failed = trials[trials["status"] == "failed"]
    assert list(failed["deed"]) == ["kill"] * 2
    assert set(failed["error"]) == {"its worker died"}
    assert "6 trials (2 failed) in " in done.stdout
    assert "error: 2 of 6 trials failed; the first is trial 1 (deed=kill, repetition 0): its worker died" in done.stderr
    assert "netsim run variants/001/scenario.yaml --set repetition=0 --debug" in done.stderr


def test_a_full_disk_is_one_line_and_the_study_can_be_resumed(slow, tmp_path):
    file, whole = slow
    out = tmp_path / "out"
    command = f"ulimit -f 4; exec {sys.executable} -m netsim study {file} --jobs 1 --out {out} --no-report"
    ended = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    last = ended.stderr.splitlines()[-1]
    assert last.startswith(f"error: {out}/trials.jsonl: cannot write or read the study's journal: File too large; ")
    assert last.endswith("--resume")
    assert 0 < lines_of(out / "trials.jsonl") < 12
    done = netsim("study", file, "--jobs", 1, "--out", out, "--resume", "--no-report")
    assert done.returncode == 0, done.stderr
    same_tables(out, whole)
