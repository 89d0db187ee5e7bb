"""An animated map for a talk: what `netsim export --gif` and `--mp4` do."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn

from netsim.cli.console import counted, say
from netsim.cli.watching import progress_bar
from netsim.errors import ScenarioError
from netsim.movie import Movie, MovieOptions, Progress, check_movie, write_movie
from netsim.replay import ReplayOptions

_KIB = 1024
_LARGE_BYTE = 8 * _KIB * _KIB


def check_movies(gif: Path | None, mp4: Path | None, *, force: bool) -> None:
    """Refuse places for movies before anything is made.

    Raises:
        ScenarioError: If a name has not the ending of its option, its folder does not exist, or there is a file of that
            name that may not be replaced.
        NetsimError: If the encoder of MP4 is missing.
    """
    for option, path in (("gif", gif), ("mp4", mp4)):
        if path is not None:
            if path.suffix.lower() != f".{option}":
                message = f"--{option} {path}: expected a name that ends in .{option}"
                raise ScenarioError(message)
            check_movie(path, force=force)


def movie_command(
    trace: Path,
    gif: Path | None,
    mp4: Path | None,
    options: ReplayOptions,
    look: MovieOptions,
    *,
    force: bool = False,
) -> None:
    """Make movies of a trace and say what they are.

    Args:
        trace: The trace.
        gif: Where an animated GIF goes, if one is asked for.
        mp4: Where an MP4 goes, if one is asked for.
        options: Window, pace, message kinds and nodes.
        look: Size, length, colours.
        force: Whether files of those names may be replaced.
    """
    check_movies(gif, mp4, force=force)
    for path in (gif, mp4):
        if path is not None:
            with _shown(path) as progress:
                movie = write_movie(trace, path, options, look, force=force, progress=progress)
            say(_told(movie))


def _told(movie: Movie) -> str:
    size = f"{movie.width_px} x {movie.height_px} pixels, {movie.seconds:.1f} s, {counted(movie.pictures, 'picture')}"
    said = f"wrote {movie.path}: {size}, {_bytes(movie.size_byte)}"
    if movie.path.suffix.lower() == ".gif" and movie.size_byte > _LARGE_BYTE:
        said += "; an MP4 is smaller, as is a GIF with less --width, --fps, --seconds, or fewer --kinds"
    return said


def _bytes(size_byte: int) -> str:
    if size_byte < _KIB * _KIB:
        return f"{size_byte / _KIB:.0f} KiB"
    return f"{size_byte / _KIB / _KIB:.1f} MiB"


@contextmanager
def _shown(path: Path) -> Iterator[Progress]:
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with progress_bar(*columns) as bar:
        task = bar.add_task(path.name, total=None) if bar else None

        def progress(what: str, done: float, total: float) -> None:
            if bar is not None and task is not None:
                bar.update(task, description=f"{path.name}: {what}", completed=done, total=total)

        yield progress
