"""A study file becomes a plan: every variant's scenario, checked, with all it needs, before anything runs."""

import platform
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

from netsim import __version__
from netsim.errors import Finding, ScenarioError
from netsim.reading import Document, Node, assign, check_document, dump_yaml, read_document
from netsim.scenario.folder import SCENARIO_FILE, copy_inputs, write_file
from netsim.scenario.inputs import Gathering, Input
from netsim.scenario.load import LoadedScenario, inspect_document
from netsim.study.axes import Combination, axis_findings, combinations, settings_of
from netsim.study.info import (
    INFO_FILE,
    STUDY_FILE,
    VARIANTS,
    AxisInfo,
    PublishedInfo,
    StudyInfo,
    VariantInfo,
)
from netsim.study.schema import Axis, Level, Study
from netsim.study.trial import Task

PACKAGES = ("simpy", "numpy", "scipy", "networkx")
"""Those that figures depend on."""


@dataclass(frozen=True, slots=True)
class Variant:
    """One combination of the axes.

    Attributes:
        number: Counted from 0.
        levels: Its level on each axis.
        loaded: Its scenario, checked.
        text: The scenario resolved, to be run from a folder of its own.
        inputs: Files that this refers to.
        digest: Of text and inputs.
    """

    number: int
    levels: dict[str, Level]
    loaded: LoadedScenario
    text: str
    inputs: tuple[Input, ...]
    digest: str


@dataclass(frozen=True)
class Plan:
    """A study that can be run.

    Attributes:
        study: What was asked.
        path: Its file.
        document: What was read.
        variants: Every combination.
    """

    study: Study
    path: Path
    document: Document
    variants: tuple[Variant, ...]

    @property
    def repetitions(self) -> range:
        """The repetitions' numbers."""
        return range(self.study.first_repetition, self.study.first_repetition + self.study.repetitions)

    @cached_property
    def axes(self) -> tuple[AxisInfo, ...]:
        """The axes with the names of their settings."""
        sweep = self.document.root.child("sweep")
        nodes = sweep.value if sweep is not None and isinstance(sweep.value, list) else []
        return tuple(_axis_info(axis, node) for axis, node in zip(self.study.sweep, nodes, strict=True))

    def tasks(self, folder: Path) -> list[Task]:
        """Every trial: all variants of a repetition, then the next one, so that an early look is a fair one."""
        pairs = [(repetition, variant) for repetition in self.repetitions for variant in self.variants]
        return [
            Task(
                trial=number,
                variant=variant.number,
                repetition=repetition,
                key=f"{variant.digest}-{repetition}",
                folder=str(variant_folder(folder, variant.number).resolve()),
            )
            for number, (repetition, variant) in enumerate(pairs)
        ]

    def info(self, command: str) -> StudyInfo:
        """What the study's folder is to say of it."""
        study = self.study
        compare = study.compare
        axes = {axis.name: axis for axis in self.axes}
        axis = compare.axis if compare is not None else next(iter(axes), None)
        baseline = compare.baseline if compare is not None else None
        return StudyInfo(
            name=study.name,
            question=study.question,
            description=study.description,
            axes=self.axes,
            variants=tuple(
                VariantInfo(each.number, each.levels, each.digest, each.loaded.scenario.name) for each in self.variants
            ),
            seeds=tuple(sorted({each.loaded.scenario.seed for each in self.variants})),
            repetitions=tuple(self.repetitions),
            metrics=study.metrics,
            error=study.error,
            costs=study.costs,
            compare_axis=axis,
            baseline=axes[axis].levels[0] if axis is not None and baseline is None else baseline,
            published=tuple(
                PublishedInfo(each.metric, each.value, each.at, each.standard_error, each.source, each.note)
                for each in study.published
            ),
            sources=(),
            command=command,
            versions=versions(),
        )


def load_plan(path: Path | str, overrides: Sequence[str] = (), *, plugins: bool = True) -> Plan:
    """Read and check a study with all its variants.

    Args:
        path: The study file.
        overrides: `path=value` each, applied over the study file, such as `repetitions=3`.
        plugins: Whether algorithms named `module:Class` may be imported.

    Raises:
        ScenarioError: With every finding; those about a variant's values name the line of the study that set them.
    """
    path = Path(path)
    document = read_document(path, overrides)
    study, findings = check_document(document, Study)
    findings = findings or list(axis_findings(study, document))
    if findings:
        raise ScenarioError(findings)
    made = _Variants(path.parent, study, plugins)
    variants = [made.variant(number, each) for number, each in enumerate(combinations(study, document))]
    if made.findings:
        raise ScenarioError(list(dict.fromkeys(made.findings)))
    return Plan(study, path, document, tuple(each for each in variants if each is not None))


def variant_folder(folder: Path, number: int) -> Path:
    """Where a variant's scenario lies in the study's folder."""
    return folder / VARIANTS / f"{number:03d}"


def write_plan(plan: Plan, folder: Path, command: str) -> None:
    """Write what describes the study into its folder: the study, its variants' scenarios, `study.json`.

    Raises:
        TraceError: If a file cannot be written.
    """
    for variant in plan.variants:
        target = variant_folder(folder, variant.number)
        target.mkdir(parents=True, exist_ok=True)
        copy_inputs(target, variant.inputs)
        write_file(target / SCENARIO_FILE, variant.text)
    write_file(folder / STUDY_FILE, dump_yaml(plan.study))
    write_file(folder / INFO_FILE, plan.info(command).to_json())


def versions() -> dict[str, str]:
    """Of netsim, Python and the packages that figures depend on."""
    return {
        "netsim": __version__,
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


class _Variants:
    """Makes the variants of one study; reads each scenario file once."""

    def __init__(self, folder: Path, study: Study, plugins: bool) -> None:
        self._folder = folder
        self._study = study
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
        if self._study.seed is not None:
            loaded = replace(loaded, scenario=replace(loaded.scenario, seed=self._study.seed))
        portable, inputs = Gathering(loaded).gather()
        digest = _digest(dump_yaml(replace(portable, description="")), inputs)
        return Variant(number, dict(combination.levels), loaded, dump_yaml(portable), tuple(inputs), digest)

    def _document(self, combination: Combination) -> tuple[Path, Document]:
        name = combination.scenario
        path = self._folder / str(name.value)
        if path not in self._read:
            if not path.is_file():
                raise ScenarioError([_about(name, f"expected an existing scenario file, got `{name.value}`")])
            self._read[path] = read_document(path)
        document = self._read[path]
        for target, value in combination.values:
            document = assign(document, target, value)
        return path, document


def _about(node: Node, text: str) -> Finding:
    return Finding(node.file, node.line, "scenario", text, "")


def _digest(text: str, inputs: Sequence[Input]) -> str:
    digest = blake2b(text.encode(), digest_size=12)
    for each in sorted(inputs, key=lambda one: one.name):
        digest.update(b"\0" + each.name.encode() + b"\0" + each.source.read_bytes())
    return digest.hexdigest()


def _axis_info(axis: Axis, node: Node) -> AxisInfo:
    settings = settings_of(axis, node)
    paths = dict.fromkeys(path for setting in settings for path, _ in setting.values)
    return AxisInfo(axis.column, tuple(setting.label for setting in settings), tuple(paths))
