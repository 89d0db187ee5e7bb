"""The picture: what its panels and bars show, and the files it becomes."""

from pathlib import Path

import numpy as np
import pytest
from handmade import ROUNDS, write_flow
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from PIL import Image

from netsim.errors import NetsimError, ScenarioError, TraceError
from netsim.flow import look
from netsim.flow.load import Flow, load_flow
from netsim.flow.picture import draw, write_picture


@pytest.fixture(scope="module")
def flow(tmp_path_factory: pytest.TempPathFactory) -> Flow:
    return load_flow(write_flow(tmp_path_factory.mktemp("flow") / "flow.mcap"))


def arrows_by_colour(figure: Figure, panel: int) -> dict[str, int]:
    quivers = [each for each in figure.axes[panel].collections if isinstance(each, Quiver)]
    return {to_hex(each.get_facecolor()[0]).lower(): each.N for each in quivers}


def test_a_panel_shows_every_message_and_who_wakes(flow: Flow) -> None:
    figure = draw(flow, [0, 1, 2], 2)
    sends, wakes = look.SENDS.lower(), look.WAKES.lower()
    assert [arrows_by_colour(figure, panel) for panel in range(3)] == [
        {sends: 6}, {sends: 1, wakes: 1}, {sends: 1},
    ]  # fmt: skip
    assert [axes.get_title(loc="left") for axes in figure.axes[:3]] == [
        "Start round: 4 senders, 6 messages", "Round 1: 2 senders, 2 messages", "Round 2: 1 sender, 1 message",
    ]  # fmt: skip
    assert [axes.get_xlabel() for axes in figure.axes[:3]] == ["", "", "s0 wakes after t0"]
    bars = [[bar.get_height() for bar in container] for container in figure.axes[-1].containers]
    assert bars == [[4, 2, 0, 0], [0, 0, 1, 0], [0, -2, -2, -1]]


def test_arrows_start_at_the_rim_of_their_sender(flow: Flow) -> None:
    figure = draw(flow, [2], 1)
    (quiver,) = (each for each in figure.axes[0].collections if isinstance(each, Quiver))
    start, end = quiver.XY[0], quiver.XY[0] + [quiver.U[0], quiver.V[0]]
    assert np.linalg.norm(start) < 2.0  # sensor 0 is at the origin, the target at (6, 6)
    assert np.linalg.norm(end - [6, 6]) < 2.0


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_files_are_the_same_each_time(flow: Flow, tmp_path: Path, ending: str) -> None:
    paths = [tmp_path / f"{number}.{ending}" for number in range(2)]
    for path in paths:
        write_picture(flow, [0, 1, 2], 3, path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    if ending == "png":
        picture = np.asarray(Image.open(paths[0]).convert("RGB")).astype(int)
        for colour in (look.SENDS, look.WAKES):
            rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
            assert (np.abs(picture - rgb).max(axis=2) < 8).sum() > 200


def test_a_file_that_cannot_be_written_is_named(flow: Flow, tmp_path: Path) -> None:
    with pytest.raises(NetsimError, match=r"none/x\.png: cannot write the picture"):
        write_picture(flow, [0], 1, tmp_path / "none" / "x.png")


def test_traces_without_common_rounds_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"expected rounds that all nodes share.*schedule=synchronous"):
        load_flow(write_flow(tmp_path / "own.mcap", shared=False))
    with pytest.raises(ScenarioError, match="expected messages between the vertices of a graphical model, got none"):
        load_flow(write_flow(tmp_path / "none.mcap", rounds=[[], []]))
    with pytest.raises(TraceError, match="between the 4 vertices of the model, got vertex 77"):
        load_flow(write_flow(tmp_path / "odd.mcap", rounds=[*ROUNDS, [(0, 77)]]))
