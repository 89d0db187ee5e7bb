"""The variants of a study: a scenario each, checked, with all it needs."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import blake2b
from pathlib import Path

from netsim.errors import Finding, ScenarioError
from netsim.reading import Document, Node, assign, dump_yaml, read_document, to_plain
from netsim.scenario.build import build
from netsim.scenario.inputs import Gathering, Input, modules_elsewhere
from netsim.scenario.load import LoadedScenario, inspect_document
from netsim.scenario.schema import Scenario
from netsim.study.axes import Combination
from netsim.study.schema import Level


@dataclass(frozen=True, slots=True)
class Variant:
    """One combination of the axes.

    Attributes:
        number: Counted from 0.
        levels: Its level on each axis.
        loaded: Its scenario, checked.
        text: The scenario resolved, to be run from a folder of its own.
        inputs: Files that this refers to.
        digest: Of what the scenario says, but for its name, description and repetition, and of its inputs.
    """

    number: int
    levels: dict[str, Level]
    loaded: LoadedScenario
    text: str
    inputs: tuple[Input, ...]
    digest: str


class Variants:
    """Makes the variants of one study; reads each scenario file once.

    Args:
        folder: What the names of scenario files are relative to.
        plugins: Whether algorithms named `module:Class` may be imported.

    Attributes:
        findings: What was found wrong so far.
    """

    def __init__(self, folder: Path, plugins: bool) -> None:
        self._folder = folder
        self._plugins = plugins
        self._read: dict[Path, Document] = {}
        self.findings: list[Finding] = []

    def variant(self, number: int, combination: Combination) -> Variant | None:
        """A variant, or None after noting what is wrong with it."""
        try:
            path, document = self._document(combination)
            loaded, findings = inspect_document(document, path, plugins=self._plugins)
        except ScenarioError as error:
            self.findings += error.findings or [_about(combination.scenario, str(error))]
            return None
        if loaded is None:
            self.findings += findings
            return None
        portable, inputs = Gathering(loaded).gather()
        if missing := [each for each in inputs if not each.source.is_file()]:
            self.findings += _missing(loaded, missing[0], combination)
            return None
        files = {each.name: each.source for each in inputs} | modules_elsewhere(loaded)
        digest = _digest(replace(portable, name="-", description="", repetition=0), files)
        return Variant(number, dict(combination.levels), loaded, dump_yaml(portable), tuple(inputs), digest)

    def _document(self, combination: Combination) -> tuple[Path, Document]:
        name = combination.scenario
        path = self._folder / str(name.value)
        if path not in self._read:
            if not path.is_file():
                raise ScenarioError([_about(name, f"expected an existing scenario file, got `{name.value}`")])
            self._read[path] = _scenario_document(path, name)
        document = self._read[path]
        for target, value in combination.values:
            document = assign(document, target, value)
        return path, document


def _scenario_document(path: Path, name: Node) -> Document:
    """A scenario file as read; a study in its place is refused in one line instead of many."""
    document = read_document(path)
    kind = document.root.child("kind")
    if kind is not None and kind.value == "study":
        text = f"expected a scenario file, got `{name.value}`, which is a study"
        raise ScenarioError([_about(name, text)])
    return document


def _missing(loaded: LoadedScenario, first: Input, combination: Combination) -> list[Finding]:
    """What to say of files that are not there: what a run would say."""
    try:
        build(loaded)
    except ScenarioError as error:
        return list(error.findings) or [_about(_where(combination), str(error))]
    return [_about(_where(combination), f"expected an existing file, got `{first.source}`")]


def _where(combination: Combination) -> Node:
    return combination.values[-1][1] if combination.values else combination.scenario


def _about(node: Node, text: str) -> Finding:
    return Finding(node.file, node.line, "scenario", text, "")


def _digest(scenario: Scenario, files: Mapping[str, Path]) -> str:
    """Of all that decides a trial's figures but the repetition.

    Args:
        scenario: Resolved, without what is only said of it.
        files: What it refers to, by name.
    """
    digest = blake2b(json.dumps(to_plain(scenario), sort_keys=True).encode(), digest_size=12)
    for name, path in sorted(files.items()):
        digest.update(b"\0" + name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
