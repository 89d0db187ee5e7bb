"""The laws of the time axis."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.sequence.records import Exchange, Transmission
from netsim.sequence.scale import EVENT_STEP, STEP, TIMES, log_steps, scale_of

NS_A_DAY = 86_400 * 10**9
spans = st.lists(
    st.tuples(st.integers(0, NS_A_DAY), st.integers(1_000, 10**10)), min_size=1, max_size=12
)  # from a microsecond to ten seconds long


def exchange(found: list[tuple[int, int]]) -> Exchange:
    sent = [
        Transmission(number, start, start + length, 0, 1, "ask", "data", 20, 0, number, (), ((start, start + length),))
        for number, (start, length) in enumerate(sorted(found))
    ]
    return Exchange("made up", 0, NS_A_DAY, transmissions=sent)


@given(spans, st.sampled_from(TIMES), st.lists(st.integers(0, NS_A_DAY), max_size=4))
def test_time_never_runs_back_and_different_events_lie_apart(found, time, marks) -> None:
    scale = scale_of(exchange(found), time, marks)
    assert np.all(np.diff(scale.places) > 0.0)
    assert scale.places[0] == 0.0
    assert scale.length == scale.places[-1]
    assert len(scale.in_air) == len(scale.instants_ns) - 1


@given(spans, st.sampled_from(TIMES), st.lists(st.integers(-(10**9), 2 * NS_A_DAY), min_size=2, max_size=9))
def test_places_are_in_the_order_of_instants(found, time, instants) -> None:
    scale = scale_of(exchange(found), time)
    places = [scale.place(each) for each in sorted(instants)]
    assert places == sorted(places)
    assert 0.0 <= places[0] <= places[-1] <= scale.length


@given(st.integers(1, 10**15), st.integers(1, 10**15), st.integers(0, 50), st.integers(1, 10**10))
def test_a_longer_gap_takes_more_room_but_ten_times_the_gap_never_ten_times_the_room(
    first, second, in_air, airtime
) -> None:
    short, long = sorted((first, second))
    steps = log_steps(np.array([short, long, 10.0 * long]), np.full(3, in_air), airtime)
    assert steps[0] <= steps[1] < steps[2]
    assert steps[2] <= steps[1] + STEP * max(1, in_air) ** 0.5 * (1.0 + 1e-9)


def test_the_formula() -> None:
    """An acknowledgement of 352 us and a pause of 5 s: 0.7 and 4.75 steps."""
    scale = scale_of(exchange([(0, 352_000), (5_000_352_000, 352_000)]), "nonlinear")
    pause = np.log10(1 + 5e9 / 88_000)
    assert scale.places == pytest.approx(STEP * np.cumsum([0.0, np.log10(5.0), pause, np.log10(5.0)]))
    assert [(each.start_ns, each.end_ns) for each in scale.pauses] == [(352_000, 5_000_352_000)]


def test_two_frames_at_once_take_more_room_by_the_root_of_two() -> None:
    one, two = (scale_of(exchange([(0, 10**6)] * count), "nonlinear").length for count in (1, 2))
    assert two == pytest.approx(one * 2**0.5)


def test_it_is_no_pause_while_somebody_sends() -> None:
    assert scale_of(exchange([(0, 10**6), (2_000, 10**9), (3_000, 10**6)]), "nonlinear").pauses == []


@given(spans)
def test_linear_time_is_true_to_scale(found) -> None:
    scale = scale_of(exchange(found), "linear")
    since = scale.instants_ns - scale.instants_ns[0]
    assert scale.places == pytest.approx(since / since[-1] * scale.length)
    assert scale.tick_ns > 0


@given(spans)
def test_between_events_all_steps_are_equal_if_so_asked(found) -> None:
    assert np.diff(scale_of(exchange(found), "events").places) == pytest.approx(EVENT_STEP)


def test_how_many_are_in_the_air() -> None:
    scale = scale_of(exchange([(0, 5_000), (2_000, 5_000), (9_000, 1_000)]), "nonlinear")
    assert scale.in_air.tolist() == [1, 2, 1, 0, 1]
    assert (scale.most_in_air(0, 5_000), scale.most_in_air(5_000, 7_000), scale.most_in_air(7_000, 9_000)) == (2, 1, 0)
