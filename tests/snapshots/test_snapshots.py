"""Snapshots of a track: how things stand at an instant, what the panels show, the files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from PIL import Image
from tracked import HALF_S, write_track

from netsim.errors import NetsimError, ScenarioError
from netsim.snapshots import look
from netsim.snapshots.load import TrackRun, load_track
from netsim.snapshots.moment import in_seconds, moment, usual_times_ns
from netsim.snapshots.picture import draw, write_picture


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> TrackRun:
    return load_track(write_track(tmp_path_factory.mktemp("track") / "track.mcap"))


@pytest.fixture(scope="module")
def central(tmp_path_factory: pytest.TempPathFactory) -> TrackRun:
    return load_track(write_track(tmp_path_factory.mktemp("central") / "track.mcap", central=True))


def test_an_instant_is_that_of_the_last_belief(run: TrackRun) -> None:
    this = moment(run, 2 * HALF_S + 1)
    now = this.tracks[0, 0]
    assert (now.step.number, now.step.node) == (2, 2)
    assert now.choice is not None
    assert (now.choice.destination, list(now.choice.candidate)) == (3, [3, 0])
    assert now.trail_m == [(23.75, 7.5), (23.75, 12.5)]  # nothing of the uniform belief of step 0
    assert now.led_m == [(10.0, 10.0), (30.0, 20.0), (10.0, 30.0)]
    assert this.targets[0] == pytest.approx((22.5, 12.5), abs=1e-6)
    assert this.ways_m[0][:3] == [(22.5, 2.5), (22.5, 7.5), (22.5, 12.5)]
    assert this.down == frozenset()
    assert moment(run, 7 * HALF_S).down == {3}


def test_the_arrow_goes_to_who_took_the_belief_in_the_end(tmp_path: Path) -> None:
    now = moment(load_track(write_track(tmp_path / "track.mcap", refused=True)), 2 * HALF_S + 1).tracks[0, 0]
    assert now.choice is not None
    assert (now.choice.destination, list(now.choice.candidate)) == (0, [3, 0])


def test_an_old_belief_is_no_belief(run: TrackRun) -> None:
    assert list(moment(run, 7 * HALF_S + 10 * HALF_S).tracks) == [(0, 0)]
    assert moment(run, 7 * HALF_S + 10 * HALF_S + 1).tracks == {}


def test_the_usual_instants_are_spread_over_the_track(run: TrackRun) -> None:
    """Beliefs from 0 to 3.5 s; the middles of the thirds are 0.58, 1.75 and 2.92 s."""
    assert usual_times_ns(run) == [HALF_S, 3 * HALF_S, 6 * HALF_S]


def test_instants_are_written_as_short_as_they_are_true() -> None:
    assert [in_seconds(time_ns) for time_ns in (0, 1_500_000_000, 6_010_000_000, 250_000_000)] == [
        "0.0 s", "1.5 s", "6.0 s", "0.25 s",
    ]  # fmt: skip


def lines_of(figure_axes, marker: str, colour: str) -> list[tuple[float, float]]:
    """Points of all lines with a marker in a colour (of face or edge)."""
    found = []
    for line in figure_axes.lines:
        assert isinstance(line, Line2D)
        colours = {
            to_hex(each).upper() for each in (line.get_markeredgecolor(), line.get_markerfacecolor()) if each != "none"
        }
        if line.get_marker() == marker and colour.upper() in colours:
            found += list(zip(*line.get_data(), strict=True))
    return found


def test_a_panel_shows_belief_target_leader_and_neighbours(run: TrackRun) -> None:
    axes = draw(run, [2 * HALF_S]).axes[0]
    assert axes.get_title(loc="left") == "1.0 s"
    assert axes.get_title(loc="right") == "c leads, 1.2 m off"
    assert lines_of(axes, "+", look.TARGET) == [pytest.approx((22.5, 12.5))]
    assert lines_of(axes, "s", look.LEADER) == [(10.0, 30.0)]
    assert lines_of(axes, "s", look.NEIGHBOUR) == [(30.0, 40.0), (10.0, 10.0)]
    assert lines_of(axes, "D", look.BEARING) == [(30.0, 20.0)]
    assert len(lines_of(axes, "D", look.AMPLITUDE)) == 3
    (image,) = (each for each in axes.get_images() if isinstance(each, AxesImage))
    shown = image.get_array()
    np.testing.assert_allclose(shown[2, 4:6], [1.0, 1 / 3])
    assert shown.count() == 2
    assert list(image.get_extent()) == [0.0, 40.0, 0.0, 15.0]  # as many rows as the cells need


def test_who_is_down_is_crossed_out(run: TrackRun) -> None:
    axes = draw(run, [7 * HALF_S]).axes[0]
    assert lines_of(axes, "x", look.DOWN) == [(30.0, 40.0)]
    assert len(lines_of(axes, "D", look.AMPLITUDE)) == 2


def with_lines(run: TrackRun, lines: list[tuple[int, int]]) -> TrackRun:
    """The same run, in which every belief was that of several tracks and threads."""
    return replace(
        run,
        steps=[replace(each, line=line) for each in run.steps for line in lines],
        guesses=[replace(each, line=line) for each in run.guesses for line in lines],
    )


@pytest.mark.parametrize(
    ("lines", "said", "names"),
    [
        ([(0, 0), (0, 1), (0, 2)], "3 threads", ["thread 1", "thread 2", "thread 3"]),
        ([(70_000, 0), (9, 0)], "2 tracks", ["track 1", "track 2"]),
        ([(7, 0), (9, 0), (9, 1)], "3 tracks", ["track 1, thread 1", "track 2, thread 1", "track 2, thread 2"]),
    ],
)
def test_tracks_and_threads_are_named_and_have_curves_of_their_own(run: TrackRun, lines, said, names) -> None:
    several = with_lines(run, lines)
    figure = draw(several, [2 * HALF_S])
    assert figure.axes[0].get_title(loc="right") == said
    ordinals = range(1, len({track for track, _ in lines}) + 1)
    on_map = [text.get_text() for text in figure.axes[0].texts if text.get_text()]
    assert sorted(on_map) == [f"track {each}" for each in ordinals if len(ordinals) > 1]
    curves = [line for line in figure.axes[-1].lines if str(line.get_label()).startswith("error")]
    assert [line.get_label() for line in curves] == [f"error, {name}" for name in names]
    assert all(list(line.get_data()[0]) == [step / 2 for step in range(8)] for line in curves)
    assert len({line.get_color() for line in curves}) == len(lines)
    assert moment(several, 2 * HALF_S).tracks[lines[-1]].trail_m == moment(run, 2 * HALF_S).tracks[0, 0].trail_m


def test_an_outage_is_told_and_shaded(run: TrackRun) -> None:
    figure = draw(replace(run, outages_ns=[(2 * HALF_S, 3 * HALF_S)]), [2 * HALF_S, 3 * HALF_S])
    assert [axes.get_title(loc="right") for axes in figure.axes[:2]] == ["no leader, last c", "d leads, 1.2 m off"]
    labels = [text.get_text() for text in figure.axes[-1].get_legend().get_texts()]
    assert labels == ["error", "belief: root of its variance", "no leader"]
    assert run.outages_ns == []  # others still lead when one crashes


def test_a_belief_at_the_centre_has_no_leader(central: TrackRun) -> None:
    figure = draw(central, [HALF_S, 2 * HALF_S])
    assert figure.axes[0].get_title(loc="right") == "belief at the centre, 1.2 m off"
    assert lines_of(figure.axes[0], "s", look.LEADER) == []
    assert lines_of(figure.axes[0], "*", look.CENTRE) == [(20.0, 5.0)]
    labels = {text.get_text() for legend in figure.subfigs[1].legends for text in legend.get_texts()}
    assert "sink" in labels
    assert not labels & {"leader", "its neighbours", "last leaders"}


def test_the_curve_below_is_the_error_of_all_estimates(run: TrackRun) -> None:
    curve = next(line for line in draw(run, [HALF_S]).axes[-1].lines if line.get_label() == "error")
    times_s, errors_m = curve.get_data()
    assert list(times_s) == [step / 2 for step in range(8)]
    assert list(errors_m)[1:] == pytest.approx([1.25] * 7)


def test_what_is_beyond_the_scale_is_marked_at_its_end(run: TrackRun) -> None:
    far = replace(run.guesses[3], place_m=(400.0, 17.5))
    axes = draw(replace(run, guesses=[*run.guesses[:3], far, *run.guesses[4:]]), [HALF_S]).axes[-1]
    (marks,) = (line for line in axes.lines if line.get_marker() == "^")
    assert list(marks.get_xdata()) == [1.5]
    assert max(marks.get_ydata()) < axes.get_ylim()[1] < 400.0


def test_of_two_beliefs_in_a_cell_the_more_probable_one_counts(run: TrackRun) -> None:
    steps = run.steps[2:4]
    both = [replace(steps[0], line=(0, 1)), replace(steps[0], belief=steps[1].belief)]
    (image,) = draw(replace(run, steps=both), [2 * HALF_S]).axes[0].get_images()
    shown = image.get_array()
    np.testing.assert_allclose(shown[2:4, 4:6], [[1.0, 1 / 3]] * 2)
    assert shown.count() == 4


def test_the_files_are_equal_each_time(run: TrackRun, tmp_path: Path) -> None:
    paths = [tmp_path / f"{number}.svg" for number in range(2)]
    for path in paths:
        write_picture(run, [HALF_S], path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_the_picture_has_the_colours_of_its_signs(run: TrackRun, tmp_path: Path) -> None:
    write_picture(run, [HALF_S], tmp_path / "track.png")
    picture = np.asarray(Image.open(tmp_path / "track.png").convert("RGB")).astype(int)
    for colour in (look.LEADER, look.NEIGHBOUR, look.TARGET, look.AMPLITUDE):
        rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        assert (np.abs(picture - rgb).max(axis=2) < 8).sum() > 50


def test_what_cannot_be_drawn_is_told(run: TrackRun, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="expected beliefs of where a target is, got none"):
        load_track(write_track(tmp_path / "none.mcap", beliefs=False))
    with pytest.raises(NetsimError, match=r"none/x\.png: cannot write the picture"):
        write_picture(run, [HALF_S], tmp_path / "none" / "x.png")
