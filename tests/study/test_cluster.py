"""The same study on a real Dask scheduler with two workers, each a process started by Dask's own command."""

import os
import re
import signal
import socket
import subprocess
import sys
import time

import pytest
from in_process import netsim
from study_rig import ROOT, lines_of, same_tables, start, wait_for, write_misbehaving, write_study

pytest.importorskip("distributed")

from netsim import load_results
from netsim.errors import NetsimError
from netsim.study.build_id import build_id, versions
from netsim.study.cluster import DaskWorkers, _check_versions
from netsim.study.trial import Task, run_trial


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Cluster:
    """A scheduler and its workers."""

    def __init__(self, folder, workers):
        self.folder = folder
        self.address = f"tcp://127.0.0.1:{free_port()}"
        self.processes = []
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", self.address.rpartition(":")[2])
        self.workers = [self.worker() for _ in range(workers)]

    def worker(self):
        where = ("--local-directory", str(self.folder), "--host", "127.0.0.1")
        return self._start("worker", self.address, "--nthreads", "1", "--no-nanny", *where)

    def _start(self, *arguments):
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        log = (self.folder / f"{len(self.processes)}.log").open("w")
        self.processes.append(
            subprocess.Popen(command, env=environment, cwd=self.folder, stdout=log, stderr=subprocess.STDOUT)
        )
        return self.processes[-1]

    def wait(self, count):
        from distributed import Client

        with Client(self.address, timeout=30, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=30)

    def stop(self):
        for process in reversed(self.processes):
            process.terminate()
        for process in self.processes:
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    made = Cluster(tmp_path_factory.mktemp("cluster"), workers=2)
    try:
        made.wait(2)
        yield made
    finally:
        made.stop()


def test_a_cluster_gives_the_tables_of_this_process(cluster, tmp_path):
    file = write_study(tmp_path)
    for name, way in {"serial": ("--jobs", 1), "dask": ("--scheduler", cluster.address)}.items():
        done = netsim("study", file, *way, "--out", tmp_path / name, "--no-report")
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith("8 trials in ")
    assert f"by 2 workers of {cluster.address}" in done.stdout
    same_tables(tmp_path / "dask", tmp_path / "serial")


def test_the_users_own_module_travels_and_is_renewed_when_it_changes(cluster, tmp_path):
    file = write_misbehaving(tmp_path, ["none", "raise"], repetitions=1)
    done = netsim("study", file, "--scheduler", cluster.address, "--out", tmp_path / "a", "--no-report")
    assert done.returncode == 1, done.stderr
    assert list(load_results(tmp_path / "a")["status"]) == ["ok", "failed"]
    assert "ValueError('as told') (misbehaving.py, line " in done.stderr
    module = tmp_path / "misbehaving.py"
    module.write_text(module.read_text().replace("as told", "otherwise"))
    done = netsim("study", file, "--scheduler", cluster.address, "--out", tmp_path / "b", "--no-report")
    assert done.returncode == 1
    assert "ValueError('otherwise')" in done.stderr


def test_a_trial_that_kills_its_workers_fails_and_the_rest_go_on(tmp_path, cluster):
    file = write_misbehaving(tmp_path, ["none", "kill once"], repetitions=4, set={"algorithm.wall_s": 0.1})
    out = tmp_path / "out"
    before = cluster.workers[1]
    cluster.workers.append(cluster.worker())
    cluster.wait(3)
    done = netsim("study", file, "--scheduler", cluster.address, "--out", out, "--no-report")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "marker").exists()
    wait_for(lambda: sum(process.poll() is not None for process in cluster.workers) == 1)
    assert before is cluster.workers[1]
    done = netsim("study", file, "--jobs", 1, "--out", tmp_path / "clean", "--no-report")
    assert done.returncode == 0, done.stderr
    same_tables(out, tmp_path / "clean")


def test_another_version_of_netsim_is_refused_naming_both(cluster):
    class Client:
        def run(self, ask):
            return {"tcp://a:1": versions(), "tcp://b:2": versions() | {"netsim": "9.9.9"}}

    with pytest.raises(NetsimError, match=rf"tcp://b:2 has netsim 9\.9\.9, this is netsim {re.escape(build_id())}"):
        _check_versions(Client(), cluster.address)
    outcome = run_trial(Task(0, 0, 0, "digest-0", "", netsim_version="9.9.9"))
    assert outcome.status == "failed"
    assert outcome.error == f"its worker has netsim {build_id()}, the study netsim 9.9.9: install the same"


def test_other_packages_of_workers_are_told_in_one_line():
    class Client:
        def __init__(self, numpy):
            self.numpy = numpy

        def run(self, ask):
            return {f"tcp://a:{number}": versions() | {"numpy": each} for number, each in enumerate(self.numpy)}

    own = versions()["numpy"]
    assert _check_versions(Client([own, own]), "tcp://s:1") == ()
    (told,) = _check_versions(Client([own, "1.0", "1.0"]), "tcp://s:1")
    assert told.endswith(f"workers of tcp://s:1 have other packages: numpy 1.0 on 2 of 3 (here {own})")


def test_a_scheduler_that_goes_away_ends_the_study_in_one_line(tmp_path):
    (tmp_path / "dask").mkdir()
    own = Cluster(tmp_path / "dask", workers=1)
    try:
        own.wait(1)
        file = write_misbehaving(tmp_path, ["none"], repetitions=20, set={"algorithm.wall_s": 0.1})
        out = tmp_path / "out"
        process = start("study", file, "--scheduler", own.address, "--out", out, "--no-report")
        wait_for(lambda: lines_of(out / "trials.jsonl") >= 2)
        own.scheduler.send_signal(signal.SIGKILL)
        _, err = process.communicate(timeout=30)
    finally:
        own.stop()
    assert process.returncode == 1
    last = err.splitlines()[-1]
    assert last.startswith(f"error: lost the Dask scheduler at {own.address}")
    assert last.endswith("--resume")
    assert "Traceback" not in err
    finished = lines_of(out / "trials.jsonl")
    done = netsim("study", file, "--jobs", 1, "--out", out, "--resume", "--no-report")
    assert done.returncode == 0, done.stderr
    assert f"{finished} are finished already" in done.stderr


def test_no_scheduler_there_is_one_line_and_quick(tmp_path):
    begun_s = time.monotonic()
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(NetsimError, match=f"no Dask scheduler answers at {address}; start one: dask scheduler"):
        DaskWorkers(address)
    assert time.monotonic() - begun_s < 20


def test_an_address_that_is_none():
    with pytest.raises(NetsimError, match="expected an address such as tcp://host:8786"):
        DaskWorkers("udp://what")


@pytest.mark.parametrize("address", ["", "foo://x", "tcp://127.0.0.1", "127.0.0.1:8786", "tcp://a:b"])
def test_an_address_that_is_none_is_one_line_and_leaves_nothing_behind(tmp_path, address):
    done = netsim("study", write_study(tmp_path), "--scheduler", address, "--out", tmp_path / "out")
    assert done.returncode == 2
    expected = f"error: --scheduler: expected an address such as tcp://host:8786, got `{address}`"
    assert done.stderr.splitlines() == [expected]
    assert not (tmp_path / "out").exists()
