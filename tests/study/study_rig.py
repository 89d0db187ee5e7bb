"""Small studies for tests, and algorithms that misbehave."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
QUICKSTART = ROOT / "scenarios" / "quickstart.yaml"

MISBEHAVING = '''
"""Algorithms that fail as their parameters say."""

import os
import signal
import time
from pathlib import Path

from netsim.parameters import parameters


@parameters
class Parameters:
    """What is to go wrong."""

    deed: str = "none"
    marker: str = ""
    wall_s: float = 0.0


class Misbehaving:
    """Does its deed on one node: raises, kills its process always, or only until the marker is there."""

    Parameters = Parameters

    def __init__(self, parameters):
        self.parameters = parameters

    def run(self, node):
        yield from node.pause(1_000_000 * (1 + node.id))
        if node.id == 0:
            time.sleep(self.parameters.wall_s)
            self.do(self.parameters.deed)
        node.broadcast("hello", bytes([node.id]))

    def do(self, deed):
        if deed == "raise":
            raise ValueError("as told")
        if deed == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if deed == "kill once" and not Path(self.parameters.marker).exists():
            Path(self.parameters.marker).write_text("killed")
            os.kill(os.getpid(), signal.SIGKILL)
        if deed == "raise once" and not Path(self.parameters.marker).exists():
            Path(self.parameters.marker).write_text("raised")
            raise ValueError("only once")
'''


def write_study(folder: Path, **changes: Any) -> Path:
    """A study of quickstart cut short: two tolerances on two rungs, two repetitions."""
    study = {
        "kind": "study",
        "schema_version": 1,
        "name": "small",
        "question": "What does tolerance save?",
        "scenario": str(QUICKSTART),
        "set": {"duration_s": 8, "algorithm.rounds": 2},
        "repetitions": 2,
        "sweep": [
            {"path": "algorithm.tolerance", "values": [0, 1]},
            {"path": "fidelity", "values": ["ideal", "csma"]},
        ],
    }
    path = folder / "study.yaml"
    path.write_text(json.dumps({key: value for key, value in {**study, **changes}.items() if value is not ...}))
    return path


def write_misbehaving(folder: Path, deeds: list[str], **changes: Any) -> Path:
    """A study with a variant for each deed of the user's own algorithm."""
    (folder / "misbehaving.py").write_text(MISBEHAVING)
    scenario = {
        "kind": "scenario",
        "extends": str(QUICKSTART),
        "duration_s": 1,
        "algorithm": {"type": "misbehaving:Misbehaving", "marker": str(folder / "marker")},
    }
    (folder / "base.yaml").write_text(json.dumps(scenario))
    sweep = [{"path": "algorithm.deed", "values": deeds}]
    return write_study(folder, **{"scenario": "base.yaml", "set": {}, "sweep": sweep, **changes})


def start(*arguments: object, cwd: Path | None = None) -> subprocess.Popen[str]:
    """Start `netsim`."""
    return subprocess.Popen(
        [sys.executable, "-m", "netsim", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def wait_for(condition: Callable[[], bool], timeout_s: float = 60.0) -> None:
    """Wait until something is so."""
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, "waited in vain"
        time.sleep(0.02)


def lines_of(path: Path) -> int:
    """Whole lines of a file."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def children_of(pid: int) -> list[int]:
    """The worker processes of a process."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
            command = (stat.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(fields[1]) == pid and b"spawn_main" in command:
            found.append(int(stat.parent.name))
    return found


def is_alive(pid: int) -> bool:
    """Whether a process runs: not ended, not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def same_tables(first: Path, second: Path) -> None:
    """Two studies gave the same tables, byte for byte."""
    for name in ("results.csv", "nodes.csv"):
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
