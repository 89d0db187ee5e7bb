"""Plots with a row a variant: which rows are shown where they are too many, and what stands beside them."""

from collections.abc import Mapping, Sequence
from typing import Any

from netsim.study.info import AxisInfo
from netsim.study.levels import label_of
from netsim.study.reporting.blocks import plain
from netsim.study.reporting.names import is_ordered

MOST_ROWS = 36
LONG_LABEL = 44
"""Letters of a row's label that stand on one line."""
LABEL_SIZE_PT, WRAPPED_SIZE_PT = 9.0, 7.5
WRAPPED_ROW_IN = 0.26
"""Height of a row with a label of two lines."""


def kept_rows(axes: Sequence[AxisInfo], rows: Sequence[Mapping[str, Any]], most: int = MOST_ROWS) -> list[int]:
    """Which rows to show: all if they are few.

    Of too many, levels of an axis of numbers are passed over, evenly and never its ends, since what grows along such an
    axis shows there; that of the axis with most levels first. Where there is none to thin, or not enough, the first ones.

    Args:
        axes: The study's.
        rows: The level on each axis, by row.
        most: So many at most.
    """
    kept = list(range(len(rows)))
    for axis in sorted(filter(is_ordered, axes), key=lambda axis: -len(axis.levels)):
        if len(kept) > most:
            kept = _thinned(axis, rows, kept, most)
    return kept[:most]


def _thinned(axis: AxisInfo, rows: Sequence[Mapping[str, Any]], kept: Sequence[int], most: int) -> list[int]:
    """The rows of as many levels of an axis as there is room for, two at least."""
    there = {label_of(rows[row][axis.name]) for row in kept}
    labels = [label for level in axis.levels if (label := label_of(level)) in there]
    left = list(kept)
    for count in range(len(labels) - 1, 1, -1):
        wanted = {labels[round(place * (len(labels) - 1) / (count - 1))] for place in range(count)}
        left = [row for row in kept if label_of(rows[row][axis.name]) in wanted]
        if len(left) <= most:
            break
    return left


def left_out(
    axes: Sequence[AxisInfo], rows: Sequence[Mapping[str, Any]], kept: Sequence[int], what: str = "variants"
) -> str:
    """What a caption says of the rows that are not shown; empty if all are."""
    if len(kept) == len(rows):
        return ""
    gone = [
        plain(f"{axis.name} {', '.join(missing)}")
        for axis in axes
        if (missing := _missing([row[axis.name] for row in rows], [rows[place][axis.name] for place in kept]))
    ]
    text = f" {len(kept)} of {len(rows)} {what} are drawn"
    return text + (f", those of {' and of '.join(gone)} are not." if gone else ", the first ones.")


def _missing(all_of_them: Sequence[Any], shown: Sequence[Any]) -> list[str]:
    labels = dict.fromkeys(map(label_of, all_of_them))
    there = set(map(label_of, shown))
    return [label for label in labels if label not in there]


def row_labels(names: Sequence[str], most: int = LONG_LABEL) -> list[str]:
    """The names of rows, long ones on two lines; those that need more are cut in the middle, yet no two become equal."""
    lines = [_broken(name, most) for name in names]
    for room in range(most, max(map(len, names), default=0) + 1):
        shown = ["\n".join(cut_middle(line, room) for line in each) for each in lines]
        if len(set(shown)) == len(set(names)):
            return shown
    return ["\n".join(each) for each in lines]


def _broken(name: str, most: int) -> list[str]:
    """A name on one line, or on two of about one length, broken at a comma if there is one, else at a space."""
    if len(name) <= most:
        return [name]
    for mark in (", ", " "):
        places = [place + len(mark) for place in range(len(name)) if name.startswith(mark, place)]
        if places:
            middle = min(places, key=lambda place: abs(2 * place - len(name)))
            return [name[:middle].rstrip(), name[middle:]]
    return [name]


def cut_middle(text: str, most: int) -> str:
    """A text of at most so many letters, without its middle."""
    if len(text) <= most:
        return text
    head = most // 2
    return f"{text[:head].rstrip()}…{text[len(text) - (most - 1 - head) :].lstrip()}"


def are_wrapped(labels: Sequence[str]) -> bool:
    """Whether any label takes two lines."""
    return any("\n" in label for label in labels)


def label_rows(panel: Any, labels: Sequence[str]) -> None:
    """Write labels beside the rows of a panel, the first one on top."""
    size = WRAPPED_SIZE_PT if are_wrapped(labels) else LABEL_SIZE_PT
    panel.set_yticks(range(len(labels)), labels, fontsize=size, linespacing=1.0)
    panel.set_ylim(len(labels) - 0.4, -0.6)


def row_height_in(labels: Sequence[str], height_in: float) -> float:
    """The height of a row: the given one, or more if labels take two lines."""
    return max(height_in, WRAPPED_ROW_IN) if are_wrapped(labels) else height_in
