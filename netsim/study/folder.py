"""The folder of a study: made, found again, cleared; and who may write into it."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.scenario.folder import first_free
from netsim.study.info import INFO_FILE, JOURNAL_FILE, NODES, RESULTS, STUDY_FILE, VARIANTS

RUNS = Path("runs")
PLOTS = "plots"
RESULT_FILES = (
    *(stem + suffix for stem in (RESULTS, NODES) for suffix in (".parquet", ".csv")),
    "report.md",
    "report.html",
    "summary.csv",
    "differences.csv",
)
"""Files that are made of the journal at the end, and can be made again."""
FILES = (INFO_FILE, STUDY_FILE, JOURNAL_FILE, *RESULT_FILES)
"""Files that a study writes."""


def study_folder(wanted: Path | None, name: str, *, resume: bool, force: bool) -> Path:
    """Make the folder of a study, or find the one to go on with. What it holds is not touched.

    Args:
        wanted: Where the user wants it; None takes the first free of `runs/NAME`, `runs/NAME-2`, ..., and with `resume`
            the last of them that holds a study.
        name: The study's name.
        resume: Whether to go on with what is there.
        force: Whether a study that is there may be replaced.

    Raises:
        ScenarioError: If it holds something that may not be touched, if there is nothing to resume, or if it cannot be
            made.
    """
    if resume:
        return _begun(wanted, name)
    try:
        if wanted is None:
            return first_free(RUNS, name)
        wanted.mkdir(parents=True, exist_ok=True)
        _refuse_others(wanted, force)
    except OSError as error:
        message = f"cannot write to {wanted or RUNS}: {error.strerror or error}; choose another folder (--out)"
        raise ScenarioError(message) from error
    return wanted


def holds_study(folder: Path) -> bool:
    """Whether a study has been begun in a folder."""
    return (folder / JOURNAL_FILE).is_file() or (folder / INFO_FILE).is_file()


def variant_folder(folder: Path, number: int) -> Path:
    """Where a variant's scenario lies in the study's folder."""
    return folder / VARIANTS / f"{number:03d}"


def clear(folder: Path) -> None:
    """Remove what a study wrote, but for its journal, which is held by whoever clears.

    Raises:
        ScenarioError: If something cannot be removed.
    """
    try:
        _unlink(folder, FILES)
        if (folder / VARIANTS).is_dir():
            shutil.rmtree(folder / VARIANTS)
    except OSError as error:
        message = f"cannot replace the study in {folder}: {error.strerror or error}; choose another folder (--out)"
        raise ScenarioError(message) from error


def clear_results(folder: Path) -> None:
    """Remove tables and report, which would say of the new study what was found in the old one.

    Raises:
        ScenarioError: If one cannot be removed.
    """
    try:
        _unlink(folder, RESULT_FILES)
    except OSError as error:
        message = f"cannot replace the results in {folder}: {error.strerror or error}; choose another folder (--out)"
        raise ScenarioError(message) from error


def _unlink(folder: Path, names: Sequence[str]) -> None:
    """Remove files, half-written ones with them, and the plots; not the journal, which is open."""
    for name in names:
        for path in (folder / name, folder / f"{name}.partial"):
            if path.name != JOURNAL_FILE:
                path.unlink(missing_ok=True)
    for path in (*(folder / PLOTS).glob("*.png"), *(folder / PLOTS).glob("*.svg")):
        path.unlink()


def _refuse_others(folder: Path, force: bool) -> None:
    if not any(folder.iterdir()):
        return
    if not holds_study(folder):
        message = f"{folder} holds files, but no study: choose another folder (--out)"
        raise ScenarioError(message)
    if not force:
        remedies = "go on with the study there (--resume), replace it (--force), or choose another folder (--out)"
        message = f"{folder} exists and is not empty: {remedies}"
        raise ScenarioError(message)


def _begun(wanted: Path | None, name: str) -> Path:
    if wanted is not None:
        if holds_study(wanted):
            return wanted
        message = f"{wanted} holds no study that could be resumed: give its folder (--out), or leave --resume out"
        raise ScenarioError(message)
    found, number = None, 1
    while (candidate := RUNS / (name if number == 1 else f"{name}-{number}")).exists():
        found = candidate if holds_study(candidate) else found
        number += 1
    if found is None:
        message = f"no study to resume at {RUNS / name}: say where it is (--out), or leave --resume out"
        raise ScenarioError(message)
    return found
