"""Rows of plots: which are shown where they are too many, what they are called, and how their intervals are cut."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.study.info import AxisInfo
from netsim.study.plots.bars import KNOWN_STATES, _dealt
from netsim.study.plots.rows import cut_middle, kept_rows, left_out, row_labels
from netsim.study.plots.style import STACK, keep_near, wrap
from netsim.study.reporting.names import bounds_of

LOSS = AxisInfo("loss", (0, 0.1, 0.2, 0.3, 0.4), ("medium.loss",))
RULE = AxisInfo("rule", tuple(f"rule {number}" for number in range(10)), ("algorithm.rule",))
ROWS = [{"loss": loss, "rule": rule} for loss in LOSS.levels for rule in RULE.levels]


def test_ends_of_an_axis_of_numbers_stay() -> None:
    kept = kept_rows((LOSS, RULE), ROWS, 36)
    assert [row["loss"] for row in (ROWS[place] for place in kept)] == [0] * 10 + [0.2] * 10 + [0.4] * 10
    assert left_out((LOSS, RULE), ROWS, kept) == " 30 of 50 variants are drawn, those of loss 0.1, 0.3 are not."


def test_all_rows_stay_where_there_is_room_and_the_first_where_nothing_is_ordered() -> None:
    assert kept_rows((LOSS, RULE), ROWS, 50) == list(range(50))
    assert left_out((LOSS, RULE), ROWS, range(50)) == ""
    assert kept_rows((RULE,), ROWS, 7) == list(range(7))


@given(st.lists(st.text("ab, ", min_size=1, max_size=40), min_size=1, max_size=12, unique=True), st.integers(4, 20))
def test_labels_of_different_rows_differ(names: list[str], most: int) -> None:
    stripped = list(dict.fromkeys(" ".join(name.split()) for name in names))
    labels = row_labels(stripped, most)
    assert len(set(labels)) == len(stripped)
    assert all(label.count("\n") <= 1 for label in labels)


def test_a_text_keeps_both_its_ends() -> None:
    assert cut_middle("CSMP notice counted, unacknowledged", 21) == "CSMP notic…knowledged"
    assert cut_middle("short", 5) == "short"


def test_a_title_that_is_cut_shows_it() -> None:
    assert wrap("one two three", 7) == "one two\nthree"
    assert wrap("one two three four five", 7).endswith("…")


@pytest.mark.parametrize(
    ("metric", "bounds"),
    [
        ("association_error", (0.0, 1.0)),
        ("energy_j", (0.0, math.inf)),
        ("count_distance", (0.0, math.inf)),
        ("what_an_algorithm_records", (-math.inf, math.inf)),
        ("identity_probability_last", (0.0, 1.0)),
        ("identity_messages", (0.0, math.inf)),
        ("joint_readings_share", (0.0, 1.0)),
        ("targets_followed_share", (0.0, 1.0)),
    ],
)
def test_bounds(metric: str, bounds: tuple[float, float]) -> None:
    assert bounds_of(metric) == bounds


def test_states_keep_their_colours_whatever_else_is_there() -> None:
    few = _dealt(["radio.transmit", "new.state"], STACK, KNOWN_STATES)
    many = _dealt(["radio.receive", "new.state", "radio.transmit", "cpu.active"], STACK, KNOWN_STATES)
    assert few["radio.transmit"] == many["radio.transmit"] == STACK[2]
    assert len(set(many.values())) == 4


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_wide_intervals_leave_the_points_a_third_of_the_panel(scale: str) -> None:
    seen: list[tuple[float, float]] = []
    axes: Any = SimpleNamespace(set_xlim=lambda low, high: seen.append((low, high)))
    axis = SimpleNamespace(get_scale=lambda: scale, axes=axes, axis_name="x")
    keep_near(axis, [10.0, 1000.0], [1e-9, 1e9])
    low, high = (math.log(end) if scale == "log" else end for end in seen[0])
    first, last = (math.log(end) if scale == "log" else end for end in (10.0, 1000.0))
    assert (last - first) / (high - low) >= 1 / 3 - 1e-9
    assert low < first < last < high
