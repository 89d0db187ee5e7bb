"""Ways of targets: where they are when, chance that stays in the field, and what a file must look like."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.models.manoeuvre import ManoeuvreTrack, manoeuvred
from netsim.models.track_files import TrackPoint, read_track
from netsim.models.tracks import FileTrack, StraightTrack, Track, WaypointTrack, track_of
from netsim.rng import Streams

S = 10**9
FIELD_M = (0.0, 0.0, 150.0, 250.0)


def made(parameters, number=0, seed=1, folder=None):
    return track_of(parameters, number, FIELD_M, Streams(seed), folder)


def points(*places):
    return tuple(TrackPoint(at_s=at_s, x_m=x_m, y_m=y_m) for at_s, x_m, y_m in places)


def test_the_paper_s_vehicle_drives_north_at_7_metres_a_second():
    track = made(StraightTrack(from_m=(75.0, 0.0), to_m=(75.0, 250.0)))
    assert track.at(0) == (75.0, 0.0)
    assert track.at(10 * S) == pytest.approx((75.0, 70.0))
    assert track.times_ns[-1] == round(250.0 / 7.0 * S)
    assert track.at(track.times_ns[-1]) == (75.0, 250.0)
    assert track.at(track.times_ns[-1] + 1) is None
    assert track.top_speed_m_per_s == pytest.approx(7.0)


def test_nobody_is_there_before_it_enters():
    track = made(StraightTrack(from_m=(0.0, 0.0), to_m=(10.0, 0.0), speed_m_per_s=1.0, enters_s=5.0))
    assert track.at(5 * S - 1) is None
    assert track.at(5 * S) == (0.0, 0.0)
    assert track.at(15 * S) == (10.0, 0.0)


def test_from_point_to_point():
    track = made(WaypointTrack(points=points((2, 0, 0), (4, 10, 0), (9, 10, 5))))
    assert {at_s: track.at(at_s * S) for at_s in (1, 2, 3, 4, 9, 10)} == {
        **{1: None, 2: (0, 0), 3: (5, 0), 4: (10, 0)},
        **{9: (10, 5), 10: None},
    }
    assert track.top_speed_m_per_s == 5.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: StraightTrack(from_m=(1.0, 1.0), to_m=(1.0, 1.0)), "two different places"),
        (lambda: WaypointTrack(points=points((2, 0, 0), (2, 1, 1))), "points in the order of their times"),
    ],
)
def test_ways_that_are_none_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def folded(place, low, high):
    """Reflection step by step."""
    while not low <= place <= high:
        place = 2.0 * low - place if place < low else 2.0 * high - place
    return place


@settings(max_examples=40, deadline=None)
@given(
    st.floats(0.5, 60.0),
    st.floats(0.0, 10.0),
    st.floats(0.0, 90.0),
    st.floats(0.1, 20.0),
    st.integers(0, 2**31),
    st.booleans(),
)
def test_a_target_that_manoeuvres_stays_in_the_field(speed, speed_sd, turn_sd, memory_s, seed, somewhere):
    parameters = ManoeuvreTrack(
        start_m=(0.0, 250.0) if somewhere else None,
        speed_m_per_s=speed,
        speed_sd_m_per_s=speed_sd,
        turn_sd_deg_per_s=turn_sd,
        memory_s=memory_s,
        enters_s=3.0,
        duration_s=20.2,
    )
    track = made(parameters, seed=seed)
    x_m, y_m = np.array(track.points_m).T
    assert x_m.min() >= 0.0
    assert x_m.max() <= 150.0
    assert y_m.min() >= 0.0
    assert y_m.max() <= 250.0
    assert (track.times_ns[0], track.times_ns[-1]) == (3 * S, 3 * S + round(20.2 * S))
    assert track.at(2 * S) is None


def test_without_chance_a_target_goes_straight_and_is_reflected_like_light():
    parameters = ManoeuvreTrack(
        start_m=(140.0, 10.0),
        heading_deg=60.0,
        speed_m_per_s=8.0,
        speed_sd_m_per_s=0.0,
        turn_sd_deg_per_s=0.0,
        duration_s=100.0,
    )
    track = made(parameters)
    for time_ns, (x_m, y_m) in zip(track.times_ns, track.points_m, strict=True):
        way_m = 8.0 * time_ns / S
        assert x_m == pytest.approx(folded(140.0 + way_m * math.sin(math.radians(60.0)), 0.0, 150.0), abs=1e-6)
        assert y_m == pytest.approx(folded(10.0 + way_m * math.cos(math.radians(60.0)), 0.0, 250.0), abs=1e-6)


def long_way(seed, **settings):
    """A way in a field so wide that nothing is reflected: speeds and turning rates, step by step."""
    parameters = ManoeuvreTrack(start_m=(0.0, 0.0), duration_s=4000.0, **settings)
    times_ns, places_m = manoeuvred(parameters, (-1e6, -1e6, 1e6, 1e6), np.random.default_rng(seed))
    moves_m = np.diff(np.array(places_m), axis=0)
    headings = np.unwrap(np.arctan2(moves_m[:, 0], moves_m[:, 1]))
    return np.hypot(*moves_m.T) / np.diff(times_ns) * S, np.degrees(np.diff(headings)) / 0.5


def test_speeds_and_turning_rates_have_the_spread_and_the_memory_that_were_asked_for():
    """8000 steps with a memory of 4 are worth about 1000 that do not know of each other."""
    speeds, turns = long_way(3, speed_m_per_s=20.0, speed_sd_m_per_s=2.0, turn_sd_deg_per_s=8.0, memory_s=2.0)
    assert speeds.mean() == pytest.approx(20.0, abs=4.0 * 2.0 / math.sqrt(1000))
    assert speeds.std() == pytest.approx(2.0, rel=4.0 / math.sqrt(2 * 1000))
    assert turns.mean() == pytest.approx(0.0, abs=4.0 * 8.0 / math.sqrt(1000))
    assert turns.std() == pytest.approx(8.0, rel=4.0 / math.sqrt(2 * 1000))
    for series in (speeds, turns):
        later = np.corrcoef(series[:-4], series[4:])[0, 1]
        assert later == pytest.approx(math.exp(-1.0), abs=4.0 / math.sqrt(1000))


def test_chance_comes_from_seed_and_number_of_the_target():
    ways = [made(ManoeuvreTrack(), number, seed).points_m for number, seed in ((0, 1), (0, 1), (1, 1), (0, 2))]
    assert ways[0] == ways[1]
    assert len(set(ways)) == 3


def test_a_longer_way_begins_as_a_shorter_one():
    short, long = (made(ManoeuvreTrack(duration_s=duration_s)).points_m for duration_s in (10.0, 30.0))
    assert long[: len(short)] == short


def test_a_target_that_manoeuvres_starts_in_the_field():
    with pytest.raises(ScenarioError, match=r"start_m is \(-1, 5\), outside; start within it"):
        made(ManoeuvreTrack(start_m=(-1.0, 5.0)))


def test_a_way_from_a_file(tmp_path):
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m\n0,1,2\n\n 1.5 , 4, 2\n", encoding="utf-8")
    track = made(FileTrack(file="way.csv"), folder=tmp_path)
    assert track == Track((0, 1_500_000_000), ((1.0, 2.0), (4.0, 2.0)))


def test_several_ways_in_one_file_with_columns_in_any_order(tmp_path):
    text = "y_m,target,x_m,time_s\n0,tank,1,2\n5,truck,5,0\n0,tank,2,3\n6,truck,5,4\n"
    (tmp_path / "ways.csv").write_text(text, encoding="utf-8")
    tank, truck = (made(FileTrack(file="ways.csv", target=name), folder=tmp_path) for name in ("tank", "truck"))
    assert tank == Track((2 * S, 3 * S), ((1.0, 0.0), (2.0, 0.0)))
    assert truck == Track((0, 4 * S), ((5.0, 5.0), (5.0, 6.0)))


@pytest.mark.parametrize(
    ("text", "target", "finding"),
    [
        ("", None, "1: expected the header `time_s,x_m,y_m`, got ``; a column `target` may be added"),
        ("t,x,y\n", None, "1: expected the header `time_s,x_m,y_m`, got `t,x,y`; a column `target` may be added"),
        ("time_s,x_m,y_m\n1,2\n", None, "2: expected 3 columns, got 2"),
        ("time_s,x_m,y_m\n1,2,3\n", None, "2: expected at least two points of a target, got 1"),
        ("time_s,x_m,y_m\n", None, "1: expected at least two points of a target, got 0"),
        ("time_s,x_m,y_m\n1,2,3\n2,x,3\n", None, "3: x_m: expected a number of metres, got `x`"),
        ("time_s,x_m,y_m\n1,2,3\n2,3,inf\n", None, "3: y_m: expected a number of metres, got `inf`"),
        (
            "time_s,x_m,y_m\n1,2,3\n1,3,3\n",
            None,
            "3: time_s: expected a time above 1 s, got `1`; order the rows of a target",
        ),
        ("time_s,x_m,y_m\n-1,2,3\n1,3,3\n", None, "2: time_s: expected a time from 0 s on, got `-1`"),
        ("time_s,x_m,y_m\n1,2,3\nsoon,3,3\n", None, "3: time_s: expected a time above 1 s, got `soon`"),
        ("time_s,x_m,y_m\n1,2,3\n2,3,3\n", "a", "1: expected a column `target` to find `a` in, got `time_s,x_m,y_m`"),
        (
            "target,time_s,x_m,y_m\na,1,2,3\nb,2,3,3\n",
            None,
            "1: target: expected one target, got the targets `a`, `b`; say `target` in the track",
        ),
        ("target,time_s,x_m,y_m\na,1,2,3\na,2,3,3\n", "b", "1: target: expected the target `b`, got only `a`"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_line(tmp_path, text, target, finding):
    file = tmp_path / "ways.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        read_track(file, target)
    assert f"{file}:{finding}" in str(caught.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ScenarioError, match="expected a CSV file of a target's ways, got: no such file"):
        read_track(tmp_path / "none.csv")
