"""What a study's folder says of itself: enough to tabulate, compare and report its results without the study file."""

import json
import shlex
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from netsim.errors import ScenarioError
from netsim.reading.reasons import why_unreadable
from netsim.study.schema import Level

FORMAT = 1
INFO_FILE = "study.json"
STUDY_FILE = "study.yaml"
JOURNAL_FILE = "trials.jsonl"
RESULTS = "results"
"""Stem of the table of trials: results.parquet, results.csv."""
NODES = "nodes"
"""Stem of the table of nodes."""
VARIANTS = "variants"
"""Subfolder with each variant's scenario."""


@dataclass(frozen=True, slots=True)
class AxisInfo:
    """An axis of a study.

    Attributes:
        name: Its column in the tables.
        levels: What its settings are called, in order.
        paths: The values of the scenario that it changes.
    """

    name: str
    levels: tuple[Level, ...]
    paths: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class VariantInfo:
    """A variant of a study.

    Attributes:
        number: Its number, counted from 0.
        levels: Its level on each axis.
        digest: Digest of its resolved scenario and of the files that this refers to.
        scenario: The scenario's name.
        seed: Its seed; None if the description is too old to tell.
    """

    number: int
    levels: Mapping[str, Level]
    digest: str
    scenario: str
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class PublishedInfo:
    """A published figure (see `netsim.study.schema.Published`)."""

    metric: str
    value: float
    at: Mapping[str, Level]
    standard_error: float | None
    source: str
    note: str


@dataclass(frozen=True, slots=True)
class SourceInfo:
    """Where something that the study uses comes from: its part (`algorithm`, `mac`, ...), its name, its citation."""

    part: str
    name: str
    citation: str


@dataclass(frozen=True, slots=True)
class BuildInfo:
    """By what trials were run: versions of netsim, Python and packages by name, and the number of trials with figures."""

    versions: Mapping[str, str]
    trials: int


@dataclass(frozen=True, slots=True)
class StudyInfo:
    """A study, as its results need it.

    Attributes:
        name: Short name.
        question: What it is to answer.
        description: What one must know to read its results.
        axes: What is varied.
        variants: Every combination of the axes' levels.
        seeds: Seeds of the trials: one, unless the variants' scenarios have different ones.
        repetitions: The repetitions' numbers.
        metrics: Metrics to tabulate; empty for the usual ones.
        error: Metric to hold against the costs; None for the problem's.
        costs: Metrics to hold it against; empty for the usual ones.
        compare_axis: Axis along which levels are compared in pairs; None without axes.
        baseline: The level that the others are compared with.
        published: Published figures.
        sources: Citations of what the variants use.
        warnings: Traps that variants fall into, in words.
        command: What made the study, as typed.
        versions: Of netsim, Python and the packages that figures depend on, where the study was last begun or resumed.
        plots: What plots show besides means: `trials`, `distribution`.
        builds: By what the trials with figures were run, the most frequent first; empty before there are tables.
    """

    name: str
    question: str
    description: str
    axes: tuple[AxisInfo, ...]
    variants: tuple[VariantInfo, ...]
    seeds: tuple[int, ...]
    repetitions: tuple[int, ...]
    metrics: tuple[str, ...]
    error: str | None
    costs: tuple[str, ...]
    compare_axis: str | None
    baseline: Level
    published: tuple[PublishedInfo, ...]
    sources: tuple[SourceInfo, ...]
    warnings: tuple[str, ...]
    command: str
    versions: Mapping[str, str]
    builds: tuple[BuildInfo, ...] = ()
    plots: tuple[str, ...] = ()

    @property
    def axis_names(self) -> list[str]:
        """The axes' columns, in order."""
        return [axis.name for axis in self.axes]

    @property
    def trial_versions(self) -> dict[str, str]:
        """By what versions the trials were run: where they differ, each with the number of its trials."""
        names = dict.fromkeys(name for build in self.builds for name in build.versions)
        return {name: self._told(name) for name in names} if self.builds else dict(self.versions)

    def resuming(self, folder: Path) -> str:
        """The command that goes on with the study in its folder."""
        return f"{self.command} --out {shlex.quote(str(folder))} --resume"

    def _told(self, name: str) -> str:
        counts: Counter[str] = Counter()
        for build in self.builds:
            counts[build.versions.get(name, "unknown")] += build.trials
        if len(counts) == 1:
            return next(iter(counts))
        return " and ".join(
            f"{version} ({count} trial{'' if count == 1 else 's'})" for version, count in counts.most_common()
        )

    def to_json(self) -> str:
        """As the text of `study.json`."""
        return json.dumps({"format": FORMAT, **asdict(self)}, indent=2, allow_nan=False) + "\n"

    @classmethod
    def from_json(cls, text: str) -> "StudyInfo":
        """From the text of `study.json`.

        Raises:
            ValueError: If it is none of this format.
        """
        given: dict[str, Any] = json.loads(text)
        if given.pop("format", None) != FORMAT:
            message = f"not a study of format {FORMAT}"
            raise ValueError(message)
        given = {"warnings": (), "builds": (), "plots": ()} | given  # which folders of early versions lack
        try:
            return cls(
                **given
                | {
                    "axes": tuple(
                        AxisInfo(axis["name"], tuple(axis["levels"]), tuple(axis["paths"])) for axis in given["axes"]
                    ),
                    "variants": tuple(VariantInfo(**_seed(given) | variant) for variant in given["variants"]),
                    "builds": tuple(BuildInfo(**build) for build in given["builds"]),
                    "published": tuple(PublishedInfo(**figure) for figure in given["published"]),
                    "sources": tuple(SourceInfo(**source) for source in given["sources"]),
                    **{name: tuple(given[name]) for name in _LISTS},
                }
            )
        except (KeyError, TypeError) as error:
            message = f"not a whole description of a study: {error}"
            raise ValueError(message) from error


_LISTS = ("seeds", "repetitions", "metrics", "costs", "warnings", "plots")


def _seed(given: Mapping[str, Any]) -> dict[str, int]:
    """What a variant that does not tell its seed has, if it can be known: early versions wrote the seeds of all."""
    return {"seed": given["seeds"][0]} if len(given["seeds"]) == 1 else {}


def read_info(folder: Path) -> StudyInfo:
    """The description of the study in a folder.

    Raises:
        ScenarioError: If there is none.
    """
    path = folder / INFO_FILE
    try:
        return StudyInfo.from_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        got = "no such file" if isinstance(error, FileNotFoundError) else why_unreadable(path, error)
        message = f"{path}: expected the description of a study, got: {got}; give the folder that `netsim study` wrote"
        raise ScenarioError(message) from error
