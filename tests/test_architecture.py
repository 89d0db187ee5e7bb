"""Who may import whom, as a table; and what stays out of the way of a plain import."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "netsim"

ALL = {"units", "errors", "parameters"}
"""What every room may import."""

EVERYTHING = {"*"}

# room: the rooms it may import besides itself and ALL. A dotted name stands for that module alone.
MAY_IMPORT = {
    "units": set(),
    "errors": set(),
    "parameters": set(),
    "files": set(),
    "rng": set(),
    "codec": set(),
    "kernels": set(),
    "reading": set(),
    "models": {"kernels", "rng", "reading"},
    "trace": set(),
    "problems": {"kernels", "models", "rng", "trace.events"},
    "api": {"trace.events"},
    "protocols": {"api", "kernels", "codec", "trace.events"},
    "algorithms": {"api", "kernels", "codec", "trace.events", "protocols"},
    "sim": {"api", "models", "rng", "trace.events", "trace.recorder"},
    "audit": {"trace", "models.device_tables"},
    "flow": {"trace"},
    "metrics": {"trace", "kernels", "flow.rounds"},
    "snapshots": {"trace", "kernels", "metrics", "flow.drawing", "flow.look"},
    "sequence": {"files", "trace", "metrics.causes", "metrics.traffic", "replay.style"},
    "calibrate": {"kernels", "models"},
    "replay": {"files", "trace", "flow.rounds", "flow.layout"},
    "export": {"trace", "replay.style"},
    "study": {"scenario", "metrics", "reading", "trace"},
    "testing": {"api", "sim", "models", "trace", "rng"},
    "movie": {"files", "trace"}
    | {f"replay.{part}" for part in ("check", "flights", "flying", "motion", "options", "style")},
    "scenario": EVERYTHING,
    "cli": EVERYTHING,
    "__main__": {"cli"},
    "__init__": EVERYTHING,
}
STRICTER = {
    "units": set(),
    "errors": set(),
    "parameters": set(),
    "rng": set(),
    "codec": set(),
    "kernels": {"errors"},
    "reading": {"errors", "parameters", "units"},
}
"""Rooms that may not import even all of ALL."""

NOBODY_BUT = {"reading": {"models", "scenario", "cli", "study"}, "testing": set()}
"""Rooms that only these may import, whatever the table above says."""

ONLY_IN = {
    "simpy": {"sim", "testing"},
    "rerun": {"replay"},
    "mcap": {"trace", "export"},
    "typer": {"cli"},
    "rich": {"cli"},
}
ONLY_IN["matplotlib"] = {"calibrate", "flow", "movie", "snapshots", "study"}
ONLY_IN["av"] = {"movie"}
"""Libraries that have one room."""

FORBIDDEN_IN = {"kernels": {"simpy", "pathlib", "os", "time", "random", "asyncio", "threading"}}


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def name_of(path: Path) -> str:
    """`netsim/sim/mac/csma.py` is `sim.mac.csma`, `netsim/sim/__init__.py` is `sim`."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" and len(parts) > 1 else parts)


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """Every module named in an import, at whatever depth of the code, with its line."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            module = node.module or ""
            submodules = [alias.name for alias in node.names if is_module(f"{module}.{alias.name}")]
            yield from ((node.lineno, f"{module}.{name}") for name in submodules)
            if not submodules:
                yield node.lineno, module


def is_module(dotted: str) -> bool:
    path = PACKAGE.parent.joinpath(*dotted.split("."))
    return dotted.startswith("netsim.") and (path.is_dir() or path.with_suffix(".py").exists())


def allowed(room: str, target: str) -> bool:
    """Whether a room may import a module of ours, both as dotted names below `netsim`."""
    first = target.split(".")[0]
    if first in NOBODY_BUT and room not in NOBODY_BUT[first] | {first}:
        return False
    if target == "__init__":
        return True  # the package itself: its version
    if first == room or MAY_IMPORT[room] == EVERYTHING:
        return True
    if first in ALL:
        return first in STRICTER.get(room, ALL)
    return any(target == entry or target.startswith(f"{entry}.") for entry in MAY_IMPORT[room])


def test_every_room_is_in_the_table():
    assert {name_of(path).split(".")[0] for path in modules()} <= set(MAY_IMPORT)


@pytest.mark.parametrize("path", modules(), ids=name_of)
def test_a_module_imports_only_what_its_room_may(path):
    room = name_of(path).split(".")[0]
    wrong = [
        f"{path.name}:{line}: {room} imports {target}"
        for line, target in imports(path)
        if target.split(".")[0] == "netsim"
        and not allowed(room, target.removeprefix("netsim").lstrip(".") or "__init__")
    ]
    assert wrong == []


@pytest.mark.parametrize("path", modules(), ids=name_of)
def test_libraries_stay_in_their_rooms(path):
    room = name_of(path).split(".")[0]
    libraries = {target.split(".")[0] for _, target in imports(path)}
    outside = {name for name in libraries if name in ONLY_IN and room not in ONLY_IN[name]}
    assert outside == set()
    assert libraries & FORBIDDEN_IN.get(room, set()) == set()


def test_the_table_refuses_what_it_should():
    assert not allowed("algorithms", "sim.handle")
    assert not allowed("algorithms", "models.reception")
    assert not allowed("kernels", "parameters")
    assert not allowed("sim", "trace.writer")
    assert not allowed("sim", "algorithms.registry")
    assert not allowed("metrics", "scenario.load")
    assert not allowed("algorithms", "reading")
    assert not allowed("scenario", "testing")
    assert allowed("algorithms", "trace.events")
    assert allowed("sim", "trace.recorder")
    assert allowed("models", "reading.checks")


def loaded_by(module: str) -> set[str]:
    """The modules that a fresh interpreter has loaded after an import."""
    code = f"import sys, {module}; print(*sys.modules, sep='\\n')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


HEAVY = {"rerun", "matplotlib", "scipy.optimize", "pyarrow", "dask"}


@pytest.mark.parametrize("module", ["netsim", "netsim.api", "netsim.cli"])
def test_an_import_does_not_load_what_it_does_not_need(module):
    if not is_module(module) and module != "netsim":
        pytest.skip(f"{module} is not there")
    assert loaded_by(module) & HEAVY == set()


def test_an_algorithm_can_be_written_without_loading_the_simulator():
    assert not {name for name in loaded_by("netsim.api") if name.split(".")[0] == "simpy"}
