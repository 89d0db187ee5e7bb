"""Which instants a movie shows, and what is in the air in each of its pictures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from movie_traces import ARRIVES_S, END_S, frame, sent, write_trace

from netsim.errors import ScenarioError
from netsim.movie.cast import load_cast
from netsim.movie.options import MovieOptions, Reel, plan
from netsim.movie.story import Story, read_story
from netsim.replay.flights import Air, Flights
from netsim.replay.options import ReplayOptions
from netsim.trace.events import BROADCAST
from netsim.units import s_to_ns

S = 1_000_000_000


def test_a_length_gives_that_many_pictures_from_the_first_to_the_last_instant():
    reel = plan(ReplayOptions(end_s=10.0), MovieOptions(seconds=2.0), 10.0, 10 * S)
    assert reel.count == 20
    assert reel.times_ns[0] == 0
    assert 10 * S - 20 < reel.times_ns[-1] <= 10 * S
    assert set(np.diff(reel.times_ns)) == {reel.step_ns}
    assert reel.speed == pytest.approx(10.0 / 2.0, rel=0.06)  # one picture more than steps


def test_a_speed_gives_the_length():
    reel = plan(ReplayOptions(start_s=2.0, end_s=10.0, speed=0.5), MovieOptions(), 25.0, 60 * S)
    assert reel.count == 16 * 25
    assert reel.start_ns == 2 * S
    assert reel.speed == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize(("length_s", "expected_s"), [(1.0, 20.0), (15.0, 20.0), (3000.0, 20.0), (0.02, 0.4)])
def test_without_wishes_a_movie_takes_the_pace_of_the_replay_but_no_more_than_20_s(length_s, expected_s):
    reel = plan(ReplayOptions(), MovieOptions(), 10.0, round(length_s * S))
    assert reel.count == round(expected_s * 10)


def test_an_arrow_is_in_several_pictures_however_fast_the_movie():
    reel = plan(ReplayOptions(), MovieOptions(), 12.0, 3000 * S)
    assert reel.hold_ns >= 4 * reel.step_ns


def test_a_hold_that_is_asked_for_is_kept():
    assert plan(ReplayOptions(hold_s=0.7), MovieOptions(seconds=5.0), 12.0, 10 * S).hold_ns == round(0.7 * S)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"fps": 0.5}, "fps: expected"), ({"width_px": 100}, "width: expected"), ({"seconds": 0.0}, "seconds: expected")],
)
def test_numbers_out_of_range_are_refused(wrong, said):
    with pytest.raises(ScenarioError, match=said):
        MovieOptions(**wrong)


def test_a_speed_and_a_length_contradict_each_other():
    with pytest.raises(ScenarioError, match="got both"):
        plan(ReplayOptions(speed=2.0), MovieOptions(seconds=5.0), 12.0, 10 * S)


def test_a_movie_of_hours_is_refused():
    with pytest.raises(ScenarioError, match="at most 20000 pictures"):
        plan(ReplayOptions(speed=0.001), MovieOptions(), 25.0, 10 * S)


@given(
    st.lists(st.tuples(st.integers(0, 99), st.integers(0, 6)), max_size=30),
    st.integers(1, 9),
    st.integers(0, 30),
)
def test_each_picture_has_the_arrows_that_a_replay_has_at_that_instant(flights, step_ns, more_ns):
    """A picture is drawn from a part of the flights, and must have what one pass over all of them gives."""
    hold_ns = step_ns + more_ns
    start, layer = (
        (np.array(column, np.int64) for column in zip(*sorted(flights), strict=True)) if flights else ([], [])
    )
    row = np.arange(len(flights), dtype=np.int64)
    air = Flights(np.asarray(start, np.int64), np.asarray(layer, np.int64), row, row, row)
    reel = Reel(start_ns=0, end_ns=100, step_ns=step_ns, count=100 // step_ns + 1, hold_ns=hold_ns, bin_ns=10, fps=10.0)
    story = Story(reel, [], air, [], [], np.zeros((0, 10)), False)
    expected = [set() for _ in range(reel.count)]
    for rows in Air(0, step_ns, hold_ns).advance(air, reel.count * step_ns):
        tick = np.repeat(rows.time_ns // step_ns, rows.lengths)
        for at, number, reach in zip(tick.tolist(), rows.flights.tail.tolist(), rows.reach.tolist(), strict=True):
            expected[at].add((rows.layer, number, reach))
    for picture in range(reel.count):
        shown = {
            (rows.layer, number, reach)
            for rows in story.air(picture)
            for number, reach in zip(rows.flights.tail.tolist(), rows.reach.tolist(), strict=True)
        }
        assert shown == expected[picture]


def story_of(trace, options=None, **look):
    options = options or ReplayOptions()
    cast = load_cast(trace)
    return read_story(trace, cast, plan(options, MovieOptions(**look), 10.0, s_to_ns(END_S)), options)


def test_a_frame_is_shown_from_its_start_for_the_hold(tmp_path):
    story = story_of(write_trace(tmp_path / "t.mcap"), seconds=10.0)
    shown = [k for k in range(story.reel.count) if any(0 in rows.flights.head for rows in story.air(k))]
    times_ns = story.reel.times_ns[shown]
    expected = [
        k
        for k, time_ns in enumerate(story.reel.times_ns)
        if any(s_to_ns(begin) <= time_ns < s_to_ns(begin) + story.reel.hold_ns for begin in (ARRIVES_S, 6.0))
    ]
    assert shown == expected
    assert times_ns[0] >= s_to_ns(ARRIVES_S)


def test_messages_are_counted_by_kind_and_time(tmp_path):
    rows = [sent(0.05, 1, 0), sent(0.06, 1, 0), sent(0.07, 2, 1, "query"), frame(9.0, 1, 0, "received", "query")]
    story = story_of(write_trace(tmp_path / "t.mcap", rows), seconds=2.0)
    assert story.kinds == ["belief", "query"]
    width_s = story.reel.bin_ns / S
    assert story.rates[:, 0].tolist() == pytest.approx([2 / width_s, 1 / width_s])
    assert story.rates.sum() * width_s == pytest.approx(3.0)


def test_a_window_and_a_choice_of_kinds_keep_the_colours_of_the_run(tmp_path):
    trace = write_trace(tmp_path / "t.mcap", [sent(1.0, 0, 1, "ask"), sent(2.0, 0, 1, "tell"), sent(8.0, 0, 1, "tell")])
    for options in (ReplayOptions(start_s=7.0), ReplayOptions(kinds=frozenset({"tell"}))):
        story = story_of(trace, options, seconds=1.0)
        assert (story.kinds, story.places) == (["tell"], [1])


def test_kinds_and_nodes_that_are_not_wanted_are_left_out(tmp_path):
    trace = write_trace(tmp_path / "t.mcap")
    only_query = story_of(trace, ReplayOptions(kinds=frozenset({"query"})), seconds=2.0)
    assert only_query.kinds == ["query"]
    assert only_query.flights.start_ns.tolist() == [s_to_ns(6.0)]
    only_two = story_of(trace, ReplayOptions(nodes=frozenset({2})), seconds=2.0)
    assert only_two.flights.start_ns.tolist() == [s_to_ns(4.0)]
    assert only_two.rates.sum() == 0.0


def test_what_happened_before_the_window_still_holds_in_it(tmp_path):
    story = story_of(write_trace(tmp_path / "t.mcap"), ReplayOptions(start_s=5.5, end_s=7.0), seconds=2.0)
    first, last = story.moments[0], story.moments[-1]
    assert first.leaders == (1,)
    assert first.charge.tolist()[1:] == [0.5, 0.0]
    assert list(first.beliefs) == [(0, 0)]  # told at 1.5 s, held for 5 s
    assert last.beliefs == {}
    assert first.targets == {0: (6.0, 8.0)}


def test_a_broadcast_is_shown_to_who_received_it(tmp_path):
    time_ns, event = frame(1.0, 1, 0, "received")
    both = {"destination": BROADCAST, "rx_node": [0, 2], "rx_outcome": [0, 3]}
    changed = type(event)(**{name: both.get(name, getattr(event, name)) for name in event.__slots__})
    story = story_of(write_trace(tmp_path / "t.mcap", [(time_ns, changed)]), seconds=2.0)
    heads = story.flights.head.tolist()
    assert heads == [0, 2]  # to node 2 the link is good: that it was lost there is worth showing
