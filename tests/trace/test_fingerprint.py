"""Fingerprints: equal for equal content, different for any change of time, order, value or file."""

from pathlib import Path

import pytest

from netsim.errors import TraceError
from netsim.trace.events import Event, NodeLife, RadioState
from netsim.trace.fingerprint import fingerprint
from netsim.trace.writer import Attachment, TraceWriter

ROWS: tuple[tuple[int, Event], ...] = ((0, RadioState(1, 2)), (5, RadioState(2, 2)), (5, NodeLife(1, "died", "")))
SCENARIO = Attachment("scenario.yaml", "application/yaml", b"seed: 1")


def of(path: Path, rows: tuple[tuple[int, Event], ...] = ROWS, attachment: Attachment = SCENARIO) -> str:
    """The fingerprint of a trace with these rows."""
    with TraceWriter(path, {"seed": "1"}, [attachment]) as writer:
        for time_ns, event in rows:
            writer.write(event, time_ns)
    return fingerprint(path)


def test_it_depends_on_content_alone(tmp_path: Path) -> None:
    known = of(tmp_path / "a.mcap")
    assert known == of(tmp_path / "b.mcap")
    assert known == "1c796e10ae904326acc0a67a48bc7c2f"


@pytest.mark.parametrize(
    "rows",
    [
        ROWS[:2],
        (ROWS[0], ROWS[2], ROWS[1]),
        (*ROWS[:2], (6, ROWS[2][1])),
        (*ROWS[:2], (5, NodeLife(1, "failed", ""))),
    ],
)
def test_any_change_shows(tmp_path: Path, rows: tuple[tuple[int, Event], ...]) -> None:
    assert of(tmp_path / "a.mcap") != of(tmp_path / "b.mcap", rows)


def test_attachments_count(tmp_path: Path) -> None:
    other = Attachment("scenario.yaml", "application/yaml", b"seed: 2")
    assert of(tmp_path / "a.mcap") != of(tmp_path / "b.mcap", attachment=other)


def test_a_cut_trace_has_none(tmp_path: Path) -> None:
    of(tmp_path / "a.mcap")
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:-9])
    with pytest.raises(TraceError, match="cut short, so it has no fingerprint"):
        fingerprint(tmp_path / "cut.mcap")
