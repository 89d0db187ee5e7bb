"""Studies side by side: variants of the same levels against each other, each study against the first.

Two studies of the same seed and repetitions see the same targets, noise and shadowing, so that their trials are pairs and
the difference is taken within pairs (common random numbers); else as between independent samples (see
`netsim.study.differences`).

A gate passes only if it was judged on everything that the first study was: not if a trial that ended well there failed or is
missing in the later one, nor if only one of the two has a figure that the gate needs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from netsim.errors import ScenarioError
from netsim.reading import parse, to_plain, validate
from netsim.study.cells import Cell, Draw, Figures, cells_of, figures_of
from netsim.study.compare import in_order, unit_of
from netsim.study.differences import EQUAL, Difference, paired, unpaired
from netsim.study.gate import Gate, Judgement
from netsim.study.info import STUDY_FILE
from netsim.study.levels import words
from netsim.study.results import HEAD, TAIL, StudyResults, load_study
from netsim.study.schema import Study
from netsim.study.settings import Setting, differing
from netsim.study.shortfalls import Roll, Tally, lost, roll_of, tally_of, uneven

_OVERALL = 0
"""Number of the one cell of a table of means over variants."""
NAMED = 4
"""So many trials are named where there are more."""


@dataclass(frozen=True)
class Line:
    """A metric of a variant, or over all variants, in two studies.

    Attributes:
        metric: Its name.
        unit: Its unit; empty if it is not known.
        difference: How much higher it is in the later study.
    """

    metric: str
    unit: str
    difference: Difference

    @property
    def is_equal(self) -> bool:
        """Whether every pair has the same figure."""
        apart = self.difference
        return apart.verdict == EQUAL

    @property
    def is_empty(self) -> bool:
        """Whether no trial has a figure."""
        return not (self.difference.n or self.difference.n_baseline)


@dataclass(frozen=True)
class Match:
    """A study held against the first.

    Attributes:
        name: Its folder as it was given.
        is_paired: Whether the differences are those within pairs.
        changed: Of how many variants that both have the scenarios differ.
        overall: Each metric over all variants that both have, each variant weighing the same.
        variants: Each metric of each of these, by levels in words.
        lonely: Levels of variants that only one of the two has.
        tallies: How the trials of the first study ended, and those of this one.
        lost: Trials that ended well in the first study and not in this one, in words.
        uneven: By metric, trials of which only one of the two has a figure, in words (see `netsim.study.shortfalls.uneven`);
            not for metrics without such.
    """

    name: str
    is_paired: bool
    changed: int
    overall: list[Line]
    variants: Mapping[str, list[Line]]
    lonely: list[str]
    tallies: tuple[Tally, Tally]
    lost: tuple[str, ...]
    uneven: Mapping[str, tuple[str, ...]]

    def judge(self, gate: Gate) -> Judgement:
        """What a gate says of the means over all variants, and whether it could be judged on all trials of the first study.

        Raises:
            ScenarioError: See `Gate.judge`; if trials are lost, a figure that is missing is put down to them.
        """
        later = {line.metric: line.difference.mean for line in self.overall}
        try:
            judged = gate.judge(later, {line.metric: line.difference.baseline_mean for line in self.overall})
        except ScenarioError as error:
            if not self.lost:
                raise
            why = str(error).removeprefix(f"--fail-if '{gate.expression}': ")
            return Judgement(gate.expression, False, {}, (), f"{self._lost()}; {why}")
        bare = list(dict.fromkeys(trial for metric in judged.metrics for trial in self.uneven.get(metric, ())))
        reasons = [self._lost()] if self.lost else []
        reasons += [f"only one of the studies has a figure of {some(bare)}"] if bare else []
        return replace(judged, unjudged="; ".join(reasons))

    def _lost(self) -> str:
        first = self.tallies[0]
        ended = first.asked - len(first.failed) - len(first.not_run)
        return f"{len(self.lost)} of {ended} trials that ended well in {first.name} did not here: {some(self.lost)}"


@dataclass(frozen=True)
class StudyComparison:
    """Studies side by side.

    Attributes:
        names: The studies' folders as they were given.
        settings: In what the study files differ.
        versions: In what versions they differ.
        matches: Every study but the first, against it.
    """

    names: tuple[str, ...]
    settings: list[Setting]
    versions: list[Setting]
    matches: tuple[Match, ...]

    def judge(self, gates: Sequence[Gate]) -> list[tuple[str, Judgement]]:
        """What gates say of every study but the first.

        Raises:
            ScenarioError: See `Gate.judge`.
        """
        return [(match.name, match.judge(gate)) for match in self.matches for gate in gates]


def compare_studies(paths: Sequence[Path]) -> StudyComparison:
    """Put studies side by side.

    Raises:
        ScenarioError: If one has no results, or has no variant in common with the first.
    """
    first, *others = studies = [load_study(path) for path in paths]
    return StudyComparison(
        tuple(map(str, paths)),
        differing([_study_file(study) for study in studies]),
        differing([study.info.trial_versions for study in studies]),
        tuple(_match(first, other) for other in others),
    )


def some(names: Sequence[str]) -> str:
    """A few of the trials, and how many more there are."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return "; ".join(names[:NAMED]) + more


def _study_file(study: StudyResults) -> Any:
    """What was asked, defaults filled in."""
    path = study.folder / STUDY_FILE
    try:
        return to_plain(validate(parse(path.read_text(encoding="utf-8"), str(path)), Study))
    except OSError as error:
        message = f"{path}: expected the file of the study: {error.strerror or error}"
        raise ScenarioError(message) from error


def _match(first: StudyResults, other: StudyResults) -> Match:
    if set(first.info.axis_names) != set(other.info.axis_names):
        wanted, got = (", ".join(study.info.axis_names) or "none" for study in (first, other))
        message = f"{other.folder}: expected the axes of {first.folder}, {wanted}; got {got}"
        raise ScenarioError(message)
    axes = first.info.axis_names
    base, later = ({each.labels(axes): each for each in cells_of(study.trials, axes)} for study in (first, other))
    both = [labels for labels in base if labels in later]
    if not both:
        message = f"{other.folder}: expected a variant that {first.folder} has too, got none of the same levels"
        raise ScenarioError(message)
    is_paired = any(not base[labels].rows.keys().isdisjoint(later[labels].rows) for labels in both)
    cells = {words(base[labels].levels): (base[labels], later[labels]) for labels in both}
    lonely = [
        words(cells[labels].levels) for cells, rest in ((base, later), (later, base)) for labels in cells.keys() - rest
    ]
    metrics = _metrics(first, other)
    figures = [(figures_of(first.trials, metric), figures_of(other.trials, metric)) for metric in metrics]
    rolls = roll_of(first, is_paired=is_paired), roll_of(other, is_paired=is_paired)
    return Match(
        str(other.folder),
        is_paired,
        sum(_digest(first, base[labels]) != _digest(other, later[labels]) for labels in both),
        [_line(*_means(each, list(cells.values()), is_paired), is_paired) for each in figures],
        {name: [_line(each, pair, is_paired) for each in figures] for name, pair in cells.items()},
        sorted(lonely),
        (tally_of(str(first.folder), rolls[0]), tally_of(str(other.folder), rolls[1])),
        lost(*rolls),
        dict(_uneven((first, other), rolls, metrics, is_paired)),
    )


def _uneven(
    studies: tuple[StudyResults, StudyResults], rolls: tuple[Roll, Roll], metrics: Sequence[str], is_paired: bool
) -> Iterator[tuple[str, tuple[str, ...]]]:
    for metric in metrics:
        if found := uneven(studies, rolls, metric, is_paired=is_paired):
            yield metric, found


def _digest(study: StudyResults, cell: Cell) -> str:
    return next(variant.digest for variant in study.info.variants if variant.number == cell.variant)


def _metrics(first: StudyResults, other: StudyResults) -> list[str]:
    """The numeric metrics that both have, headline ones first."""
    others = {*HEAD, *TAIL, *first.info.axis_names}
    names = [
        name
        for name in first.trials
        if name in other.trials
        and name not in others
        and _is_numeric(first.trials[name])
        and _is_numeric(other.trials[name])
    ]
    return in_order(names)


def _is_numeric(column: "pd.Series[Any]") -> bool:
    return not any(isinstance(value, str) for value in column.tolist())


Both = tuple[Figures, Figures]
Pair = tuple[Cell, Cell]


def _line(figures: Both, pair: Pair, is_paired: bool) -> Line:
    """A metric in the two cells, one of each study; their figures are put together, for pairs to be found by their draws."""
    base, later = pair
    numbers = [each.numbers[row] for each, cell in zip(figures, pair, strict=True) for row in cell.rows.values()]
    first = Cell(0, base.levels, {draw: place for place, draw in enumerate(base.rows)})
    second = Cell(1, later.levels, {draw: len(first.rows) + place for place, draw in enumerate(later.rows)})
    compare, metric = paired if is_paired else unpaired, figures[0].metric
    return Line(metric, unit_of(metric), compare(Figures(metric, numbers), second, first))


def _means(figures: Both, pairs: Sequence[Pair], is_paired: bool) -> tuple[Both, Pair]:
    """The mean over all variants for each draw that has a figure in every one of them; if paired, in both studies.

    Variants of one draw share its random numbers, so a draw counts once, whatever the number of variants.
    """
    means = [dict(_draw_means(each, [pair[side] for pair in pairs])) for side, each in enumerate(figures)]
    if is_paired:
        means = [{draw: each[draw] for draw in each if all(draw in other for other in means)} for each in means]
    base, later = (Figures(figures[0].metric, list(each.values())) for each in means)
    cells = (Cell(_OVERALL, {}, {draw: place for place, draw in enumerate(each)}) for each in means)
    first, second = cells
    return (base, later), (first, second)


def _draw_means(figures: Figures, cells: Sequence[Cell]) -> Iterator[tuple[Draw, float]]:
    for draw in sorted({draw for cell in cells for draw in cell.rows}):
        found = [figures.numbers[cell.rows[draw]] for cell in cells if draw in cell.rows]
        values = [value for value in found if value is not None]
        if len(values) == len(cells):
            yield draw, sum(values) / len(values)
