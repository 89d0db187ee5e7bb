"""From the axes of a study to its variants: which values stand where, and what each combination is called."""

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from netsim.reading import Document, Node
from netsim.reading.scalars import show
from netsim.study.schema import Axis, Level, Range, Study


@dataclass(frozen=True, slots=True)
class Setting:
    """One place on an axis.

    Attributes:
        label: What it is called: its level.
        values: What is set there, in turn: path and value as read, with the line it stands on.
        scenario: The scenario file it brings, as written; None for the study's.
    """

    label: Level
    values: tuple[tuple[str, Node], ...]
    scenario: Node | None = None


@dataclass(frozen=True, slots=True)
class Combination:
    """A combination of settings, one of each axis.

    Attributes:
        levels: What it is called, by the axes' columns.
        values: What is set, in turn.
        scenario: The scenario file, as written.
    """

    levels: Mapping[str, Level]
    values: tuple[tuple[str, Node], ...]
    scenario: Node


def settings_of(axis: Axis, node: Node) -> list[Setting]:
    """The settings of an axis, in order.

    Args:
        axis: The axis.
        node: The axis as read: values keep the line they stand on.
    """
    if axis.cases is not None:
        return [_case(case.name, child) for case, child in zip(axis.cases, _items(node, "cases"), strict=True)]
    if axis.zip is not None:
        columns = {path: list_of(child) for path, child in mapping_of(node.child("zip")).items()}
        rows = [tuple(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        return [Setting(_label(axis, i, row[0][1]), row) for i, row in enumerate(rows)]
    path = axis.path or ""
    if axis.range is not None:
        where = node.child("range") or node
        values = [Node(value, where.file, where.line) for value in range_values(axis.range)]
    else:
        values = _items(node, "values")
    return [Setting(_label(axis, i, value), ((path, value),)) for i, value in enumerate(values)]


def range_values(given: Range) -> list[float | int]:
    """The numbers of a range, whole ones as integers if all of them are whole.

    They are those that one would write: 0.3, not 0.30000000000000004; between the ends of a range with a count they are
    rounded to a millionth of the distance between two, or to six digits on a log scale.
    """
    if given.step is not None:
        count = int(np.floor((given.stop - given.start) / given.step * (1 + 1e-12))) + 1
        numbers = _rounded(given.start + given.step * np.arange(count))
    elif given.scale == "log":
        numbers = [float(f"{number:.6g}") for number in np.geomspace(given.start, given.stop, given.count or 2)]
    else:
        exact = np.linspace(given.start, given.stop, given.count or 2)
        decimals = 6 - math.ceil(math.log10(abs(exact[1] - exact[0]) or 1.0))
        numbers = _rounded([round(float(number), decimals) for number in exact])
    if given.count is not None:
        numbers[0], numbers[-1] = _rounded([given.start, given.stop])
    return [int(number) for number in numbers] if all(number.is_integer() for number in numbers) else list(numbers)


def _rounded(numbers: Iterable[float]) -> list[float]:
    return [float(f"{number:.12g}") for number in numbers]


def combinations(study: Study, document: Document) -> list[Combination]:
    """Every combination of the axes' settings, the last axis changing fastest."""
    root = document.root
    base = root.child("scenario") or root
    common = tuple(mapping_of(root.child("set")).items())
    if study.seed is not None and (seed := root.child("seed")) is not None:
        common = (("seed", seed), *common)
    axes = [settings_of(axis, node) for axis, node in zip(study.sweep, list_of(root.child("sweep")), strict=True)]
    columns = [axis.column for axis in study.sweep]
    made = []
    for chosen in itertools.product(*axes):
        scenario = next((setting.scenario for setting in reversed(chosen) if setting.scenario is not None), base)
        values = common + tuple(value for setting in chosen for value in setting.values)
        levels = {column: setting.label for column, setting in zip(columns, chosen, strict=True)}
        made.append(Combination(levels, values, scenario))
    return made


def _case(name: str, node: Node) -> Setting:
    scenario = node.child("scenario")
    brings = scenario if scenario is not None and scenario.value is not None else None
    return Setting(name, tuple(mapping_of(node.child("set")).items()), brings)


def _label(axis: Axis, index: int, value: Node) -> Level:
    """The label given, the value if it is a scalar, its `type` if it has one, else its text."""
    if axis.labels is not None and index < len(axis.labels):
        return axis.labels[index]
    plain = Document(value).plain()
    if isinstance(plain, dict) and isinstance(plain.get("type"), str):
        return str(plain["type"])
    return plain if isinstance(plain, str | bool | int | float | None) else show(plain)


def _items(node: Node, key: str) -> list[Node]:
    return list_of(node.child(key))


def list_of(node: Node | None) -> list[Node]:
    """The items of a list that was read; none if it is not there."""
    return node.value if node is not None and isinstance(node.value, list) else []


def mapping_of(node: Node | None) -> dict[str, Node]:
    """The values of a mapping that was read, by key; none if it is not there."""
    return node.value if node is not None and isinstance(node.value, dict) else {}
