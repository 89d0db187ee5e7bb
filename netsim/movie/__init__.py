"""From a trace to a movie of the map for a talk: an animated GIF or an MP4.

Matplotlib takes a while to import, so it is imported when a movie is made, not before. Rerun is not needed.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from netsim.errors import ScenarioError
from netsim.files import check_place, whole_file
from netsim.movie.options import MovieOptions, Reel, plan
from netsim.replay.check import check_window
from netsim.replay.options import ReplayOptions
from netsim.trace.reader import last_time_ns, trace_metadata

if TYPE_CHECKING:
    from netsim.movie.painter import Painter, Pixels

__all__ = ["Movie", "MovieOptions", "Progress", "check_movie", "write_movie"]

Progress = Callable[[str, float, float], None]
"""Called now and then with what is being done, how far it is, and how far it goes."""

_USUAL = {".gif": (800, 12.0), ".mp4": (1280, 25.0)}
"""Width in pixels and pictures a second by ending of the file's name."""
_SAMPLES = 24  # pictures that the palette is made of


@dataclass(frozen=True)
class Movie:
    """What was written.

    Attributes:
        path: Where.
        width_px: Width of a picture.
        height_px: Height of a picture.
        pictures: How many.
        seconds: How long it takes.
        size_byte: Size of the file.
    """

    path: Path
    width_px: int
    height_px: int
    pictures: int
    seconds: float
    size_byte: int


def check_movie(path: Path | str, *, force: bool = False) -> None:
    """Make sure that a movie can be written, without writing anything.

    Raises:
        ScenarioError: If its name ends neither in `.gif` nor in `.mp4`, its folder does not exist, or there is something
            of that name that may not be replaced.
        NetsimError: If the encoder of MP4 is missing.
    """
    if Path(path).suffix.lower() not in _USUAL:
        msg = f"{path}: expected the name of a movie that ends in {' or '.join(_USUAL)}"
        raise ScenarioError(msg)
    check_place(Path(path), force=force, option=f"--{Path(path).suffix[1:].lower()}")
    if Path(path).suffix.lower() == ".mp4":
        from netsim.movie.mp4 import check_mp4

        check_mp4()


def write_movie(
    trace: Path | str,
    path: Path | str,
    options: ReplayOptions | None = None,
    look: MovieOptions | None = None,
    *,
    force: bool = False,
    progress: Progress = lambda what, done, total: None,
) -> Movie:
    """Make a movie of a trace's map. An interrupted one leaves no file.

    Args:
        trace: The trace.
        path: Where; a name that ends in `.gif` or `.mp4`.
        options: Window, pace, message kinds and nodes, as in a replay.
        look: Size, length, colours.
        force: Whether a file of that name may be replaced.
        progress: Told how far it is.

    Returns:
        What was written.

    Raises:
        ScenarioError: If the name will not do (see `check_movie`), the trace has not what the options ask for, or they
            ask for too long a movie.
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If the encoder of MP4 is missing, or the movie cannot be written.
    """
    check_movie(path, force=force)
    options, look = options or ReplayOptions(), look or MovieOptions()
    check_window(trace, options)
    width_px, fps = _USUAL[Path(path).suffix.lower()]
    reel = plan(options, look, look.fps or fps, last_time_ns(trace))
    painter = _painter(Path(trace), reel, options, look.width_px or width_px, look.light, progress)
    with whole_file(Path(path), "the movie") as part:
        _write(part, Path(path).suffix.lower(), painter, reel, progress)
    layout = painter.layout
    size_byte = Path(path).stat().st_size
    return Movie(Path(path), layout.width_px, layout.height_px, reel.count, reel.count / reel.fps, size_byte)


def _painter(
    trace: Path, reel: Reel, options: ReplayOptions, width_px: int, light: bool, progress: Progress
) -> "Painter":
    from netsim.movie.cast import load_cast
    from netsim.movie.painter import Painter
    from netsim.movie.story import read_story

    cast = load_cast(trace)
    story = read_story(trace, cast, reel, options, progress)
    return Painter(story, cast, trace_metadata(trace).get("scenario", trace.stem), width_px, light=light)


def _write(part: Path, ending: str, painter: "Painter", reel: Reel, progress: Progress) -> None:
    if ending == ".mp4":
        from netsim.movie.mp4 import write_mp4

        write_mp4(
            part, _painted(painter, reel, progress), (painter.layout.width_px, painter.layout.height_px), reel.fps
        )
        return
    from netsim.movie.gif import write_gif

    step = max(1, reel.count // _SAMPLES)
    samples = [painter.paint(picture) for picture in range(step // 2, reel.count, step)]
    signs = painter.layout.legend.cut(samples[0])
    write_gif(part, _painted(painter, reel, progress), samples, reel.fps, signs=signs)


def _painted(painter: "Painter", reel: Reel, progress: Progress) -> "Iterator[Pixels]":
    for picture in range(reel.count):
        progress("drawing", picture, reel.count)
        yield painter.paint(picture)
