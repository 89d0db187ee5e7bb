"""What is wrong with a study as a whole: axes that get in each other's way, names that name nothing."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from netsim.errors import Finding, ScenarioError
from netsim.metrics.catalogue import CATALOGUE, metric_of
from netsim.reading import Document, Path, is_assignable, keys_of
from netsim.reading.remedies import nearest
from netsim.reading.scalars import show
from netsim.scenario.load import FOLDER_NAME, is_folder_name
from netsim.study.axes import list_of, settings_of
from netsim.study.levels import label_of
from netsim.study.schema import Axis, Level, Study

MOST_VARIANTS = 10_000
RESERVED = ("trial", "variant", "repetition", "seed", "status", "error", "command")
"""Columns of the result table that no axis may be called."""


def study_findings(study: Study, document: Document) -> list[Finding]:
    """All that can be found without reading a scenario."""
    columns: dict[str, Sequence[Level]] = {}
    found: list[Finding] = []
    for index, (axis, node) in enumerate(zip(study.sweep, list_of(document.root.child("sweep")), strict=True)):
        labels = [setting.label for setting in settings_of(axis, node)]
        found += _column(document, ("sweep", index), axis, columns)
        found += _labels(document, ("sweep", index), axis, labels)
        columns[axis.column] = labels
    if not is_folder_name(study.name):
        found.append(document.finding(("name",), FOLDER_NAME, f"{study.name!r:.120}"))
    total = 1
    for levels in columns.values():
        total *= len(levels)
    if total > MOST_VARIANTS:
        sizes = " x ".join(str(len(levels)) for levels in columns.values())
        found.append(document.finding(("sweep",), f"at most {MOST_VARIANTS} variants", sizes, "sweep less at a time"))
    found += [*_paths(study, document), *_references(study, document, columns), *_metrics(study, document)]
    return found


def _column(document: Document, path: Path, axis: Axis, columns: Mapping[str, object]) -> Iterator[Finding]:
    if axis.column in columns:
        remedy = "give one of the axes a `name`"
        yield document.finding(path, "an axis with a column of its own", f"a second `{axis.column}`", remedy)
    if axis.column in RESERVED:
        yield document.finding(path, "a column that is no other", f"`{axis.column}`", "give the axis a `name`")
    elif axis.column.partition(".")[0] in CATALOGUE:
        got = f"`{axis.column}`, which is what a metric is called"
        yield document.finding(path, "a column that no metric has", got, "give the axis another `name`")


def _labels(document: Document, path: Path, axis: Axis, labels: Sequence[Level]) -> Iterator[Finding]:
    if axis.labels is not None and len(axis.labels) != len(labels):
        yield document.finding((*path, "labels"), f"{len(labels)} labels, one a setting", str(len(axis.labels)))
    texts = Counter(map(label_of, labels))
    if twice := [text for text, count in texts.items() if count > 1]:
        remedy = "rename a case" if axis.cases is not None else "leave one out, or give `labels`"
        yield document.finding(path, "settings that are called differently", f"`{twice[0]}` twice", remedy)


def _paths(study: Study, document: Document) -> Iterator[Finding]:
    """Every path is set once, and none that the study itself looks after."""
    owners: dict[tuple[str, ...], str] = {}
    for where, owner, paths in _assigned(study, document):
        for path in paths:
            keys = keys_of(path) if is_assignable(path) else ()
            if keys == ("repetition",):
                expected, remedy = "a path other than `repetition`", "the study counts them: `repetitions`"
                yield document.finding(where, expected, f"`{path}`", remedy)
            elif owners.setdefault(keys, owner) != owner and keys:
                yield document.finding(where, f"a path that is set once, not also by {owners[keys]}", f"`{path}`")


def _assigned(study: Study, document: Document) -> Iterator[tuple[Path, str, list[str]]]:
    """Where paths are set, by what, and which."""
    yield ("set",), "`set`", list(study.set)
    yield ("seed",), "`seed`", ["seed"] if study.seed is not None else []
    for index, (axis, node) in enumerate(zip(study.sweep, list_of(document.root.child("sweep")), strict=True)):
        paths = [path for setting in settings_of(axis, node) for path, _ in setting.values]
        yield ("sweep", index), f"the axis `{axis.column}`", list(dict.fromkeys(paths))


def _references(study: Study, document: Document, columns: Mapping[str, Sequence[Level]]) -> Iterator[Finding]:
    """`compare` and `published` name axes and levels that there must be."""
    if study.compare is not None:
        yield from _axis(document, ("compare", "axis"), study.compare.axis, columns)
        levels = columns.get(study.compare.axis, ())
        if levels and study.compare.baseline is not None:
            yield from _level(document, ("compare", "baseline"), study.compare.baseline, levels)
    for index, figure in enumerate(study.published):
        for name, level in figure.at.items():
            path = ("published", index, "at", name)
            yield from _axis(document, path, name, columns)
            if name in columns:
                yield from _level(document, path, level, columns[name])


def _axis(document: Document, path: Path, name: str, columns: Mapping[str, object]) -> Iterator[Finding]:
    if name not in columns:
        known = ", ".join(columns) or "none: there is no sweep"
        yield document.finding(path, f"an axis ({known})", f"`{name}`", _guess(name, columns))


def _level(document: Document, path: Path, level: object, levels: Sequence[Level]) -> Iterator[Finding]:
    if level not in levels:
        names = list(map(str, levels))
        yield document.finding(
            path, f"a level of the axis ({', '.join(names)})", show(level), _guess(str(level), names)
        )


def _guess(name: str, known: Mapping[str, object] | Sequence[str]) -> str:
    guess = nearest(name, known)
    return f"did you mean `{guess}`?" if guess else ""


def _metrics(study: Study, document: Document) -> Iterator[Finding]:
    """Metrics are those of the catalogue, or one entry of a dictionary there."""
    named: list[tuple[Path, str]] = [(("metrics", index), name) for index, name in enumerate(study.metrics)]
    named += [(("costs", index), name) for index, name in enumerate(study.costs)]
    named += [] if study.error is None else [(("error",), study.error)]
    named += [(("published", index, "metric"), figure.metric) for index, figure in enumerate(study.published)]
    for path, name in named:
        try:
            metric_of(name)
        except ScenarioError as error:
            remedy = str(error).partition("; ")[2]
            yield document.finding(path, "the name of a metric", f"`{name}`", remedy)
