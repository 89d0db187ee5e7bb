"""From a trace to Rerun: watch a run, save it as a recording, or take a picture of an instant.

Rerun takes a second to import, so it is imported when one of these functions is called, not before.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path

from netsim.errors import NetsimError, TraceError
from netsim.replay.options import ReplayOptions

__all__ = ["ReplayOptions", "save", "screenshot", "serve", "view"]

_SIZE = (1400, 900)


def save(trace: Path | str, rrd_path: Path | str, options: ReplayOptions | None = None) -> None:
    """Convert a trace into a Rerun recording (`.rrd`) with its layout inside.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes, or the recording cannot be written.
    """
    from netsim.replay.convert import save_recording

    try:
        save_recording(Path(trace), Path(rrd_path), options or ReplayOptions())
    except (OSError, RuntimeError) as error:
        msg = f"{rrd_path}: cannot write the recording: {error}"
        raise TraceError(msg) from error


def view(trace: Path | str, options: ReplayOptions | None = None) -> None:
    """Show a trace on the screen; returns when the viewer is closed.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If the viewer fails, for instance without a screen.
    """
    from netsim.replay.viewer import show

    with tempfile.TemporaryDirectory(prefix="netsim-replay-") as folder:
        show(_saved(Path(trace), Path(folder), options))


def serve(
    trace: Path | str, options: ReplayOptions | None = None, *, announce: Callable[[str], None] = lambda address: None
) -> None:
    """Offer a trace to browsers of this machine (never of others) until interrupted.

    Args:
        trace: The trace.
        options: What to show.
        announce: Called with the address to open.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If the server fails.
    """
    from netsim.replay.viewer import serve as serve_recording

    with tempfile.TemporaryDirectory(prefix="netsim-replay-") as folder:
        serve_recording(_saved(Path(trace), Path(folder), options), announce)


def screenshot(
    trace: Path | str,
    png: Path | str,
    at_s: float,
    options: ReplayOptions | None = None,
    *,
    size: tuple[int, int] = _SIZE,
) -> list[str]:
    """Draw one instant of a trace without a screen.

    Args:
        trace: The trace, or a recording (`.rrd`) made of it.
        png: Where to put the picture.
        at_s: The instant, simulated seconds.
        options: What to show.
        size: Width and height of the window in points (the picture may have more pixels).

    Returns:
        What the views complained of; empty if all is well.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If there is no Vulkan driver to draw with, the viewer fails, or the picture cannot be written.
    """
    from netsim.replay.viewer import picture

    with tempfile.TemporaryDirectory(prefix="netsim-replay-") as folder:
        image, reports = picture(_saved(Path(trace), Path(folder), options), at_s, size)
    try:
        Path(png).write_bytes(image)
    except OSError as error:
        msg = f"{png}: cannot write the picture: {error.strerror}"
        raise NetsimError(msg) from error
    return reports


def _saved(source: Path, folder: Path, options: ReplayOptions | None) -> Path:
    """The recording of a trace in a folder, or the source itself if it is a recording."""
    if source.suffix == ".rrd":
        return source
    rrd = folder / f"{source.stem}.rrd"
    save(source, rrd, options)
    return rrd
