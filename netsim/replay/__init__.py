"""From a trace to Rerun: watch a run, save it as a recording, or take a picture of an instant.

Rerun takes a second to import, so it is imported when one of these functions is called, not before.
"""

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from netsim.errors import ScenarioError, TraceError
from netsim.files import whole_file
from netsim.replay.check import check_instant, check_window, node_ids, node_table
from netsim.replay.options import ReplayOptions
from netsim.trace.mending import mended

__all__ = [
    "ReplayOptions",
    "check_instant",
    "check_window",
    "live",
    "node_ids",
    "save",
    "screenshot",
    "screenshots",
    "serve",
    "view",
]

_SIZE = (1400, 900)
_RECORDING_MAGIC = b"RRF"
# Rerun logs by itself; that a trace was cut short is told by our reader already (of such a one Rerun may complain of every
# message), that a viewer is gone by our errors.
os.environ.setdefault("RUST_LOG", "warn,re_mcap=off,re_grpc_client=off,re_sdk=off")


def save(trace: Path | str, rrd_path: Path | str, options: ReplayOptions | None = None) -> None:
    """Convert a trace into a Rerun recording (`.rrd`) with its layout inside; an interrupted one leaves no file.

    Raises:
        ScenarioError: If the recording would replace the trace itself, or the trace has not what the options ask for
            (see `check_window`).
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If the recording cannot be written.
    """
    _spare_trace(Path(trace), Path(rrd_path))
    check_window(trace, options or ReplayOptions())
    node_table(Path(trace))  # what is wrong is said of the trace, not of a copy
    from netsim.replay.convert import save_recording

    with whole_file(Path(rrd_path), "the recording") as part, mended(Path(trace)) as complete:
        try:
            save_recording(complete, part, options or ReplayOptions())
        except RuntimeError as error:
            _write_more(part)
            raise OSError(str(error)) from error


def _spare_trace(trace: Path, out: Path) -> None:
    if out.exists() and trace.exists() and out.samefile(trace):
        msg = f"{out}: expected the name of a recording, got that of the trace itself, which would be lost"
        raise ScenarioError(msg)


def _write_more(part: Path) -> None:
    """Find out why a file cannot be written: Rerun only says that it failed.

    Raises:
        OSError: With the reason, if the file takes no more.
    """
    with part.open("ab") as stream:
        stream.write(bytes(1 << 16))
        stream.flush()
        os.fsync(stream.fileno())


def view(trace: Path | str, options: ReplayOptions | None = None) -> None:
    """Show a trace on the screen; returns when the viewer is closed.

    Raises:
        ScenarioError: If the trace has not what the options ask for.
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
        ScenarioError: If the trace has not what the options ask for.
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If the server fails.
    """
    from netsim.replay.viewer import serve as serve_recording

    with tempfile.TemporaryDirectory(prefix="netsim-replay-") as folder:
        serve_recording(_saved(Path(trace), Path(folder), options), announce)


def live(
    trace: Path | str,
    options: ReplayOptions | None = None,
    *,
    announce: Callable[[str], None] | None = None,
    told: Callable[[int, bool], None] = lambda shown_ns, is_over: None,
) -> None:
    """Show a run while it is going; returns when the viewer is closed.

    Args:
        trace: Where the finished trace will be; before, it is read under its partial name.
        options: What to show.
        announce: Serve to browsers of this machine, and call this with the address to open; None for the screen.
        told: Called after each look with how far the run is shown (simulated ns), and whether it is over.

    Raises:
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If the viewer fails, for instance without a screen.
    """
    from netsim.replay.live import watch

    watch(Path(trace), options or ReplayOptions(), announce, told)


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
        size: Width and height of the picture in points (it may have more pixels).

    Returns:
        What the views complained of; empty if all is well.

    Raises:
        ScenarioError: If the picture's name does not end in `.png`, or the trace has not what the options ask for.
        TraceError: If the trace cannot be read, is damaged or names no nodes.
        NetsimError: If there is no Vulkan driver to draw with, the viewer fails, or the picture cannot be written.
    """
    return screenshots(trace, [(png, at_s)], options, size=size)


def screenshots(
    trace: Path | str,
    pictures: Sequence[tuple[Path | str, float]],
    options: ReplayOptions | None = None,
    *,
    size: tuple[int, int] = _SIZE,
) -> list[str]:
    """Draw several instants of a trace, converting it once; see `screenshot`.

    Args:
        trace: The trace, or a recording (`.rrd`) made of it.
        pictures: Where to put each picture, and its instant, simulated seconds.
        options: What to show.
        size: Width and height of the pictures in points.

    Returns:
        What the views complained of, each complaint once; empty if all is well.
    """
    _check_pictures(pictures)
    from netsim.replay.viewer import draw

    reports: list[str] = []
    with tempfile.TemporaryDirectory(prefix="netsim-replay-") as folder:
        recording = _saved(Path(trace), Path(folder), options)
        drawn = draw(recording, [at_s for _, at_s in pictures], size)
        for (png, _), (image, complaints) in zip(pictures, drawn, strict=True):
            _write(Path(png), image)
            reports += [complaint for complaint in complaints if complaint not in reports]
    return reports


def _check_pictures(pictures: Sequence[tuple[Path | str, float]]) -> None:
    for png, at_s in pictures:
        if Path(png).suffix.lower() != ".png":
            msg = f"{png}: expected the name of a picture that ends in .png"
            raise ScenarioError(msg)
        if not 0 <= at_s < float("inf"):
            msg = f"{png}: expected an instant >= 0 s, got {at_s:g} s"
            raise ScenarioError(msg)


def _write(png: Path, image: bytes) -> None:
    with whole_file(png, "the picture") as part:
        part.write_bytes(image)


def _saved(source: Path, folder: Path, options: ReplayOptions | None) -> Path:
    """The recording of a trace in a folder, or the source itself if it is a recording."""
    if source.suffix == ".rrd":
        _check_recording(source)
        return source
    rrd = folder / f"{source.stem}.rrd"
    save(source, rrd, options)
    return rrd


def _check_recording(rrd: Path) -> None:
    try:
        with rrd.open("rb") as stream:
            begin = stream.read(len(_RECORDING_MAGIC))
    except OSError as error:
        msg = f"{rrd}: cannot read the recording: {error.strerror}"
        raise TraceError(msg) from error
    if begin != _RECORDING_MAGIC:
        msg = f"{rrd}: not a Rerun recording, though its name ends in .rrd"
        raise TraceError(msg)
