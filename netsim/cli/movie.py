"""An animated map for a talk: what `netsim export --gif` and `--mp4` do."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn

from netsim.cli.console import counted, say
from netsim.cli.watching import progress_bar
from netsim.movie import Movie, MovieOptions, Progress, check_movie, write_movie
from netsim.replay import ReplayOptions

_KIB = 1024


def movie_command(
    trace: Path, outputs: list[Path], options: ReplayOptions, look: MovieOptions, *, force: bool = False
) -> None:
    """Make movies of a trace, each named by its ending, and say what they are.

    Args:
        trace: The trace.
        outputs: Where, with names that end in `.gif` or `.mp4`.
        options: Window, pace, message kinds and nodes.
        look: Size, length, colours.
        force: Whether files of those names may be replaced.
    """
    for path in outputs:
        check_movie(path, force=force)
    for path in outputs:
        with _shown(path) as progress:
            movie = write_movie(trace, path, options, look, force=force, progress=progress)
        say(_told(movie))


def _told(movie: Movie) -> str:
    size = f"{movie.width_px} x {movie.height_px} pixels, {movie.seconds:.1f} s, {counted(movie.pictures, 'picture')}"
    return f"wrote {movie.path}: {size}, {_bytes(movie.size_byte)}"


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
