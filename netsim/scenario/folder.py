"""The folder of a run: which files it holds, and how they get there."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from netsim.errors import ScenarioError, TraceError
from netsim.scenario.inputs import INPUTS, Input
from netsim.trace.writer import partial_path

TRACE_FILE = "trace.mcap"
METRICS_FILE = "metrics.json"
RUN_FILE = "run.json"
SCENARIO_FILE = "scenario.yaml"
FILES = (TRACE_FILE, METRICS_FILE, RUN_FILE, SCENARIO_FILE, partial_path(Path(TRACE_FILE)).name)


def new_folder(wanted: Path | None, name: str, force: bool) -> Path:
    """Make the folder of a run.

    Args:
        wanted: Where the user wants it; None takes the first free of `runs/NAME`, `runs/NAME-2`, ...
        name: The scenario's name.
        force: Whether the files of an earlier run in `wanted` may be replaced.

    Raises:
        ScenarioError: If it exists and holds something, or cannot be made.
    """
    try:
        if wanted is None:
            return first_free(Path("runs"), name)
        wanted.mkdir(parents=True, exist_ok=True)
        _clear(wanted, force)
    except OSError as error:
        message = f"cannot write to {wanted or 'runs'}: {error.strerror or error}; choose another folder"
        raise ScenarioError(message) from error
    return wanted


def write_file(path: Path, text: str) -> None:
    """Write a file as a whole or not at all.

    Raises:
        TraceError: If it cannot be written.
    """
    partial = path.with_name(path.name + ".partial")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    except OSError as error:
        message = f"cannot write {path}: {error.strerror or error}"
        raise TraceError(message) from error


def copy_inputs(folder: Path, inputs: Sequence[Input]) -> None:
    """Put copies of what the scenario refers to beside its resolved form.

    Raises:
        TraceError: If one cannot be read or written.
    """
    for each in inputs:
        target = folder / each.name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            content = each.source.read_bytes()
            target.unlink(missing_ok=True)  # it may be a link that other folders share
            target.write_bytes(content)
        except OSError as error:
            message = f"cannot copy {each.source} to {target}: {error.strerror or error}"
            raise TraceError(message) from error


def discard(folder: Path) -> None:
    """Take back a folder in which nothing was run: what the trace left, and the folder itself if it is empty then."""
    with suppress(OSError):
        partial_path(folder / TRACE_FILE).unlink(missing_ok=True)
        folder.rmdir()


def _clear(folder: Path, force: bool) -> None:
    present = {path.name for path in folder.iterdir()}
    if present and not force:
        message = f"{folder} exists and is not empty: choose another folder (--out), or replace the run there (--force)"
        raise ScenarioError(message)
    if present and not present & {*FILES, INPUTS}:
        message = f"{folder} holds files, but no run that could be replaced: choose another folder"
        raise ScenarioError(message)
    for file in FILES:
        (folder / file).unlink(missing_ok=True)


def first_free(parent: Path, name: str) -> Path:
    """Make the first folder of NAME, NAME-2, ... that is not there yet, also if another run is looking for one."""
    number = 1
    while True:
        candidate = parent / (name if number == 1 else f"{name}-{number}")
        try:
            candidate.mkdir(parents=True)
        except FileExistsError:
            number += 1
        else:
            return candidate
