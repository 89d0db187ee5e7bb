"""Whole commands: runs that repeat themselves byte for byte, interruption, templates, the public interface."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from in_process import netsim as command

import netsim
from netsim.metrics.collect import metrics_of
from netsim.trace.reader import is_complete, read_trace, trace_attachment

FILES = ("trace.mcap", "metrics.json", "scenario.yaml")


def as_process(*arguments: str, hash_seed: str = "0", cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run `netsim` as a process of its own."""
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
    return subprocess.run(
        [sys.executable, "-m", "netsim", *arguments],
        capture_output=True,
        text=True,
        env=environment,
        cwd=cwd,
        check=False,
    )


def test_equal_seeds_give_equal_bytes_whatever_the_hash_seed(scenarios: Path, tmp_path: Path) -> None:
    scenario = str(scenarios / "quickstart.yaml")
    outs = [tmp_path / name for name in ("a", "b", "c")]
    for out, hash_seed in zip(outs[:2], ("0", "12345"), strict=True):
        assert as_process("run", scenario, "--out", str(out), hash_seed=hash_seed).returncode == 0
    assert command("run", scenario, "--out", outs[2]).returncode == 0
    for name in FILES:
        assert len({(out / name).read_bytes() for out in outs}) == 1, name
    other = tmp_path / "other"
    assert command("run", scenario, "--seed", "2", "--out", other).returncode == 0
    assert (other / "trace.mcap").read_bytes() != (outs[0] / "trace.mcap").read_bytes()
    bare = tmp_path / "bare"
    assert command("run", scenario, "--no-trace", "--out", bare).returncode == 0
    assert (bare / "metrics.json").read_bytes() == (outs[0] / "metrics.json").read_bytes()
    assert not (bare / "trace.mcap").exists()


def test_metrics_are_a_function_of_the_trace(scenarios: Path, tmp_path: Path) -> None:
    result = netsim.run(scenarios / "quickstart.yaml", folder=tmp_path / "run")
    assert result.trace is not None
    again = metrics_of(read_trace(result.trace))
    assert {key: result.metrics[key] for key in again} == again
    assert json.loads(trace_attachment(result.trace, "metrics.json")) == result.metrics
    assert trace_attachment(result.trace, "scenario.yaml") == (tmp_path / "run" / "scenario.yaml").read_bytes()


def test_losses_are_the_same_at_every_level_of_detail(scenarios: Path) -> None:
    levels = {}
    for level in ("summary", "frames", "full"):
        loaded = netsim.load(scenarios / "lifetime.yaml", [f"trace.detail={level}", "duration_s=2"])
        levels[level] = netsim.run(loaded, trace=False).metrics["frames_lost_by_reason"]
    assert levels["summary"] == levels["frames"] == levels["full"]
    assert levels["frames"]


def test_the_resolved_scenario_gives_the_same_run(scenarios: Path, tmp_path: Path) -> None:
    first = netsim.run(scenarios / "quickstart.yaml", folder=tmp_path / "first")
    second = netsim.run(tmp_path / "first" / "scenario.yaml", trace=False)
    assert first.metrics == second.metrics


def test_run_says_what_it_did(scenarios: Path, tmp_path: Path) -> None:
    ended = command("run", str(scenarios / "quickstart.yaml"), cwd=tmp_path)
    assert ended.returncode == 0
    for words in (
        "association error",
        "exact MAP",
        "graph messages per sensor",
        "frames",
        "data",
        "energy",
        "wall time",
    ):
        assert words in ended.stdout
    run_json = json.loads((tmp_path / "runs" / "quickstart" / "run.json").read_text())
    assert run_json["netsim_version"] == netsim.__version__
    assert run_json["wall_s"] > 0
    again = command("run", str(scenarios / "quickstart.yaml"), cwd=tmp_path)
    assert again.returncode == 0
    assert (tmp_path / "runs" / "quickstart-2" / "metrics.json").exists()


def test_interruption_closes_the_files(scenarios: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    arguments = (
        "--set",
        "algorithm={type: neighbour-traffic, rounds: 100000}",
        "--duration",
        "100000",
        "--out",
        str(out),
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "netsim", "run", str(scenarios / "quickstart.yaml"), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not (out / "trace.partial.mcap").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert "interrupted" in stdout
    assert json.loads((out / "metrics.json").read_text())["interrupted"] is True
    assert is_complete(out / "trace.mcap")
    assert sum(1 for _ in read_trace(out / "trace.mcap")) > 100


def test_killed_run_leaves_a_readable_trace(scenarios: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    arguments = (
        "--set",
        "algorithm={type: neighbour-traffic, rounds: 100000}",
        "--duration",
        "100000",
        "--out",
        str(out),
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "netsim", "run", str(scenarios / "quickstart.yaml"), *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    partial = out / "trace.partial.mcap"
    deadline = time.monotonic() + 90
    while time.monotonic() < deadline and not (partial.exists() and partial.stat().st_size > 500_000):
        time.sleep(0.1)
    process.kill()
    process.wait()
    assert partial.stat().st_size > 500_000  # more than one chunk: the first is whole
    with pytest.warns(UserWarning, match="cut short"):
        assert sum(1 for _ in read_trace(partial)) > 1000


def test_template_runs_and_passes_its_test(tmp_path: Path) -> None:
    assert command("new", "algorithm", "my-gossip", cwd=tmp_path).returncode == 0
    assert len((tmp_path / "my_gossip.py").read_text().splitlines()) < 40
    checked = command("check", "my_gossip.yaml", cwd=tmp_path)
    assert checked.returncode == 0
    assert "my_gossip:MyGossip was imported" in checked.stdout
    assert command("run", "my_gossip.yaml", cwd=tmp_path).returncode == 0
    tested = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert tested.returncode == 0, tested.stdout
    wrong = command("run", "my_gossip.yaml", "--set", "algorithm.rounds=0", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "algorithm.rounds" in wrong.stderr
    assert command("new", "algorithm", "my-gossip", cwd=tmp_path).returncode == 2


def test_failing_algorithm_is_reported_and_the_others_go_on(tmp_path: Path) -> None:
    (tmp_path / "faulty.py").write_text(
        "class Faulty:\n"
        "    def run(self, node):\n"
        "        yield from node.pause(1000)\n"
        "        if node.id == 1:\n"
        "            raise ValueError('odd')\n"
        "        node.broadcast('hello', b'x')\n"
        "        yield from node.pause(1_000_000_000)\n"
    )
    (tmp_path / "s.yaml").write_text(
        "kind: scenario\nschema_version: 1\nname: faulty\nnodes:\n  - name: n\n"
        "    placement: {type: grid, rows: 1, columns: 3, spacing_m: 5}\nalgorithm: {type: 'faulty:Faulty'}\n"
    )
    ended = as_process("run", "s.yaml", "--out", "out", cwd=tmp_path)
    assert ended.returncode == 1
    assert ended.stderr == "error: node 1: the algorithm raised ValueError('odd') (faulty.py, line 5)\n"
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert (metrics["nodes_finished"], metrics["nodes_failed"], metrics["radio_messages"]) == (2, 1, 2)


def test_list_and_schema(scenarios: Path) -> None:
    listed = command("list")
    assert listed.returncode == 0
    assert all(word in listed.stdout for word in ("csmp", "cc2420", "quickstart.yaml"))
    printed = command("schema")
    assert printed.stdout == (scenarios / "netsim.schema.json").read_text(), (
        "run: netsim schema > scenarios/netsim.schema.json"
    )
    assert "| `duration_s` |" in command("schema", "--reference").stdout


@pytest.mark.parametrize(
    "path", sorted(Path(__file__).parents[2].glob("scenarios/**/*.yaml")), ids=lambda path: path.stem
)
def test_shipped_scenarios_are_valid_and_name_the_schema(path: Path) -> None:
    first = path.read_text().splitlines()[0]
    assert first.startswith("# yaml-language-server: $schema=")
    assert (path.parent / first.partition("=")[2]).resolve().is_file()
    assert command("check", str(path)).returncode == 0


def test_a_run_carries_what_its_scenario_refers_to(tmp_path: Path) -> None:
    """The resolved scenario runs again, and gives the same bytes, with nothing but the run's folder."""
    home = tmp_path / "home"
    home.mkdir()
    (home / "mine.csv").write_text("id,x_m,y_m\n5,1,1\n6,9,9\n")
    (home / "chain.uai").write_text("MARKOV\n2\n2 2\n1\n2 0 1\n4\n 1 2 3 4\n")
    (home / "talk.py").write_text(
        "class Talk:\n    def run(self, node):\n        node.broadcast('hi', b'x')\n        yield from node.pause(1)\n"
    )
    (home / "s.yaml").write_text(
        "kind: scenario\nschema_version: 1\nname: carried\nduration_s: 5\n"
        "nodes:\n  - name: a\n    placement: {type: csv, file: mine.csv}\n    algorithm: {type: 'talk:Talk'}\n"
        "problem: {type: factor-graph, graph: {type: file, path: chain.uai}}\nalgorithm: {type: sum-product, rounds: 2}\n"
    )
    assert command("run", "s.yaml", "--out", str(tmp_path / "first"), cwd=home).returncode == 0
    for file in home.iterdir():
        if file.is_file():
            file.unlink()
    again = command("run", str(tmp_path / "first" / "scenario.yaml"), "--out", str(tmp_path / "second"), cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    for name in ("trace.mcap", "metrics.json"):
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()


def test_a_scenario_that_cannot_be_built_leaves_no_folder(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(
        "kind: scenario\nschema_version: 1\nname: bad\nnodes:\n  - name: n\n"
        "    placement: {type: poisson-disk, count: 50, min_distance_m: 90}\nalgorithm: {type: neighbour-traffic}\n"
    )
    ended = command("run", "s.yaml", cwd=tmp_path)
    assert ended.returncode == 2
    assert list((tmp_path / "runs").iterdir()) == []


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("yield node.pause(1)", "yielded an operation: write `yield from`"),
        ("yield 5", "yielded 5: write `yield from`"),
        ("return None", "not a generator: wait for something with `yield from`"),
        ("raise SystemExit(0)\n        yield", "the algorithm raised SystemExit(0)"),
        (
            "node.pause(1)\n        yield from node.pause(2)",
            "node.pause(...) was called before this without `yield from`",
        ),
        ("node.receive()\n        if False:\n            yield", "node.receive(...) was called without `yield from`"),
        ("yield from node.pause(0.5)", "pause takes a whole number, got 0.5"),
        ("node.send(99, 'x', b'')\n        yield", "sent a 'x' message to node 99, which does not exist"),
        ("node.send(node.id, 'x', b'')\n        yield", "to itself"),
        ("node.broadcast('x', 'text')\n        yield", "is str, not bytes"),
        (
            "from netsim.trace.events import NodeLife\n        node.record(NodeLife(1, 'died', ''))\n        yield",
            "an algorithm cannot record a NodeLife",
        ),
        (
            "from netsim.trace.events import Role\n        node.record(Role(node.id + 1, 'leader', 1))\n        yield",
            "a node speaks for itself",
        ),
    ],
)
def test_beginners_errors_are_told_with_their_line(body: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(f"class Mine:\n    def run(self, node):\n        {body}\n")
    (tmp_path / "s.yaml").write_text(
        "kind: scenario\nschema_version: 1\nname: mine\nnodes:\n  - name: n\n"
        "    placement: {type: grid, rows: 1, columns: 2, spacing_m: 5}\nalgorithm: {type: 'mine:Mine'}\n"
    )
    ended = command("run", "s.yaml", "--out", "out", cwd=tmp_path)
    assert ended.returncode == 1
    assert told in ended.stderr
    assert ended.stderr.startswith("error: node")
    if "generator" not in told and "yielded" not in told and "receive" not in told:
        assert "mine.py, line" in ended.stderr
    assert (tmp_path / "out" / "metrics.json").exists()


def test_time_that_stands_still_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from netsim.errors import AlgorithmError
    from netsim.sim import simulation
    from netsim.testing import run_algorithm

    class Still:
        def run(self, node: object) -> object:
            while True:
                yield from node.pause(0)  # type: ignore[attr-defined]

    monkeypatch.setattr(simulation, "STEPS_AT_ONE_INSTANT", 5_000)
    with pytest.raises(AlgorithmError, match="time stands still at 0 s"):
        run_algorithm(Still(), nodes=2)  # type: ignore[arg-type]
