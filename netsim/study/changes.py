"""What is different between a study and the one that a folder was begun with, in words."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from netsim.errors import ScenarioError
from netsim.reading import parse
from netsim.reading.scalars import show
from netsim.scenario.folder import SCENARIO_FILE
from netsim.study.folder import variant_folder
from netsim.study.info import AxisInfo, StudyInfo
from netsim.study.plan import Plan
from netsim.study.schema import Level
from netsim.study.variants import Variant

MOST_LINES = 12
MOST_COMPARED = 200
"""So many variants are compared value by value."""


@dataclass(frozen=True, slots=True)
class Changes:
    """How a study differs from what its folder holds, as far as trials are concerned.

    Attributes:
        lines: What differs, a line each; empty if the trials are the same.
        extends: Whether it only asks for more repetitions of the same variants.
    """

    lines: tuple[str, ...] = ()
    extends: bool = False


def changes(plan: Plan, folder: Path, before: StudyInfo) -> Changes:
    """Compare a study with the one described in a folder.

    Metrics, question, published figures and the like do not concern trials and are not compared.

    Args:
        plan: The study as it is now.
        folder: The folder, for the old variants' scenarios.
        before: Its description.
    """
    old, new = {each.digest for each in before.variants}, {each.digest for each in plan.variants}
    repetitions = _repetitions(before.repetitions, plan.repetitions)
    if old == new and set(before.repetitions) <= set(plan.repetitions):
        return Changes(tuple(repetitions), extends=bool(repetitions))
    axes = list(_axes(before.axes, plan.axes))
    values = list(_values(plan, folder, before))
    lines = [*repetitions, *axes, *values] or ["the variants are others"]
    more = [f"... and {len(lines) - MOST_LINES} differences more"] if len(lines) > MOST_LINES else []
    return Changes((*lines[:MOST_LINES], *more))


def _repetitions(old: Sequence[int], new: Sequence[int]) -> list[str]:
    return [] if tuple(old) == tuple(new) else [f"repetitions: {_span(old)} before, {_span(new)} now"]


def _span(numbers: Sequence[int]) -> str:
    return f"{numbers[0]} to {numbers[-1]}" if len(numbers) > 1 else f"{numbers[0]} alone"


def _axes(old: Sequence[AxisInfo], new: Sequence[AxisInfo]) -> Iterator[str]:
    then, now = ({axis.name: axis.levels for axis in axes} for axes in (old, new))
    yield from (f"axis {name} is new: {_listed(now[name])}" for name in now if name not in then)
    yield from (f"axis {name} is gone: {_listed(then[name])}" for name in then if name not in now)
    for name in now:
        if name in then:
            yield from _levels(name, then[name], now[name])


def _levels(axis: str, old: Sequence[Level], new: Sequence[Level]) -> Iterator[str]:
    added = [level for level in new if level not in old]
    gone = [level for level in old if level not in new]
    if added:
        yield f"axis {axis}: {_listed(added)} new"
    if gone:
        yield f"axis {axis}: {_listed(gone)} gone"


def _listed(levels: Sequence[Level]) -> str:
    return ", ".join(map(show, levels))


def _values(plan: Plan, folder: Path, before: StudyInfo) -> Iterator[str]:
    """Which values differ in variants that are called the same."""
    numbers = {_name(each.levels): each for each in before.variants}
    pairs = [(numbers[name], each) for each in plan.variants if (name := _name(each.levels)) in numbers]
    changed = [(old, new) for old, new in pairs if old.digest != new.digest]
    found: defaultdict[str, list[str]] = defaultdict(list)
    for old, new in changed[:MOST_COMPARED]:
        for line in _differences(variant_folder(folder, old.number), new):
            found[line].append(_name(new.levels))
    for line, names in found.items():
        everywhere = len(names) == min(len(changed), MOST_COMPARED)
        yield line if everywhere else f"{line} ({'; '.join(names[:2])}{'; ...' if len(names) > 2 else ''})"


def _name(levels: Mapping[str, Level]) -> str:
    return ", ".join(f"{name}={show(level)}" for name, level in levels.items())


def _differences(folder: Path, variant: Variant) -> Iterator[str]:
    """How a variant differs from its copy in the folder."""
    try:
        text = (folder / SCENARIO_FILE).read_text(encoding="utf-8")
        old = dict(_leaves(parse(text, SCENARIO_FILE).plain(), ""))
    except (OSError, ValueError, ScenarioError):
        yield "the scenario of a variant cannot be read any more"
        return
    new = dict(_leaves(parse(variant.text, SCENARIO_FILE).plain(), ""))
    names: Set[str] = {*old, *new} - {"description"}
    for path in sorted(names, key=[*old, *new].index):
        if old.get(path) != new.get(path):
            yield f"{path}: {show(old.get(path))} before, {show(new.get(path))} now"
    for each in variant.inputs:
        copy = folder / each.name
        if copy.is_file() and copy.read_bytes() != each.source.read_bytes():
            yield f"{each.source}: the file's content differs"


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        for key, child in value.items():
            yield from _leaves(child, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        for index, child in enumerate(value):
            yield from _leaves(child, f"{path}[{index}]")
    else:
        yield path, value
