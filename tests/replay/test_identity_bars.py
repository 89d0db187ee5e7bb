"""What a replay shows of who is who, and the colours of targets that groups track."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from recordings import Table, named_nodes, recording, timed

from netsim.replay import style
from netsim.trace.events import Estimate, FieldInfo, Identity, Particles, Problem, TruthTargets
from netsim.trace.reader import TruncatedTraceWarning
from netsim.trace.writer import TraceWriter

S = 1_000_000_000
PROBLEM = json.dumps({"sensors": [], "targets": 2, "sensing_range_m": 5.0, "reading_s": 1.0, "cut_off_m": 50.0})


def write_meeting(path: Path) -> None:
    """Tracks 0 and 7 apart at 1 s, joint at 2 s, apart at 3 s; nobody speaks of track 0 any more; 9 begins at 9 s."""
    ways = {0: [(5, 5), (9, 5), (5, 5)], 7: [(25, 5), (13, 5), (25, 5)]}
    with TraceWriter(path, {}) as writer:
        writer.write(named_nodes("a", "b", "c"), 0)
        writer.write(FieldInfo(30.0, 10.0, 0.0, 0.0), 0)
        writer.write(Problem("energy-tracking", PROBLEM), 0)
        writer.write(TruthTargets([0, 1], [5.0, 25.0], [5.0, 5.0]), 0)
        for second in (1, 2, 3):
            for track, way in ways.items():
                writer.write(Estimate(0, track, *map(float, way[second - 1]), []), second * S)
                row = [0.5, 0.5] if second == 3 else [1.0, 0.0] if track == 0 else [0.0, 1.0]
                writer.write(Identity(0, track, row), second * S)
            for group in [[0, 7]] if second == 2 else [[0], [7]]:
                writer.write(Particles(0, second, group, 1, [1.0], [1.0] * len(group), [1.0] * len(group)), second * S)
        for second, track in sorted([*((second, 7) for second in range(4, 12)), (9, 9)]):
            writer.write(Estimate(0, track, 25.0, 5.0, []), second * S)
            writer.write(Identity(0, track, [0.0, 1.0]), second * S)
            writer.write(Particles(0, second, [track], 1, [1.0], [1.0], [1.0]), second * S)


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Table:
    folder = tmp_path_factory.mktemp("regions")
    write_meeting(folder / "meeting.mcap")
    return recording(folder / "meeting.mcap", folder)


def test_bars_are_as_long_as_targets_are_probable(rows: Table) -> None:
    size = timed(rows["/identity/bars"], "Image:format")[S][0]
    shape = size["height"], size["width"], 4
    first = np.array(timed(rows["/identity/bars"], "Image:buffer")[S][0], np.uint8).reshape(shape)
    for line, target in ((1, 0), (5, 1)):  # four lines a bar, of which the first is blank
        assert (first[line] == style.kind_colour(target)).all()
    mixed = np.array(timed(rows["/identity/bars"], "Image:buffer")[3 * S][0], np.uint8).reshape(shape)
    for line in (1, 5):
        assert (mixed[line] == style.kind_colour(0)).all(axis=1).mean() == 0.5
        assert (mixed[line] == style.kind_colour(1)).all(axis=1).mean() == 0.5


def test_names_and_numbers_stand_at_the_bars_and_a_later_track_takes_a_free_place(rows: Table) -> None:
    texts = timed(rows["/identity/text"], "Points2D:labels")
    assert texts[S] == ["track 0", "1.00", "track 7", "1.00"]
    assert texts[3 * S] == ["track 0", "0.50", "0.50", "track 7", "0.50", "0.50"]
    assert texts[8 * S] == ["track 7", "1.00"]
    assert texts[9 * S] == ["track 7", "1.00", "track 9", "1.00"]
    heights = {
        name: np.array(timed(rows["/identity/text"], "Points2D:positions")[at])[:, 1]
        for at, name in [(S, "early"), (9 * S, "late")]
    }
    assert heights["late"][2] == heights["early"][0]


def test_targets_have_colours_of_their_own_where_there_are_groups(rows: Table) -> None:
    colours = timed(rows["/map/targets"], "LineStrips2D:colors")[0]
    assert colours == [_packed(style.kind_colour(0)), _packed(style.kind_colour(1))]
    assert all("LineStrips2D:colors" not in row or row["LineStrips2D:colors"] for row in rows["/map/targets"])


def test_of_a_trace_without_its_end_all_is_shown(rows: Table, tmp_path: Path) -> None:
    write_meeting(tmp_path / "whole.mcap")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes((tmp_path / "whole.mcap").read_bytes()[:-400])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncatedTraceWarning)
        shown = recording(cut, tmp_path)
    shapes = {
        "/map/particles/7": "Points2D:positions",
        "/identity/text": "Points2D:labels",
    }
    for path, component in shapes.items():
        assert timed(shown[path], component) == timed(rows[path], component)


def _packed(colour: style.Rgba) -> int:
    red, green, blue, opacity = colour
    return red << 24 | green << 16 | blue << 8 | opacity
