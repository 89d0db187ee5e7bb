"""What a metric is: its name, its unit, which way is better, and what exactly it counts."""

from dataclasses import dataclass
from typing import Literal

Better = Literal["lower", "higher", ""]


@dataclass(frozen=True, slots=True)
class Metric:
    """One figure that a run can give.

    Attributes:
        name: As it stands in `metrics.json`.
        unit: Its unit; `1` for a count, a share or a number without one, empty for what is no number.
        better: Which way is better; empty where neither is, or where it depends on the question.
        definition: What exactly it is, its keys or elements where it has any, and when it is missing or null.
        source: The events it is made of, and the paper where the definition comes from one.
        group: What it is about.
    """

    name: str
    unit: str
    better: Better
    definition: str
    source: str
    group: str


def grouped(group: str, *rows: tuple[str, str, Better, str, str]) -> tuple[Metric, ...]:
    """Metrics of one group, from (name, unit, better, definition, source)."""
    return tuple(Metric(*row, group) for row in rows)
