"""What may differ within a format version, and that another version is refused in one clear line by every command."""

import shutil
from io import BytesIO
from pathlib import Path
from unittest import mock

import pytest
from in_process import netsim
from mcap.writer import Writer

from netsim.errors import TraceError
from netsim.trace.cdr import MESSAGE_ENCODING, SCHEMA_ENCODING, encode, fields_of, schema_name, schema_text
from netsim.trace.divergence import first_divergence
from netsim.trace.events import Event, Frame, Log, NodeTable, RadioState
from netsim.trace.fingerprint import fingerprint
from netsim.trace.index import announced
from netsim.trace.reader import read_trace
from netsim.trace.writer import RUN_RECORD, TraceWriter

FRAME = Frame(1, 0, 5, 1, 2, "hello", 0, 30, 0, 1, 0.0, [2], [0], [-70.0], [9.0], 1)
FIELDS = 16


def write_raw(path: Path, *topics: tuple[str, str, str, bytes]) -> Path:
    """A trace of one event a topic, each described and encoded as is asked."""
    stream = BytesIO()
    writer = Writer(stream)
    writer.start(profile="netsim")
    writer.add_metadata(RUN_RECORD, {"format_version": "1"})
    for topic, name, text, data in topics:
        schema = writer.register_schema(name, SCHEMA_ENCODING, text.encode())
        channel = writer.register_channel(topic, MESSAGE_ENCODING, schema)
        writer.add_message(channel, 7, data, 7, 0)
    writer.finish()  # type: ignore[no-untyped-call]
    path.write_bytes(stream.getvalue())
    return path


def described(event: Event, text: str | None = None, data: bytes | None = None) -> tuple[str, str, str, bytes]:
    """An event as a topic of `write_raw`."""
    kind = type(event)
    return event.topic, schema_name(kind), text or schema_text(kind), data or encode(event)


LATER = ("/later", "netsim/msg/Later", "uint32 node\n", encode(RadioState(3, 2)))


def test_a_topic_that_only_later_versions_know_is_skipped(tmp_path: Path) -> None:
    path = write_raw(tmp_path / "t.mcap", described(RadioState(3, 2)), LATER)
    assert list(read_trace(path)) == [(7, RadioState(3, 2))]
    assert [(each.topic, each.is_known, each.wrong) for each in announced(path)] == [
        ("/nodes/radio", True, ""),
        ("/later", False, ""),
    ]
    without = write_raw(tmp_path / "without.mcap", described(RadioState(3, 2)))
    assert first_divergence(path, without) is None
    assert fingerprint(path) != fingerprint(without)
    assert "/later" in netsim("trace", "info", path).stdout


def test_fields_added_at_the_end_are_ignored(tmp_path: Path) -> None:
    text = schema_text(RadioState) + "float32 power_mw\n"
    path = write_raw(tmp_path / "t.mcap", described(RadioState(3, 2), text, encode(RadioState(3, 2)) + bytes(7)))
    assert list(read_trace(path)) == [(7, RadioState(3, 2))]


def test_fields_that_an_older_trace_lacks_have_their_defaults(tmp_path: Path) -> None:
    lines = schema_text(Frame).splitlines()
    assert lines[-1] == "uint8 is_strobe"
    path = write_raw(tmp_path / "t.mcap", described(FRAME, "\n".join(lines[:-1]), encode(FRAME)[:-1]))
    [(_, event)] = read_trace(path)
    assert isinstance(event, Frame)
    assert (event.is_strobe, event.kind, event.rx_node.tolist()) == (0, "hello", [2])  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("event_type", "text", "expected"),
    [
        (Frame, schema_text(Frame), FIELDS),
        (Frame, schema_text(Frame) + "uint32 more", FIELDS),
        (Frame, schema_text(Frame).rpartition("\n# ")[0], FIELDS - 1),
        (Frame, schema_text(Frame).rpartition("float32[] rx_sinr_db")[0], None),  # it has no default
        (RadioState, "uint32 node\nuint8 mode", None),
        (RadioState, "uint32 node\nuint16 state", None),
        (RadioState, "uint8 state\nuint32 node", None),
        (Log, schema_text(Log) + "uint8 more", None),
    ],
)
def test_only_the_end_of_a_message_may_differ(event_type: type[Event], text: str, expected: int | None) -> None:
    assert fields_of(event_type, text) == expected


def test_a_topic_laid_out_otherwise_is_refused(tmp_path: Path) -> None:
    path = write_raw(tmp_path / "t.mcap", described(RadioState(3, 2), "uint8 state\nuint32 node\n"))
    with pytest.raises(TraceError, match="/nodes/radio is laid out otherwise"):
        list(read_trace(path))
    assert "not only fewer or more at the end" in announced(path)[0].wrong


@pytest.fixture(scope="module")
def newer(tmp_path_factory: pytest.TempPathFactory, scenarios: Path) -> Path:
    """A run's folder whose trace has the next format version."""
    folder = tmp_path_factory.mktemp("newer") / "run"
    ended = netsim("run", scenarios / "quickstart.yaml", "--duration", 1, "--no-trace", "--out", folder)
    assert ended.returncode == 0, ended.stderr
    with (
        mock.patch("netsim.trace.writer.FORMAT_VERSION", "2"),
        mock.patch("netsim.trace.writer.__version__", "3.1.4"),
        TraceWriter(folder / "trace.mcap", {"scenario": "small", "seed": "1"}) as writer,
    ):
        writer.write(NodeTable([1], ["a"], [""], ["sensor"], [0.0], [0.0], [""], [""], [1.0]), 0)
        writer.write(RadioState(1, 2), 5)
    shutil.copyfile(folder / "trace.mcap", folder / "other.mcap")
    return folder


COMMANDS = {
    "replay": ["replay", "TRACE", "--save", "out.rrd"],
    "inspect": ["inspect", "TRACE"],
    "time line": ["inspect", "TRACE", "--timeline", "1"],
    "why": ["inspect", "TRACE", "--why", "1", "--at", "0"],
    "flow": ["flow", "TRACE", "--out", "flow.svg"],
    "track": ["track", "TRACE"],
    "compare": ["compare", "TRACE", "OTHER"],
    "lifetime": ["lifetime", "RUN", "--per-day", "24", "--per-run", "1"],
    "info": ["trace", "info", "TRACE"],
    "check": ["trace", "check", "TRACE"],
    "check of a run": ["trace", "check", "RUN"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_newer_trace_is_refused_with_a_clear_line(name: str, newer: Path, tmp_path: Path) -> None:
    places = {"TRACE": newer / "trace.mcap", "OTHER": newer / "other.mcap", "RUN": newer}
    ended = netsim(*[places.get(word, word) for word in COMMANDS[name]], cwd=tmp_path)
    assert ended.returncode in (1, 2)
    [line] = ended.stderr.splitlines()
    assert line.startswith("error: ")
    assert "expected trace format version 1 (this is netsim " in line
    assert line.endswith("), got 2 (netsim 3.1.4 wrote it); upgrade netsim")
    assert list(tmp_path.iterdir()) == []


def test_an_older_trace_names_its_writer(tmp_path: Path) -> None:
    with (
        mock.patch("netsim.trace.writer.FORMAT_VERSION", "0"),
        mock.patch("netsim.trace.writer.__version__", "0.0.1"),
        TraceWriter(tmp_path / "t.mcap", {}),
    ):
        pass
    with pytest.raises(TraceError, match=r"got 0 \(netsim 0.0.1 wrote it\); read it with the netsim that wrote it"):
        read_trace(tmp_path / "t.mcap")
