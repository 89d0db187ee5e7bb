"""Arrows at display ticks: exact for frames worked out by hand, independent of how the flights arrive."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from netsim.replay.flights import NO_FLIGHTS, Air, Flights, Rows


def flights(*rows: tuple[int, int]) -> Flights:
    """Flights from (start, layer), from row 0 to row 1."""
    start, layer = np.array(rows, np.int64).reshape(-1, 2).T
    zeros = np.zeros(len(rows), np.int64)
    return Flights(start, layer, zeros, zeros + 1, zeros)


Shown = dict[int, dict[int, list[float]]]


def shown(rows: list[Rows]) -> Shown:
    """Layer -> instant -> how far each arrow has come."""
    result: Shown = {}
    for row in rows:
        ends = np.cumsum(row.lengths)
        for time_ns, end, length in zip(row.time_ns, ends, row.lengths, strict=True):
            result.setdefault(row.layer, {})[int(time_ns)] = sorted(row.reach[end - length : end].tolist())
    return result


def test_one_flight_grows_over_its_hold_and_is_cleared() -> None:
    rows = list(Air(0, 10, 30).advance(flights((5, 0)), 100))
    assert shown(rows) == {0: {10: [0.5], 20: [25 / 30], 30: [1.0], 40: []}}


def test_flights_of_a_layer_share_rows_and_layers_do_not() -> None:
    rows = list(Air(0, 10, 20).advance(flights((0, 0), (10, 0), (10, 1)), 100))
    assert shown(rows) == {
        0: {0: [0.5], 10: [0.5, 1.0], 20: [1.0], 30: []},
        1: {10: [0.5], 20: [1.0], 30: []},
    }


def test_a_window_begins_with_what_is_in_the_air() -> None:
    rows = list(Air(15, 10, 30).advance(flights((5, 0)), 100))
    assert shown(rows) == {0: {20: [25 / 30], 30: [1.0], 40: []}}


@given(
    st.lists(st.tuples(st.integers(0, 300), st.integers(0, 2)), max_size=12),
    st.lists(st.integers(0, 400), max_size=6),
    st.integers(1, 40),
    st.integers(1, 80),
)
def test_batches_do_not_show(rows: list[tuple[int, int]], cuts: list[int], tick: int, hold: int) -> None:
    """However the flights are split at horizons, the rows are those of one batch."""
    rows.sort()
    whole = list(Air(0, tick, hold).advance(flights(*rows), 1000))
    air = Air(0, tick, hold)
    parts: list[Rows] = []
    for low, high in pairwise([0, *sorted(cuts), 1000]):
        parts += air.advance(flights(*[row for row in rows if low <= row[0] < high]), high)
    parts += air.advance(NO_FLIGHTS, 1000)
    assert shown(parts) == shown(whole)


@given(st.lists(st.tuples(st.integers(0, 300), st.integers(0, 2)), max_size=12))
def test_every_flight_is_shown_and_every_layer_ends_empty(rows: list[tuple[int, int]]) -> None:
    result = shown(list(Air(0, 10, 30).advance(flights(*rows), 1000)))
    for layer in {layer for _, layer in rows}:
        ticks = result[layer]
        count = sum(layer == other for _, other in rows)
        assert sum(map(len, ticks.values())) == 3 * count
        assert ticks[max(ticks)] == []
