"""Starting Rerun's viewer on a recording: on the screen, for browsers of this machine, or for a picture with no screen.

The viewer is a program of its own. It runs in a process group that is ended with the call, whatever happens.
"""

import contextlib
import io
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TypeVar

import rerun_cli  # type: ignore[import-untyped]
from PIL import Image
from rerun.experimental import ViewerClient

from netsim.errors import NetsimError
from netsim.replay.track import TIMELINE

_T = TypeVar("_T")
_LOOPBACK = "127.0.0.1"
_START_S = 30.0
_ATTEMPTS = 5
_SETTLE_S = 0.4
_STOP_S = 5.0
_NOTICES_S = 5.0
_TOP_BAR = 37  # height in points of the viewer's own bar of menus and warnings, which is no part of a picture
_REMEDIES = {
    r"render context|graphics adapter|NoSuitableAdapter": (
        "no Vulkan driver to draw with: apt-get install mesa-vulkan-drivers libvulkan1"
    ),
    r"WAYLAND_DISPLAY|DISPLAY is not set": (
        "no screen to show the replay on; use --serve, --save F.rrd, or --screenshot F.png --at S"
    ),
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


@dataclass(frozen=True)
class Listener:
    """A viewer that waits for data.

    Attributes:
        address: Where it takes them.
        process: The viewer.
    """

    address: str
    process: subprocess.Popen[bytes]

    def is_open(self) -> bool:
        """Whether it still runs."""
        return self.process.poll() is None


@contextlib.contextmanager
def listening(announce: Callable[[str], None] | None = None) -> Iterator[Listener]:
    """A viewer that shows what it is sent, and ends with the block.

    Args:
        announce: Serve to browsers of this machine, and call this with the address to open; None for the screen.

    Raises:
        NetsimError: If the viewer fails, for instance without a screen.
    """
    data, web = _free_port(), _free_port()
    options = ["--port", str(data), "--hide-welcome-screen"]
    options += [] if announce is None else ["--serve-web", "--web-viewer-port", str(web)]
    address = f"rerun+http://{_LOOPBACK}:{data}/proxy"
    with _viewer(*options) as (process, errors):
        _await_port(process, errors, data)
        if announce is not None:
            announce(f"http://{_LOOPBACK}:{web}/?url=rerun%2Bhttp://{_LOOPBACK}:{data}/proxy")
        try:
            yield Listener(address, process)
        except RuntimeError as error:  # it was closed, or failed, while it was sent to
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_STOP_S)
            if process.poll() != 0:
                raise _failed(errors) from error
        if process.poll():
            raise _failed(errors)


def draw(rrd: Path, instants_s: Sequence[float], size: tuple[int, int]) -> list[tuple[bytes, list[str]]]:
    """Draw pictures of a recording without a screen.

    Args:
        rrd: The recording.
        instants_s: Instants to show, simulated seconds.
        size: Width and height of a picture in points.

    Returns:
        For each instant the picture (PNG), and what the views complained of.

    Raises:
        NetsimError: If there is no Vulkan driver, or the viewer fails.
    """
    port = _free_port()
    window = f"{size[0]}x{size[1] + _TOP_BAR}"
    options = ("--headless", "--hide-welcome-screen", "--port", str(port), "--window-size", window)
    with _viewer(*options) as (process, errors):
        _await_port(process, errors, port)
        client = ViewerClient.connect(f"rerun+http://{_LOOPBACK}:{port}/proxy")
        _retry(process, errors, lambda: client.open(str(rrd)))
        pictures = []
        for number, at_s in enumerate(instants_s):
            client.set_time(TIMELINE, duration=float(at_s), play_state="paused")
            if number == 0:
                _pass_notices(process, errors, client)
            image = _settled(process, errors, client)
            reports = [f"{view.name}: {report}" for view in client.get_state().views for report in view.reports]
            pictures.append((_without_top_bar(image, size[0]), reports))
        return pictures


def _pass_notices(process: subprocess.Popen[bytes], errors: IO[bytes], client: ViewerClient) -> None:
    """Wait until the notices of the start are gone; they go only while pictures are drawn.

    The first picture compiles the shaders, which can exceed the viewer's time limit; the notices' time begins with it.
    """
    _retry(process, errors, client.take_screenshot)
    shown = time.monotonic()
    while time.monotonic() < shown + _NOTICES_S:
        _retry(process, errors, client.take_screenshot)
        time.sleep(_SETTLE_S)


def _settled(process: subprocess.Popen[bytes], errors: IO[bytes], client: ViewerClient) -> bytes:
    """A picture that does not change any more."""
    image = b""
    for _ in range(_ATTEMPTS):
        time.sleep(_SETTLE_S)
        before, image = image, _retry(process, errors, client.take_screenshot)
        if image == before:
            break
    return image


def _without_top_bar(png: bytes, width: int) -> bytes:
    """A picture of the window without the viewer's top bar; it may have several pixels a point."""
    with Image.open(io.BytesIO(png)) as picture:
        top = round(_TOP_BAR * picture.width / width)
        out = io.BytesIO()
        picture.convert("RGB").crop((0, top, picture.width, picture.height)).save(out, "PNG", optimize=True)
    return out.getvalue()


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
