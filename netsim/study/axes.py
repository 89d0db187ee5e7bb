"""From the axes of a study to its variants: which values stand where, and what each combination is called."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from netsim.errors import Finding
from netsim.reading import Document, Node
from netsim.reading import Path as ValuePath
from netsim.reading.scalars import show
from netsim.study.schema import Axis, Level, Range, Study

MOST_VARIANTS = 10_000


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
        columns = {path: _list(child) for path, child in _mapping(node.child("zip")).items()}
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
    """The numbers of a range, whole ones as integers if all of them are whole."""
    if given.step is not None:
        count = int(np.floor((given.stop - given.start) / given.step * (1 + 1e-12))) + 1
        numbers = given.start + given.step * np.arange(count)
    elif given.scale == "log":
        numbers = np.geomspace(given.start, given.stop, given.count or 2)
    else:
        numbers = np.linspace(given.start, given.stop, given.count or 2)
    plain: list[float] = [float(f"{number:.12g}") for number in numbers]  # 0.3, not 0.30000000000000004
    return [int(number) for number in plain] if all(number.is_integer() for number in plain) else list(plain)


def combinations(study: Study, document: Document) -> list[Combination]:
    """Every combination of the axes' settings, the last axis changing fastest."""
    root = document.root
    base = root.child("scenario") or root
    common = tuple(_mapping(root.child("set")).items())
    axes = [settings_of(axis, node) for axis, node in zip(study.sweep, _list(root.child("sweep")), strict=True)]
    columns = [axis.column for axis in study.sweep]
    made = []
    for chosen in itertools.product(*axes):
        scenario = next((setting.scenario for setting in reversed(chosen) if setting.scenario is not None), base)
        values = common + tuple(value for setting in chosen for value in setting.values)
        levels = {column: setting.label for column, setting in zip(columns, chosen, strict=True)}
        made.append(Combination(levels, values, scenario))
    return made


def axis_findings(study: Study, document: Document) -> Iterator[Finding]:
    """What is wrong with the axes taken together, and with what refers to them."""
    columns: dict[str, list[Level]] = {}
    total = 1
    nodes = _list(document.root.child("sweep"))
    for index, (axis, node) in enumerate(zip(study.sweep, nodes, strict=True)):
        path = ("sweep", index)
        labels = [setting.label for setting in settings_of(axis, node)]
        total *= len(labels)
        yield from _labels(document, path, axis, labels)
        if axis.column in columns:
            remedy = "give one of the axes a `name`"
            yield document.finding(path, "an axis with a column of its own", f"a second `{axis.column}`", remedy)
        if axis.column in RESERVED:
            yield document.finding(path, "a column that is no other", f"`{axis.column}`", "give the axis a `name`")
        columns[axis.column] = labels
    if total > MOST_VARIANTS:
        yield document.finding(("sweep",), f"at most {MOST_VARIANTS} variants", str(total), "sweep less at a time")
    yield from _references(study, document, columns)


RESERVED = ("trial", "variant", "repetition", "seed", "status", "error", "command")
"""Columns of the result table that no axis may be called."""


def _labels(document: Document, path: ValuePath, axis: Axis, labels: Sequence[Level]) -> Iterator[Finding]:
    if axis.labels is not None and len(axis.labels) != len(labels):
        yield document.finding((*path, "labels"), f"{len(labels)} labels, one a setting", str(len(axis.labels)))
    if len(set(map(str, labels))) < len(labels):
        twice = next(label for label in labels if [*map(str, labels)].count(str(label)) > 1)
        yield document.finding(path, "settings that are called differently", f"`{twice}` twice", "give `labels`")


def _references(study: Study, document: Document, columns: Mapping[str, Sequence[Level]]) -> Iterator[Finding]:
    """`compare` and `published` name axes and levels that there must be."""
    known = ", ".join(columns) or "none: there is no sweep"
    if study.compare is not None:
        if study.compare.axis not in columns:
            yield document.finding(("compare", "axis"), f"an axis ({known})", study.compare.axis)
        elif study.compare.baseline is not None and study.compare.baseline not in columns[study.compare.axis]:
            wanted = f"one of {', '.join(map(str, columns[study.compare.axis]))}"
            yield document.finding(("compare", "baseline"), wanted, str(study.compare.baseline))
    for index, figure in enumerate(study.published):
        for axis, level in figure.at.items():
            path = ("published", index, "at", axis)
            if axis not in columns:
                yield document.finding(path, f"an axis ({known})", axis)
            elif level not in columns[axis]:
                yield document.finding(path, f"one of {', '.join(map(str, columns[axis]))}", show(level))


def _case(name: str, node: Node) -> Setting:
    scenario = node.child("scenario")
    brings = scenario if scenario is not None and scenario.value is not None else None
    return Setting(name, tuple(_mapping(node.child("set")).items()), brings)


def _label(axis: Axis, index: int, value: Node) -> Level:
    """The label given, the value if it is a scalar, its `type` if it has one, else its text."""
    if axis.labels is not None and index < len(axis.labels):
        return axis.labels[index]
    plain = Document(value).plain()
    if isinstance(plain, dict) and isinstance(plain.get("type"), str):
        return str(plain["type"])
    return plain if isinstance(plain, str | bool | int | float | None) else show(plain)


def _items(node: Node, key: str) -> list[Node]:
    return _list(node.child(key))


def _list(node: Node | None) -> list[Node]:
    return node.value if node is not None and isinstance(node.value, list) else []


def _mapping(node: Node | None) -> dict[str, Node]:
    return node.value if node is not None and isinstance(node.value, dict) else {}
