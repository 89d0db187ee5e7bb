"""The replay as it is seen: a picture drawn without a screen, and the viewer's end with ours."""

import io
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from synthetic import write_synthetic

from netsim import replay
from netsim.errors import NetsimError
from netsim.replay import style

AT_S = 2.1
WARNING = (255, 122, 12, 255)  # the viewer's own warnings, such as "Software rasterizer"


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("grid") / "grid.mcap"
    write_synthetic(path, duration_s=4.0)
    return path


def near(picture: np.ndarray, colour: style.Rgba, tolerance: int = 12) -> int:
    """How many pixels have nearly that colour."""
    return int((np.abs(picture.astype(int) - colour[:3]).max(axis=2) <= tolerance).sum())


def test_pictures_show_nodes_links_and_messages_without_the_viewers_bar(grid: Path, tmp_path: Path) -> None:
    pictures = [(tmp_path / "first.png", 0.9), (tmp_path / "shot.png", AT_S)]
    try:
        reports = replay.screenshots(grid, pictures, size=(1000, 700))
    except NetsimError as error:
        if "no Vulkan driver" in str(error):
            pytest.skip(str(error))
        raise
    assert reports == []
    first, picture = (np.asarray(Image.open(io.BytesIO(png.read_bytes())).convert("RGB")) for png, _ in pictures)
    assert first.shape == picture.shape
    assert (first != picture).any()
    assert picture.shape[1] / picture.shape[0] == pytest.approx(1000 / 700, rel=0.01)
    # The uppermost line belongs to the views, as wide as they are: the separator below the top bar is cut off.
    assert len(np.unique(picture[0], axis=0)) <= 3
    assert near(picture[: picture.shape[0] // 15], WARNING, 25) == 0
    map_part = picture[:, : int(0.58 * picture.shape[1])]
    assert near(map_part, style.KIND_COLOURS[0]) > 100  # arrows of the first kind
    assert near(map_part, style.ROLE_COLOURS["sink"], 40) > 50
    assert near(map_part, style.SINK_RIM, 40) > 50
    assert near(map_part, style.TARGET, 40) > 30
    full = style.energy_colours(np.array([0.95]))[0]
    assert near(map_part, tuple(map(int, full)), 40) > 500
    assert near(map_part, style.BACKGROUND) > 20_000
    below = map_part[int(0.76 * len(map_part)) :]
    assert near(below, style.COLLIDED, 40) > 30  # the legend


def test_without_a_vulkan_driver_the_remedy_is_told(
    grid: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nonexistent")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nonexistent")
    with pytest.raises(NetsimError, match="apt-get install mesa-vulkan-drivers libvulkan1"):
        replay.screenshot(grid, tmp_path / "shot.png", AT_S)
    assert not (tmp_path / "shot.png").exists()


def test_without_a_screen_the_alternatives_are_told(grid: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(NetsimError, match="no screen to show the replay on"):
        replay.view(grid)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_the_server_is_local_and_ends_with_its_caller(grid: Path, how: signal.Signals) -> None:
    program = (
        "import signal, sys; from netsim import replay; signal.signal(signal.SIGINT, signal.default_int_handler);"
        f"replay.serve({str(grid)!r}, announce=lambda address: print(address, flush=True))"
    )
    caller = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert caller.stdout is not None
    address = caller.stdout.readline()
    assert re.match(r"http://127\.0\.0\.1:\d+/", address)
    children = Path(f"/proc/{caller.pid}/task/{caller.pid}/children")
    viewers = [int(number) for number in children.read_text().split()] if children.exists() else []
    caller.send_signal(how)
    caller.communicate(timeout=20)
    assert caller.returncode == (0 if how is signal.SIGINT else 128 + signal.SIGTERM)
    for viewer in viewers:
        with pytest.raises(ProcessLookupError):
            os.kill(viewer, 0)
