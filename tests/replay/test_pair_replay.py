"""What a replay shows of measurement-to-event association: places, and lines once probabilities are stated."""

import json
from pathlib import Path

import numpy as np
import pytest
from recordings import Table, named_nodes, recording, timed

from netsim.trace.events import FieldInfo, PairProbabilities, Problem
from netsim.trace.writer import TraceWriter

S = 1_000_000_000
CONTENT = {
    "owners": [0, 0, 1],
    "measurements_m": [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]],
    "events": [{"event": 0, "owner": 0, "x_m": 2.0, "y_m": 3.0}, {"event": 1, "owner": 1, "x_m": 8.0, "y_m": 9.0}],
    "model": {},
}


def write_pairs(path: Path, kind: str) -> None:
    """Node 0 states measurement 0 at 1 s and anew at 2 s; node 1 finds nothing for measurement 2 to be of."""
    with TraceWriter(path, {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        writer.write(FieldInfo(20.0, 10.0, 0.0, 0.0), 0)
        writer.write(Problem(kind, json.dumps(CONTENT)), 0)
        writer.write(PairProbabilities(0, 0, [0, 1], [0.6, 0.3], [0.5, 0.2], [0.7, 0.4], 4), 1 * S)
        writer.write(PairProbabilities(1, 2, [], [], [], [], 4), 1 * S)
        writer.write(PairProbabilities(0, 0, [0, 1], [0.65, 0.001], [0.64, 0.0], [0.66, 0.01], 6), 2 * S)


def rows_of(folder: Path, kind: str = "event-association", **options: int) -> Table:
    write_pairs(folder / "pairs.mcap", kind)
    return recording(folder / "pairs.mcap", folder, **options)


def test_measurements_and_events_are_where_they_are(tmp_path: Path) -> None:
    rows = rows_of(tmp_path)
    (discs,) = rows["/map/measurements"]
    np.testing.assert_allclose(np.array(discs["Points2D:positions"]), [[1, -2], [3, -4], [5, -6]])
    strokes = np.array(rows["/map/events"][0]["LineStrips2D:strips"])
    assert strokes.shape == (4, 2, 2)
    np.testing.assert_allclose(strokes.reshape(2, 4, 2).mean(axis=1), [[2, -3], [8, -9]], atol=1e-6)
    legend = [label for row in rows["/map/legend/labels"] for label in row["Points2D:labels"]]
    assert {"a measurement", "predicted event", "pair: likely to unlikely"} <= set(legend)


def test_lines_join_what_is_probable_as_last_stated(tmp_path: Path) -> None:
    rows = rows_of(tmp_path)
    strips = timed(rows["/map/pairs/0"], "LineStrips2D:strips")
    np.testing.assert_allclose(np.array(strips[1 * S]), [[[1, -2], [2, -3]], [[1, -2], [8, -9]]])
    np.testing.assert_allclose(np.array(strips[2 * S]), [[[1, -2], [2, -3]]])
    labels = timed(rows["/map/pairs/0"], "LineStrips2D:labels")
    assert labels[2 * S] == ["measurement 0 of event 0: 0.65 in [0.64, 0.66]"]
    assert not any(timed(rows.get("/map/pairs/2", []), "LineStrips2D:strips").values())


@pytest.mark.parametrize("kind", ["none", "association"])
def test_other_problems_have_none(tmp_path: Path, kind: str) -> None:
    assert not any(
        entity.startswith(("/map/pairs", "/map/measurements", "/map/events")) for entity in rows_of(tmp_path, kind)
    )
