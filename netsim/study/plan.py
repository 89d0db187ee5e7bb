"""A study file becomes a plan: every variant's scenario, checked, with all it needs, before anything runs."""

import os
import re
import shutil
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.reading import (
    OVERRIDE,
    Document,
    Node,
    apply_override,
    assign,
    check_document,
    dump_yaml,
    is_assignable,
    keys_of,
    read_document,
)
from netsim.scenario.device_warnings import device_warnings
from netsim.scenario.folder import SCENARIO_FILE, copy_inputs, write_file
from netsim.scenario.inputs import Input
from netsim.scenario.sources import sources_of
from netsim.study.axes import combinations, list_of, settings_of
from netsim.study.build_id import versions
from netsim.study.findings import study_findings
from netsim.study.folder import variant_folder
from netsim.study.info import (
    INFO_FILE,
    STUDY_FILE,
    VARIANTS,
    AxisInfo,
    PublishedInfo,
    SourceInfo,
    StudyInfo,
    VariantInfo,
)
from netsim.study.schema import Axis, Study
from netsim.study.trial import Task, tasks_of
from netsim.study.variants import Variant, Variants


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
        nodes = list_of(self.document.root.child("sweep"))
        return tuple(_axis_info(axis, node) for axis, node in zip(self.study.sweep, nodes, strict=True))

    def tasks(self, folder: Path) -> list[Task]:
        """Every trial (see `tasks_of`)."""
        return tasks_of(self.variants, self.repetitions, folder)

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
                VariantInfo(each.number, each.levels, each.digest, each.loaded.scenario.name, each.loaded.scenario.seed)
                for each in self.variants
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
            sources=self._sources(),
            warnings=self.warnings,
            command=command,
            versions=versions(),
            plots=study.plots,
        )

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Traps that variants fall into, in words, each once, with the number of those variants."""
        different = {variant.digest: variant for variant in self.variants}.values()
        found = Counter(warning for variant in different for warning in dict.fromkeys(device_warnings(variant.loaded)))
        total = len(different)
        return tuple(
            warning if count == total else f"{warning} ({count} of {total} variants)"
            for warning, count in found.items()
        )

    def _sources(self) -> tuple[SourceInfo, ...]:
        """Where the algorithms, models and devices of all variants come from, each once."""
        found = dict.fromkeys(source for variant in self.variants for source in sources_of(variant.loaded))
        return tuple(SourceInfo(each.part, each.name, each.citation) for each in found)


def load_plan(path: Path | str, overrides: Sequence[str] = (), *, plugins: bool = True) -> Plan:
    """Read and check a study with all its variants.

    Args:
        path: The study file.
        overrides: `path=value` each: a field of the study, such as `repetitions=3`, or else a value of all variants'
            scenarios, such as `duration_s=10`.
        plugins: Whether algorithms named `module:Class` may be imported.

    Raises:
        ScenarioError: With every finding; those about a variant's values name the line of the study that set them.
    """
    path = Path(path)
    if kind_of(path) == "scenario":
        message = f"{path} is a scenario, not a study: run it with `netsim run {path}`"
        raise ScenarioError(message)
    document = read_study(path, overrides)
    study, findings = check_document(document, Study)
    findings = findings or study_findings(study, document)
    if findings:
        raise ScenarioError(findings)
    made = Variants(path.parent, plugins)
    variants = [made.variant(number, each) for number, each in enumerate(combinations(study, document))]
    if made.findings:
        raise ScenarioError(list(dict.fromkeys(made.findings)))
    return Plan(study, path, document, tuple(each for each in variants if each is not None))


def kind_of(path: Path) -> object:
    """What a file says it is: `scenario`, `study` or anything else.

    Raises:
        ScenarioError: If it cannot be read.
    """
    kind = read_document(path).root.child("kind")
    return None if kind is None else kind.value


def read_study(path: Path, overrides: Sequence[str] = ()) -> Document:
    """Read a study file with overrides of its own fields and of its scenarios' values; the latter join its `set`.

    Raises:
        ScenarioError: If it cannot be read, or an override not be applied.
    """
    own = {each.name for each in fields(Study)}
    document = read_document(path)
    for override in overrides:
        target, equals, text = (part.strip() for part in override.partition("="))
        if not equals or not is_assignable(target) or re.split(r"[.\[]", target)[0] in own:
            document = apply_override(document, override)
        else:
            document = _set_in_scenarios(document, target, text)
    return document


def _set_in_scenarios(document: Document, target: str, text: str) -> Document:
    value = apply_override(Document(Node({}, OVERRIDE, 0)), f"{target}={text}").root
    for key in keys_of(target):
        value = value.child(key) or value
    common = document.root.child("set")
    known = common.value if common is not None and isinstance(common.value, dict) else {}
    return assign(document, "set", Node({**known, target: value}, OVERRIDE, 0))


def write_plan(plan: Plan, folder: Path, command: str) -> None:
    """Write what describes the study into its folder: the study, its variants' scenarios, `study.json`.

    Raises:
        TraceError: If a file cannot be written.
    """
    _drop_other_variants(plan, folder)
    copies: dict[Path, Path] = {}
    for variant in plan.variants:
        target = variant_folder(folder, variant.number)
        target.mkdir(parents=True, exist_ok=True)
        copy_inputs(target, [each for each in variant.inputs if not _linked(each, target, copies)])
        write_file(target / SCENARIO_FILE, variant.text)
    write_file(folder / STUDY_FILE, dump_yaml(plan.document.plain()))
    write_file(folder / INFO_FILE, plan.info(command).to_json())


def _linked(given: Input, target: Path, copies: dict[Path, Path]) -> bool:
    """Many variants refer to one large file: it is copied for the first of them, the others get a link to the copy."""
    path = target / given.name
    first = copies.setdefault(given.source.resolve(), path)
    if first == path:
        return False
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        os.link(first, path)
    except OSError:  # no links on this file system: a copy does as well
        return False
    return True


def _drop_other_variants(plan: Plan, folder: Path) -> None:
    """Folders of variants that an earlier study had, and this one has not."""
    names = {variant_folder(folder, variant.number).name for variant in plan.variants}
    for path in (folder / VARIANTS).glob("*"):
        if path.name not in names and path.is_dir():
            shutil.rmtree(path, ignore_errors=True)


def _axis_info(axis: Axis, node: Node) -> AxisInfo:
    settings = settings_of(axis, node)
    paths = dict.fromkeys(path for setting in settings for path, _ in setting.values)
    return AxisInfo(axis.column, tuple(setting.label for setting in settings), tuple(paths))
