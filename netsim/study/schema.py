"""The study file: a scenario with sweeps, repetitions and a question.

    kind: study
    schema_version: 1
    name: csmp-tolerance
    question: What does a higher message tolerance save, and what does it cost?
    scenario: ../chen2006/association-csmp.yaml
    repetitions: 20
    sweep:
      - {path: algorithm.tolerance, values: [0, 0.1, 1]}
      - {path: fidelity, values: [ideal, csma]}

Every combination of the axes is a *variant*, every repetition of a variant a *trial*. In one repetition all variants see
the same targets, noise and shadowing (common random numbers).
"""

from dataclasses import field
from typing import Annotated, Any, Literal

from annotated_types import Ge, MinLen

from netsim.parameters import Name, NonNegative, NonNegativeInt, PositiveInt, parameters

Level = str | bool | int | float | None
"""What names a place on an axis, in tables and on plots."""

PlotMore = Literal["trials", "distribution"]


@parameters
class Range:
    """Values from one end to the other, both included."""

    start: float
    """First value."""
    stop: float
    """Last value; with `step`, the limit it does not pass."""
    count: Annotated[int, Ge(2)] | None = None
    """How many values; or give `step`."""
    step: float | None = None
    """Distance between two values; or give `count`."""
    scale: Literal["linear", "log"] = "linear"
    """Whether the values are evenly spaced, or their logarithms (with `count`)."""

    def __post_init__(self) -> None:
        """Either a count or a step, and one that leads somewhere."""
        if (self.count is None) == (self.step is None):
            message = "either count or step"
            raise ValueError(message)
        if self.step is not None and (self.scale == "log" or self.step * (self.stop - self.start) <= 0):
            message = "a step from start towards stop, on a linear scale"
            raise ValueError(message)
        if self.scale == "log" and not (self.start > 0 and self.stop > 0):
            message = "start and stop above 0 on a log scale"
            raise ValueError(message)


@parameters
class Case:
    """One of several alternatives that stand side by side: another algorithm, radio or scenario."""

    name: Name
    """What it is called in tables and plots."""
    scenario: Name | None = None
    """Its scenario file, relative to the study; null for the study's `scenario`."""
    set: dict[str, Any] = field(default_factory=dict)
    """Values that differ from the scenario, by path."""


@parameters
class Axis:
    """Something that is varied. Say what by exactly one of `values`, `range`, `zip` and `cases`."""

    name: Name | None = None
    """Name of its column; by default the last word of its path."""
    path: Name | None = None
    """Path of the value in the scenario, as after `--set`; for `values` and `range`."""
    values: Annotated[tuple[Any, ...], MinLen(1)] | None = None
    """The values, one after the other."""
    range: Range | None = None
    """Numbers from a range."""
    zip: dict[str, tuple[Any, ...]] | None = None
    """Paths that change together, each with its list of values: the first of each list, then the second, ..."""
    cases: Annotated[tuple[Case, ...], MinLen(1)] | None = None
    """Named alternatives: algorithms, radios or whole scenarios side by side."""
    labels: tuple[Name | int | float, ...] | None = None
    """What each place on the axis is called, where its value is no good name."""

    def __post_init__(self) -> None:
        """Exactly one way to vary, and what belongs to it."""
        given = [name for name in ("values", "range", "zip", "cases") if getattr(self, name) is not None]
        if len(given) != 1:
            message = "exactly one of values, range, zip and cases"
            raise ValueError(message)
        if (self.path is None) != (given[0] in ("zip", "cases")):
            message = f"{'no path' if self.path is not None else 'a path'} beside {given[0]}"
            raise ValueError(message)
        if given[0] in ("zip", "cases") and self.name is None:
            message = f"a name for the axis beside {given[0]}"
            raise ValueError(message)
        if self.zip is not None and (not self.zip or len({len(values) for values in self.zip.values()} | {0}) != 2):
            message = "lists of one length under zip, none of them empty"
            raise ValueError(message)
        if self.cases is not None and self.labels is not None:
            message = "no labels beside cases, which have names"
            raise ValueError(message)

    @property
    def column(self) -> str:
        """Name of its column."""
        return self.name or (self.path or "").replace("[", ".").replace("]", "").rpartition(".")[2]


@parameters
class Published:
    """A published figure, put beside the measured one."""

    metric: Name
    """The metric it is to be compared with."""
    value: float
    """What was published, in the metric's unit."""
    at: dict[str, Any] = field(default_factory=dict)
    """Where on the axes: the level of each axis that matters."""
    standard_error: NonNegative | None = None
    """Of the published value, if it is stated or follows from what is."""
    source: Name
    """Author, year, table or figure."""
    note: str = ""
    """What must be known to compare them: another reading, another radio."""


@parameters
class Comparison:
    """Which alternatives are compared in pairs, repetition by repetition."""

    axis: Name
    """The axis along which levels are compared."""
    baseline: Any = None
    """The level that the others are compared with; null for the first."""


@parameters
class Study:
    """A question put to many runs."""

    kind: Literal["study"]
    """What this file is."""
    schema_version: Literal[1]
    """Version of this format: 1."""
    name: Name
    """Short name; the study's folder is called after it."""
    question: Name
    """What it is to answer, in a sentence."""
    description: str = ""
    """What one must know to read its results."""
    scenario: Name
    """Scenario file that everything starts from, relative to this file."""
    set: dict[str, Any] = field(default_factory=dict)
    """Values that differ from the scenario in all variants, by path; names of files are relative to the scenario."""
    seed: NonNegativeInt | None = None
    """Seed of all trials; null for the scenario's."""
    repetitions: PositiveInt = 10
    """How often each variant is run; repetition r of every variant draws the same random numbers."""
    first_repetition: NonNegativeInt = 0
    """Number of the first repetition, to continue where another study ended."""
    sweep: tuple[Axis, ...] = ()
    """What is varied; every combination is run (the product of the axes)."""
    metrics: tuple[Name, ...] = ()
    """Metrics that the report tabulates (see `netsim list --metrics`); by default the usual ones that the problem has.
    The result table holds all of them."""
    error: Name | None = None
    """The metric that the plots hold against the costs; by default that of the problem."""
    costs: tuple[Name, ...] = ()
    """The metrics it is held against; by default joules, radio messages, bytes and latency."""
    compare: Comparison | None = None
    """Paired differences; by default along the first axis, against its first level."""
    plots: tuple[PlotMore, ...] = ()
    """What plots show besides: `trials` every trial as a dot along the axes, `distribution` the share of trials at or below
    each value of the metrics that are compared."""
    published: tuple[Published, ...] = ()
    """Published figures, put beside the measured ones."""
