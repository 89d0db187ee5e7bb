"""What is compared: a run's figures, scenario and versions, from its folder or from its trace alone."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from netsim.errors import ScenarioError, TraceError
from netsim.metrics.catalogue import flatten
from netsim.metrics.collect import metrics_of
from netsim.reading import parse
from netsim.reading.reasons import why_unreadable
from netsim.scenario.folder import METRICS_FILE, RUN_FILE, SCENARIO_FILE, TRACE_FILE
from netsim.study.info import INFO_FILE
from netsim.trace.reader import read_trace, trace_attachment, trace_metadata


@dataclass(frozen=True)
class Contender:
    """A run to be compared with others.

    Attributes:
        name: What it was called on the command line.
        figures: Its scalar metrics, those in dictionaries by dotted names.
        lists: Its list-valued metrics.
        scenario: Its resolved scenario; None if it is not at hand.
        versions: Of netsim, Python and packages, as far as they are known.
        trace: Its trace; None if it has none.
    """

    name: str
    figures: Mapping[str, Any]
    lists: Mapping[str, Sequence[Any]]
    scenario: Any
    versions: Mapping[str, str]
    trace: Path | None


def are_studies(paths: Sequence[Path]) -> bool:
    """Whether paths are folders of studies, rather than runs.

    Raises:
        ScenarioError: If there are fewer than two of them, one is missing or given twice, or they are of both kinds.
    """
    if len(paths) < 2:
        message = f"expected two or more runs to compare, got {len(paths)}"
        raise ScenarioError(message)
    seen: dict[Path, Path] = {}
    for path in paths:
        if not path.exists():
            message = f"{path}: expected the folder of a run or study, or a trace, got no such file"
            raise ScenarioError(message)
        if path.resolve() in seen:
            message = f"{path}: expected different runs, got the same one twice ({seen[path.resolve()]})"
            raise ScenarioError(message)
        seen[path.resolve()] = path
    studies = [(path / INFO_FILE).exists() for path in paths]
    if any(studies) and not all(studies):
        study, run = paths[studies.index(True)], paths[studies.index(False)]
        message = f"expected runs only or studies only, got the study {study} and the run {run}"
        raise ScenarioError(message)
    return all(studies)


def contender(path: Path) -> Contender:
    """A run to be compared, from its folder or its trace.

    Raises:
        ScenarioError: If there is no finished run, or what it left cannot be read.
    """
    return _from_folder(path) if path.is_dir() else _from_trace(path)


def _from_folder(folder: Path) -> Contender:
    if not (folder / METRICS_FILE).exists():
        message = (
            f"{folder}: expected the folder of a finished run, got one without {METRICS_FILE}; a run that was killed leaves "
            "a trace, which can be given instead"
        )
        raise ScenarioError(message)
    figures = _mapping(folder / METRICS_FILE)
    run = _mapping(folder / RUN_FILE) if (folder / RUN_FILE).exists() else {}
    scenario = folder / SCENARIO_FILE
    trace = folder / TRACE_FILE
    return Contender(
        str(folder),
        flatten(figures),
        _lists(figures),
        parse(_text(scenario), str(scenario)).plain() if scenario.exists() else None,
        dict(_versions(run)),
        trace if trace.exists() else None,
    )


def _from_trace(trace: Path) -> Contender:
    try:
        metadata = trace_metadata(trace)
        figures = _trace_figures(trace)
    except TraceError as error:
        raise ScenarioError(str(error)) from error
    try:
        name = f"{trace}: {SCENARIO_FILE}"
        scenario = parse(trace_attachment(trace, SCENARIO_FILE).decode(), name).plain()
    except TraceError:
        scenario = None
    versions = {"netsim": metadata["netsim_version"]} if "netsim_version" in metadata else {}
    return Contender(str(trace), flatten(figures), _lists(figures), scenario, versions, trace)


def _trace_figures(trace: Path) -> Mapping[str, Any]:
    """The metrics that a trace carries; of a run that was killed, those of the part that is there."""
    try:
        attached = trace_attachment(trace, METRICS_FILE)
    except TraceError:
        return metrics_of(read_trace(trace))
    return _parsed(attached.decode(), f"{trace}: {METRICS_FILE}")


def _lists(figures: Mapping[str, Any]) -> dict[str, Sequence[Any]]:
    return {name: value for name, value in figures.items() if isinstance(value, list)}


def _versions(run: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name in ("netsim", "python"):
        if f"{name}_version" in run:
            yield name, str(run[f"{name}_version"])
    packages = run.get("package_versions")
    if isinstance(packages, Mapping):
        yield from ((str(name), str(version)) for name, version in packages.items())


def _mapping(path: Path) -> Mapping[str, Any]:
    return _parsed(_text(path), str(path))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        message = f"{path}: cannot read it: {why_unreadable(path, error)}"
        raise ScenarioError(message) from error


def _parsed(text: str, where: str) -> Mapping[str, Any]:
    try:
        found = json.loads(text)
    except ValueError as error:
        message = f"{where}: expected JSON: {error}"
        raise ScenarioError(message) from error
    if not isinstance(found, dict):
        message = f"{where}: expected a JSON object, got {type(found).__name__}"
        raise ScenarioError(message)
    return found
