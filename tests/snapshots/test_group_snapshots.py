import json
from pathlib import Path

import numpy as np
import pytest
from grouped import JOINT, STEPS, S, write_groups

from netsim.cli.track import track_command
from netsim.errors import ScenarioError
from netsim.flow.drawing import styled
from netsim.snapshots import look
from netsim.snapshots.group_moment import group_moment, joint_spans_ns, usual_group_times_ns
from netsim.snapshots.group_panel import draw_bars, draw_map, group_handles, said
from netsim.snapshots.group_picture import draw_groups, write_group_picture
from netsim.snapshots.load import TrackRun, load_track
from netsim.snapshots.picture import errors_of


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_groups(tmp_path_factory.mktemp("groups") / "trace.mcap")


@pytest.fixture(scope="module")
def run(trace: Path) -> TrackRun:
    return load_track(trace)


def test_an_instant_is_that_of_the_last_particles(run: TrackRun) -> None:
    now = group_moment(run, 5 * S + S // 2)
    assert {number: (track.mates, track.leader) for number, track in now.tracks.items()} == {
        0: ((0, 1), 1),
        1: ((0, 1), 1),
    }
    assert now.tracks[1].told_ns == 5 * S
    np.testing.assert_allclose(now.tracks[1].particles_m, [[65.0, 15.0], [69.0, 15.0]])
    np.testing.assert_allclose(now.tracks[1].weights, [0.25, 0.75])
    assert now.tracks[1].place_m == (68.0, 15.0)
    assert now.tracks[1].row == (0.0, 1.0)
    assert len(now.tracks[1].trail_m) == 6
    assert said(now) == "joint: tracks 0 and 1"
    assert said(group_moment(run, 2 * S)) == "2 groups"
    assert said(group_moment(run, 40 * S)) == "nobody leads"


def test_a_joint_group_lasts_until_its_tracks_are_told_apart(run: TrackRun) -> None:
    assert joint_spans_ns(run) == [(JOINT.start * S, (JOINT.stop - 1) * S)]


def test_the_usual_instants_are_before_amidst_and_after(run: TrackRun) -> None:
    before, amidst, word, late = usual_group_times_ns(run)
    assert before < JOINT.start * S <= amidst < JOINT.stop * S <= word < late <= (STEPS - 1) * S
    assert group_moment(run, word).words_m == [((110.0, 20.0), (10.0, 20.0))]
    assert group_moment(run, late).words_m == []


def test_a_map_has_groups_particles_leaders_and_the_word(run: TrackRun) -> None:
    from matplotlib.figure import Figure

    now = group_moment(run, (JOINT.stop + 1) * S)
    axes = Figure().subplots()
    draw_map(axes, run, now)
    assert [(patch.center, patch.radius) for patch in axes.patches] == [((98.0, 25.0), 30.0), ((28.0, 15.0), 30.0)]
    areas = axes.collections[0].get_sizes()
    assert areas[0] / areas[1] == pytest.approx(1 / 3)
    squares = [line for line in axes.lines if line.get_marker() == "s" and line.get_markersize() == 10.0]
    assert [(line.get_xdata()[0], line.get_markeredgecolor()) for line in squares] == [
        (110.0, look.track_colour(0)),
        (10.0, look.track_colour(1)),
    ]
    assert len(axes.texts) == 1
    labels = [handle.get_label() for handle in group_handles(run, [now])]
    assert "word on identities" in labels
    assert "joint group" not in labels


def test_bars_are_as_long_as_probabilities(run: TrackRun) -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    draw_bars(axes, group_moment(run, 9 * S))
    assert [bar.get_width() for bar in axes.patches] == [0.5] * 4
    assert [text.get_text() for text in axes.texts] == ["0.50"] * 4


def test_the_curve_is_the_error_and_its_shade_the_joint_group(run: TrackRun) -> None:
    with styled():
        figure = draw_groups(run, usual_group_times_ns(run))
    curves = figure.subfigs[2].axes[0]
    lines = {line.get_label(): line for line in curves.lines}
    np.testing.assert_allclose(lines["track 0"].get_ydata(), 3.0)
    assert curves.patches[0].get_x() == JOINT.start


def test_the_picture_is_equal_each_time(run: TrackRun, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        write_group_picture(run, [2 * S, 5 * S, 9 * S, 10 * S, 11 * S], tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_command_prints_a_line_for_every_track(
    trace: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    track_command(trace, None, None, as_json=False)
    told = capsys.readouterr().out
    assert told.count("0.50 0.50") == 2 * (STEPS - JOINT.stop)
    assert "1 joint group: tracks 0 1 from 4.0 to 7.0 s" in told
    track_command(trace, tmp_path / "p.svg", [5.0], as_json=True)
    first = json.loads(capsys.readouterr().out)[0]
    assert first["group"] == [0, 1]
    assert first["error_m"] == pytest.approx(3.0)
    assert first["spread_m"] == pytest.approx(np.sqrt(3.0))
    assert (tmp_path / "p.svg").exists()
    with pytest.raises(ScenarioError, match="at most 12 instants"):
        track_command(trace, tmp_path / "p.svg", [0.5 * step for step in range(13)], as_json=False)


def test_no_error_is_drawn_beyond_the_cut_off(tmp_path: Path) -> None:
    run = load_track(write_groups(tmp_path / "groups.mcap"))
    assert len(errors_of(run, (0, 0))[0]) == STEPS
    assert run.cut_off_m == 50.0
    run.cut_off_m = 3.0  # estimates are 3 m off
    assert errors_of(run, (0, 0)) == ([], [])
