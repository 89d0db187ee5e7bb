"""Starting Rerun's viewer on a recording: on the screen, for browsers of this machine, or for a picture with no screen.

The viewer is a program of its own. It runs in a process group that is ended with the call, whatever happens.
"""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, TypeVar

import rerun_cli  # type: ignore[import-untyped]
from rerun.experimental import ViewerClient

from netsim.errors import NetsimError
from netsim.replay.track import TIMELINE

_T = TypeVar("_T")
_LOOPBACK = "127.0.0.1"
_START_S = 30.0
_ATTEMPTS = 5
_SETTLE_S = 0.4
_STOP_S = 5.0
_NOTICES_S = 4.5
_REMEDIES = {
    r"render context|graphics adapter|NoSuitableAdapter": (
        "no Vulkan driver to draw with: apt-get install mesa-vulkan-drivers libvulkan1"
    ),
    r"WAYLAND_DISPLAY|DISPLAY is not set": "no screen to show the replay on; save it, serve it or take a screenshot",
}
_COLOUR_CODE = re.compile("\x1b\\[[0-9;]*m")
_COMPLAINT = re.compile(r"panicked|error", re.IGNORECASE)


def show(rrd: Path) -> None:
    """Open a recording on the screen; returns when the viewer is closed.

    Raises:
        NetsimError: If the viewer fails, for instance without a screen.
    """
    with _viewer("--port", str(_free_port()), str(rrd)) as (process, errors):
        if process.wait() > 0:
            raise _failed(errors)


def serve(rrd: Path, announce: Callable[[str], None]) -> None:
    """Offer a recording to browsers of this machine until interrupted.

    Args:
        rrd: The recording.
        announce: Called with the address to open.

    Raises:
        NetsimError: If the server fails.
    """
    web, data = _free_port(), _free_port()
    options = ("--serve-web", "--port", str(data), "--web-viewer-port", str(web))
    with contextlib.suppress(KeyboardInterrupt), _viewer(*options, str(rrd)) as (process, errors):
        _await_port(process, errors, web)
        announce(f"http://{_LOOPBACK}:{web}/?url=rerun%2Bhttp://{_LOOPBACK}:{data}/proxy")
        process.wait()
        raise _failed(errors)


def picture(rrd: Path, at_s: float, size: tuple[int, int]) -> tuple[bytes, list[str]]:
    """Draw one picture of a recording without a screen.

    Args:
        rrd: The recording.
        at_s: Instant to show, simulated seconds.
        size: Width and height of the window in points.

    Returns:
        The picture (PNG), and what the views complained of.

    Raises:
        NetsimError: If there is no Vulkan driver, or the viewer fails.
    """
    port = _free_port()
    window = f"{size[0]}x{size[1]}"
    options = ("--headless", "--hide-welcome-screen", "--port", str(port), "--window-size", window)
    with _viewer(*options) as (process, errors):
        _await_port(process, errors, port)
        started = time.monotonic()
        client = ViewerClient.connect(f"rerun+http://{_LOOPBACK}:{port}/proxy")
        _retry(process, errors, lambda: client.open(str(rrd)))
        client.set_time(TIMELINE, duration=float(at_s), play_state="paused")
        # The first picture compiles the shaders, which can exceed the viewer's time limit; notices of the start lie over
        # the next ones, and go only while pictures are drawn.
        while time.monotonic() < started + _NOTICES_S:
            _retry(process, errors, client.take_screenshot)
            time.sleep(_SETTLE_S)
        image = _retry(process, errors, client.take_screenshot)
        reports = [f"{view.name}: {report}" for view in client.get_state().views for report in view.reports]
        return image, reports


@contextlib.contextmanager
def _viewer(*options: str) -> Iterator[tuple[subprocess.Popen[bytes], IO[bytes]]]:
    """The viewer with these options, reachable from this machine only, in a process group of its own."""
    binary = Path(rerun_cli.__file__).parent / "rerun"
    # Keeps the viewer from reporting its use to its makers: it does not in automated surroundings.
    environment = {**os.environ, "CI": "true", "RERUN_APP_ONLY": "true"}
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [str(binary), "--bind", _LOOPBACK, *options],
            stdin=subprocess.DEVNULL,
            stdout=errors,
            stderr=errors,
            env=environment,
            start_new_session=True,
        )
        try:
            with _terminable():
                yield process, errors
        finally:
            _end(process)


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """Let a polite request to terminate unwind this program, so that the viewer ends with it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _end(process: subprocess.Popen[bytes]) -> None:
    for how in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, how)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_STOP_S)
            return


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((_LOOPBACK, 0))
        return int(probe.getsockname()[1])


def _await_port(process: subprocess.Popen[bytes], errors: IO[bytes], port: int) -> None:
    """Wait until the viewer answers at a port."""
    deadline = time.monotonic() + _START_S
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(OSError), socket.create_connection((_LOOPBACK, port), timeout=1.0):
            return
        time.sleep(0.05)
    raise _failed(errors)


def _retry(process: subprocess.Popen[bytes], errors: IO[bytes], call: Callable[[], _T]) -> _T:
    for _ in range(_ATTEMPTS):
        if process.poll() is not None:
            break
        with contextlib.suppress(OSError, RuntimeError):
            return call()
        time.sleep(_SETTLE_S)
    raise _failed(errors)


def _failed(errors: IO[bytes]) -> NetsimError:
    """What to tell a user about a viewer that ended or does not answer."""
    errors.seek(0)
    text = _COLOUR_CODE.sub("", errors.read().decode(errors="replace"))
    for sign, remedy in _REMEDIES.items():
        if re.search(sign, text):
            return NetsimError(remedy)
    lines = [line for line in text.splitlines() if _COMPLAINT.search(line)]
    return NetsimError(f"the viewer failed: {lines[0].strip() if lines else 'it does not answer'}")
