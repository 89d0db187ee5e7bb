"""An animated map for a talk: what `netsim export --gif` and `--mp4` do."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn

from netsim.cli.console import counted, say
from netsim.cli.watching import progress_bar
from netsim.errors import ScenarioError
from netsim.movie import Movie, MovieOptions, Progress, check_movie, write_movie
from netsim.replay import ReplayOptions

_KIB = 1024
_LARGE_BYTE = 8 * _KIB * _KIB


@dataclass(frozen=True, slots=True)
class Movies:
    """The movies that were asked for, as it was typed.

    Attributes:
        gif: Where an animated GIF goes.
        mp4: Where an MP4 goes.
        speed: Simulated seconds a second.
        hold_s: How long an arrow takes, simulated seconds.
        look: Size, length, colours.
    """

    gif: Path | None
    mp4: Path | None
    speed: float | None
    hold_s: float | None
    look: MovieOptions

    @property
    def paths(self) -> list[Path]:
        """Where they go."""
        return [path for path in (self.gif, self.mp4) if path is not None]

    def check(self, *, force: bool) -> None:
        """Refuse what cannot be before anything is made.

        Raises:
            ScenarioError: If a name has not the ending of its option, its folder does not exist, there is a file of that
                name that may not be replaced, or something is said of movies without one.
            NetsimError: If the encoder of MP4 is missing.
        """
        for option, path in (("gif", self.gif), ("mp4", self.mp4)):
            if path is not None and path.suffix.lower() != f".{option}":
                message = f"--{option} {path}: expected a name that ends in .{option}"
                raise ScenarioError(message)
        for path in self.paths:
            check_movie(path, force=force)
        if not self.paths and (self.speed, self.hold_s, self.look) != (None, None, MovieOptions()):
            message = (
                "--speed, --hold, --seconds, --fps, --width, --light: expected --gif or --mp4 as well, got neither"
            )
            raise ScenarioError(message)


def movie_command(trace: Path, movies: Movies, part: ReplayOptions, *, force: bool = False) -> None:
    """Make movies of a trace and say what they are.

    Args:
        trace: The trace.
        movies: Which.
        part: Window, message kinds and nodes.
        force: Whether files of those names may be replaced.
    """
    movies.check(force=force)
    options = replace(part, speed=movies.speed, hold_s=movies.hold_s)
    for path in movies.paths:
        with _shown(path) as progress:
            movie = write_movie(trace, path, options, movies.look, force=force, progress=progress)
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
