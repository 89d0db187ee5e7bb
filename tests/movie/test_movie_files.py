"""The files: formats, lengths, sizes, refusals, and that nothing half-made is left."""

import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from movie_traces import write_trace
from PIL import Image

from netsim.cli.movie import Movies, movie_command
from netsim.errors import NetsimError, ScenarioError
from netsim.movie import MovieOptions, check_movie, write_movie
from netsim.movie.gif import Palette, write_gif
from netsim.replay import ReplayOptions

LOOK = MovieOptions(width_px=321, seconds=1.5, fps=8.0)


@pytest.fixture(scope="module")
def trace(tmp_path_factory):
    return write_trace(tmp_path_factory.mktemp("movie") / "t.mcap")


def test_a_gif_has_the_pictures_and_times_that_were_asked_for(trace, tmp_path):
    told = []
    path = tmp_path / "m.gif"
    movie = write_movie(trace, path, look=LOOK, progress=lambda what, done, total: told.append((what, done, total)))
    with Image.open(path) as image:
        assert image.n_frames == movie.pictures == 12
        assert image.size == (movie.width_px, movie.height_px)
        assert image.info["loop"] == 0
        delays_ms = []
        for number in range(image.n_frames):
            image.seek(number)
            delays_ms.append(image.info["duration"])
    assert movie.width_px == 320
    assert sum(delays_ms[:-1]) == pytest.approx(11 * 1000 / 8, abs=10)
    assert set(delays_ms[:-1]) == {120, 130}
    assert movie.size_byte == path.stat().st_size
    assert [step for step in told if step[0] == "drawing"] == [("drawing", number, 12) for number in range(12)]
    assert list(tmp_path.iterdir()) == [path]


def test_equal_traces_give_equal_files(trace, tmp_path):
    for name in ("a.gif", "b.gif"):
        write_movie(trace, tmp_path / name, look=LOOK)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_a_gif_shows_what_was_painted(tmp_path):
    """With few colours exactly, whatever changes from picture to picture."""
    rng = np.random.default_rng(1)
    colours = rng.integers(0, 64, (40, 3)) * 4
    pictures = [colours[rng.integers(0, 40, (12, 20))].astype(np.uint8) for _ in range(3)]
    pictures += [pictures[-1], pictures[-1].copy()]
    pictures[-1][5, 7] = colours[0]
    write_gif(tmp_path / "m.gif", pictures, pictures, 10.0)
    with Image.open(tmp_path / "m.gif") as image:
        for number, expected in enumerate(pictures):
            image.seek(number)
            assert np.array_equal(np.asarray(image.convert("RGB")), expected)


def test_a_palette_of_many_colours_is_near_to_all_and_has_the_commonest_ones_and_the_signs():
    rng = np.random.default_rng(2)
    picture = rng.integers(0, 256, (100, 100, 3)).astype(np.uint8)
    picture[:50] = (13, 16, 20)
    signs = rng.integers(0, 256, (5, 8, 3)).astype(np.uint8)
    palette = Palette([picture], signs)
    assert len(palette.colours) <= 255
    assert (palette.colours == (13, 16, 20)).all(axis=1).any()
    shown = palette.colours[palette.indices(picture)].astype(int)
    assert np.abs(shown - picture).mean() < 20
    assert (shown[:50] == (13, 16, 20)).all()
    assert {tuple(colour) for colour in signs.reshape(-1, 3)} <= {tuple(colour) for colour in palette.colours}


def test_a_palette_takes_no_more_memory_than_its_pictures():
    pictures = [np.full((300, 400, 3), shade, np.uint8) for shade in range(8)]
    tracemalloc.start()
    palette = Palette(pictures, pictures[0])
    _, most_byte = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(palette.colours) == 8
    assert most_byte < 16e6


def test_an_mp4_is_h264_that_all_players_take(trace, tmp_path):
    av = pytest.importorskip("av", reason="MP4 needs the extra netsim[movie]")
    movie = write_movie(trace, tmp_path / "m.mp4", look=LOOK)
    with av.open(str(tmp_path / "m.mp4")) as container:
        stream = container.streams.video[0]
        pictures = [each.to_ndarray(format="rgb24") for each in container.decode(stream)]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.average_rate == 8
        assert stream.codec_context.colorspace == 1  # BT.709
    assert len(pictures) == movie.pictures == 12
    assert pictures[0].shape == (movie.height_px, movie.width_px, 3)
    assert movie.height_px % 2 == movie.width_px % 2 == 0
    assert pictures[0][2, 2] == pytest.approx([13, 16, 20], abs=4)


def test_without_the_encoder_it_is_said_how_to_get_it(trace, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)  # importing it fails
    with pytest.raises(NetsimError, match=r"pip install -e '\.\[movie\]'"):
        write_movie(trace, tmp_path / "m.mp4", look=LOOK)
    assert list(tmp_path.iterdir()) == []


def test_names_that_will_not_do_are_refused(trace, tmp_path):
    for name, said in [("m.avi", "ends in .gif or .mp4"), ("no/m.gif", "a folder that exists")]:
        with pytest.raises(ScenarioError, match=said):
            check_movie(tmp_path / name)
    (tmp_path / "there.gif").write_bytes(b"mine")
    with pytest.raises(ScenarioError, match="--force"):
        write_movie(trace, tmp_path / "there.gif", look=LOOK)
    assert (tmp_path / "there.gif").read_bytes() == b"mine"
    write_movie(trace, tmp_path / "there.gif", look=LOOK, force=True)
    assert (tmp_path / "there.gif").read_bytes().startswith(b"GIF89a")
    (tmp_path / "folder.gif").mkdir()
    with pytest.raises(ScenarioError, match="that of a folder"):
        check_movie(tmp_path / "folder.gif", force=True)


def test_a_window_beyond_the_trace_is_refused(trace, tmp_path):
    with pytest.raises(ScenarioError, match="where the trace ends"):
        write_movie(trace, tmp_path / "m.gif", ReplayOptions(start_s=99.0))


@pytest.mark.parametrize("ending", ["gif", "mp4"])
def test_an_interrupted_movie_leaves_nothing_and_spares_what_was_there(trace, tmp_path, ending):
    if ending == "mp4":
        pytest.importorskip("av", reason="MP4 needs the extra netsim[movie]")
    path = tmp_path / f"m.{ending}"
    path.write_bytes(b"mine")

    def interrupt(what, done, total):
        if what == "drawing" and done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_movie(trace, path, look=LOOK, force=True, progress=interrupt)
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [(path.name, b"mine")]


def test_the_command_says_what_it_wrote(trace, tmp_path, capsys):
    path = tmp_path / "m.gif"
    movie_command(trace, Movies(path, None, None, 0.5, LOOK), ReplayOptions())
    said = capsys.readouterr().out
    assert said.startswith(f"wrote {path}: 320 x ")
    assert "1.5 s, 12 pictures, " in said
    assert "KiB" in said


def test_the_command_wants_the_ending_of_the_option_and_a_movie_for_its_options(trace, tmp_path):
    with pytest.raises(ScenarioError, match=r"--gif .*m\.mp4: expected a name that ends in \.gif"):
        movie_command(trace, Movies(tmp_path / "m.mp4", None, None, None, LOOK), ReplayOptions())
    with pytest.raises(ScenarioError, match="expected --gif or --mp4 as well"):
        Movies(None, None, 2.0, None, MovieOptions()).check(force=False)
    Movies(None, None, None, None, MovieOptions()).check(force=False)


def test_a_movie_needs_no_rerun(trace, tmp_path):
    code = (
        "import sys; from netsim.movie import write_movie, MovieOptions;"
        "write_movie(sys.argv[1], sys.argv[2], look=MovieOptions(width_px=320, seconds=0.5, fps=4));"
        "print(*sys.modules, sep='\\n')"
    )
    command = [sys.executable, "-c", code, str(trace), str(tmp_path / "m.gif")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert {"rerun", "pyarrow", "matplotlib.pyplot"} & set(done.stdout.split()) == set()
    assert Path(tmp_path / "m.gif").exists()
