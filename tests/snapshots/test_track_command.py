"""`netsim track` on traces by hand."""

import json
from pathlib import Path

import pytest
from tracked import HALF_S, write_track

from netsim.cli.track import track_command
from netsim.cli.track_times import chosen_times_ns
from netsim.errors import ScenarioError
from netsim.snapshots.load import load_track


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_track(tmp_path_factory.mktemp("track") / "track.mcap")


def test_a_line_for_every_belief(trace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    track_command(trace, None, None, as_json=False)
    told = capsys.readouterr().out
    lines = [line.split() for line in told.splitlines()]
    assert ["1.000", "c", "1", "1.25", "2.17", "2", "d", "2", "14"] in lines
    assert told.splitlines()[-1].startswith("8 beliefs, 8 choices of a next leader")


def test_json_tells_what_the_trace_holds(trace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    track_command(trace, None, [1.2], as_json=True)
    (step,) = json.loads(capsys.readouterr().out)
    assert (step["time_s"], step["step"], step["node"], step["next"]) == (1.0, 2, "c", "d")
    assert (step["neighbours"], step["utility"]) == (["d", "a"], [0.5, 0.25])
    assert step["variance_m2"] == pytest.approx(0.75 * 0.25 * 25)


def test_a_picture_and_the_instants_in_it(trace: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    track_command(trace, tmp_path / "track.svg", None, as_json=False)
    told = capsys.readouterr().out
    assert [line.split()[0] for line in told.splitlines()[4:7]] == ["0.500", "1.500", "3.000"]
    assert f"wrote {tmp_path / 'track.svg'}" in told
    assert (tmp_path / "track.svg").read_text().startswith("<?xml")


def test_a_belief_right_after_the_instant_is_meant(trace: Path) -> None:
    run = load_track(trace)
    told_ns = [step.time_ns for step in run.steps]
    assert chosen_times_ns(told_ns, [0.99, 0.49, 0.7, 0.49, 8.5]) == [HALF_S, 700_000_000, 2 * HALF_S, 8_500_000_000]


def test_what_is_wrong_is_told(trace: Path, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"x.pdf: expected the name of a picture that ends in .png or .svg"):
        track_command(trace, tmp_path / "x.pdf", None, as_json=False)
    for wrong in (-1.0, 8.6, float("nan"), float("inf")):  # the last belief is of 3.5 s
        with pytest.raises(ScenarioError, match=rf"--at: expected instants from 0 s, .* to 8.5 s, .* got {wrong:g} s"):
            track_command(trace, None, [wrong], as_json=False)
    with pytest.raises(ScenarioError, match="at most 12 instants in one picture, got 13"):
        track_command(trace, tmp_path / "x.png", [each / 4 for each in range(13)], as_json=True)


def test_a_run_without_hand_offs_names_no_leader(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    track_command(write_track(tmp_path / "central.mcap", central=True), None, None, as_json=False)
    told = capsys.readouterr().out
    assert "centre" in told
    assert "leader " not in told.splitlines()[2]
