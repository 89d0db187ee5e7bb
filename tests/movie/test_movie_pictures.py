"""Pixels of the pictures of a made-up trace: what is there at which instant, and in which colour."""

import numpy as np
import pytest
from movie_traces import ARRIVES_S, COLLIDES_S, LOST_S, PLACES_M, frame, sent, write_trace

from netsim.movie.cast import load_cast
from netsim.movie.look import DARK, LIGHT, charge_colours
from netsim.movie.options import MovieOptions, plan
from netsim.movie.painter import Painter
from netsim.movie.story import read_story
from netsim.replay.options import ReplayOptions
from netsim.trace.reader import last_time_ns

WIDTH_PX = 640


class Film:
    """A painter of a trace, asked by simulated time and place."""

    def __init__(self, trace, *, light=False):
        options = ReplayOptions()
        self.cast = load_cast(trace)
        self.reel = plan(options, MovieOptions(seconds=20.0), 10.0, last_time_ns(trace))
        story = read_story(trace, self.cast, self.reel, options)
        self.painter = Painter(story, self.cast, "three in a line", WIDTH_PX, light=light)

    def at(self, time_s):
        """The picture that is seen at an instant."""
        return self.painter.paint(int(np.searchsorted(self.reel.times_ns, round(time_s * 1e9), side="right")) - 1)

    def around(self, pixels, place_m, half_px=6):
        """The pixels around a place on the map; shape (n, 3)."""
        x, y = self.painter.layout.px(np.array(place_m))
        row, column = round(self.painter.layout.height_px - y), round(x)
        return pixels[row - half_px : row + half_px, column - half_px : column + half_px].reshape(-1, 3)


def has(pixels, colour):
    """Whether some pixel has nearly this colour: thin lines are mixed with the ground a little."""
    off = np.abs(pixels.astype(int) - np.round(np.array(colour[:3]) * 255).astype(int))
    return bool((off.max(axis=1) <= 60).any())


def between(a, b, share):
    return tuple(np.array(PLACES_M[a]) + share * (np.array(PLACES_M[b]) - np.array(PLACES_M[a])))


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    return Film(write_trace(tmp_path_factory.mktemp("movie") / "t.mcap"))


def test_the_size_is_even_and_the_width_is_that_asked_for(film):
    height, width, channels = film.at(0.0).shape
    assert (width, channels) == (WIDTH_PX, 3)
    assert height % 2 == 0
    assert (film.painter.layout.width_px, film.painter.layout.height_px) == (width, height)


@pytest.mark.parametrize(
    ("start_s", "ends", "colour"),
    [
        (ARRIVES_S, (1, 0), DARK.kind(0)),
        (COLLIDES_S, (1, 2), DARK.collided),
        (LOST_S, (1, 0), DARK.lost),
    ],
)
def test_an_arrow_is_there_while_it_flies_and_gone_before_and_after(film, start_s, ends, colour):
    place = between(*ends, 0.4)
    hold_s = film.reel.hold_ns / 1e9
    assert has(film.around(film.at(start_s + 0.9 * hold_s), place), colour)
    assert not has(film.around(film.at(start_s - 0.2), place), colour)
    gone_s = start_s + hold_s + film.reel.step_ns / 1e9
    assert not has(film.around(film.at(gone_s), place), colour)


def test_an_arrow_grows(film):
    hold_s = film.reel.hold_ns / 1e9
    near, far = between(1, 0, 0.25), between(1, 0, 0.75)
    early, late = film.at(ARRIVES_S + 0.25 * hold_s), film.at(ARRIVES_S + 0.95 * hold_s)
    assert has(film.around(early, near), DARK.kind(0))
    assert not has(film.around(early, far), DARK.kind(0))
    assert has(film.around(late, far), DARK.kind(0))


def test_what_is_lost_does_not_arrive(film):
    late = film.at(LOST_S + 0.95 * film.reel.hold_ns / 1e9)
    assert not has(film.around(late, between(1, 0, 0.85)), DARK.lost)


def test_nodes_have_the_colour_of_their_energy_and_cover_when_they_die(film):
    full, half = charge_colours(np.array([1.0, 0.5]))
    assert has(film.around(film.at(0.0), PLACES_M[1], 2), full)
    assert has(film.around(film.at(5.5), PLACES_M[1], 2), half)
    assert has(film.around(film.at(1.0), PLACES_M[0], 2), DARK.roles[0])
    assert not has(film.around(film.at(7.5), PLACES_M[2], 2), DARK.dead)
    assert has(film.around(film.at(8.5), PLACES_M[2], 2), DARK.dead)


def test_target_estimate_and_leader_come_when_they_are_told(film):
    for place, colour, before_s, after_s in [
        ((6.0, 8.0), DARK.target, 0.5, 1.2),
        ((6.5, 8.0), DARK.estimate, 1.2, 1.8),
        (PLACES_M[1], DARK.leader, 2.8, 3.3),
    ]:
        assert not has(film.around(film.at(before_s), place, 24), colour)
        assert has(film.around(film.at(after_s), place, 24), colour)


def test_a_belief_tints_its_cells_and_fades_after_a_while(film):
    cell = (5.5, 8.5)  # the most probable one, away from target and estimate
    ground = tuple(film.around(film.at(1.2), cell, 1)[0])
    stops = np.array(DARK.belief[-1])
    expected = stops[3] * stops[:3] * 255 + (1 - stops[3]) * np.array(DARK.ground[:3]) * 255
    assert film.around(film.at(1.8), cell, 1)[0] == pytest.approx(expected, abs=2)
    assert tuple(film.around(film.at(7.0), cell, 1)[0]) == ground


def test_pictures_do_not_depend_on_those_drawn_before(film):
    again = film.at(ARRIVES_S + 0.3)
    film.at(9.5)
    assert np.array_equal(film.at(ARRIVES_S + 0.3), again)


def test_the_cursor_goes_from_the_left_end_of_the_strip_to_the_right(film):
    box = film.painter.layout.strip
    row = round(film.painter.layout.height_px - box.high) - 1
    ink = np.round(np.array(DARK.ink[:3]) * 255).astype(int)

    def cursor(time_s):
        return np.flatnonzero((film.at(time_s)[row] == ink).all(axis=1))

    assert cursor(0.0)[0] == pytest.approx(box.left, abs=2)
    assert cursor(9.99)[-1] == pytest.approx(box.right, abs=3)
    assert cursor(5.0).mean() == pytest.approx((box.left + box.right) / 2, abs=4)


def test_a_light_ground_is_white(tmp_path):
    film = Film(write_trace(tmp_path / "t.mcap", [sent(1.0, 1, 0), frame(1.0, 1, 0, "received")]), light=True)
    picture = film.at(1.0)
    assert (picture[0, 0] == 255).all()
    assert has(picture.reshape(-1, 3), LIGHT.kind(0))


def test_a_trace_without_messages_has_pictures_too(tmp_path):
    assert Film(write_trace(tmp_path / "t.mcap", [frame(5.0, 1, 0, "weak")])).at(0.0).any()
