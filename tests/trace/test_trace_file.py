"""Traces as files: what is written is read, equal events give equal bytes, damage gives one clear error."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer

from netsim.errors import InvariantError, TraceError
from netsim.trace.events import EVENT_TYPES, Event, Frame, Log, NodeLife, RadioState
from netsim.trace.reader import (
    TruncatedTraceWarning,
    is_complete,
    read_trace,
    trace_attachment,
    trace_metadata,
)
from netsim.trace.writer import Attachment, TraceWriter, partial_path

SCENARIO = Attachment("scenario.yaml", "application/yaml", b"seed: 1\n")


def frame(number: int) -> Frame:
    """A frame with a few listeners."""
    listeners = [1, 2, 3][: number % 4]
    noise = np.random.default_rng(number).uniform(-90, -60, len(listeners)).astype(np.float32)
    return Frame(
        number, number, number + 5, 0, 1, "belief", 0, 50, 0, number, 0.0, listeners, [0] * len(listeners), noise, noise
    )  # fmt: skip


def write_small(path: Path, count: int = 50) -> list[tuple[int, Event]]:
    """A small trace; returns what was written."""
    rows: list[tuple[int, Event]] = []
    for number in range(count):
        rows += [(10 * number, RadioState(number, 2)), (10 * number, frame(number))]
    with TraceWriter(path, {"seed": "1", "scenario": "small"}, [SCENARIO]) as writer:
        for time_ns, event in rows:
            writer.write(event, time_ns)
        writer.attach("metrics.json", "application/json", b"{}")
    return rows


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("trace") / "trace.mcap"
    write_small(path)
    return path


def test_what_is_written_is_read(tmp_path: Path) -> None:
    rows = write_small(tmp_path / "t.mcap")
    read = list(read_trace(tmp_path / "t.mcap"))
    assert [(time_ns, type(event)) for time_ns, event in read] == [(time_ns, type(event)) for time_ns, event in rows]
    for (_, left), (_, right) in zip(read, rows, strict=True):
        assert isinstance(left, Frame) == isinstance(right, Frame)
        if isinstance(left, Frame) and isinstance(right, Frame):
            assert left.frame_id == right.frame_id
            np.testing.assert_array_equal(left.rx_rssi_dbm, right.rx_rssi_dbm)
    assert trace_metadata(tmp_path / "t.mcap") == {
        "format_version": "1", "netsim_version": "0.1.0", "scenario": "small", "seed": "1"
    }  # fmt: skip
    assert trace_attachment(tmp_path / "t.mcap", "scenario.yaml") == b"seed: 1\n"
    assert trace_attachment(tmp_path / "t.mcap", "metrics.json") == b"{}"


def test_topics_and_half_open_window_select(small: Path) -> None:
    read = list(read_trace(small, topics={"/nodes/radio"}, start_ns=100, end_ns=130))
    assert read == [(100, RadioState(10, 2)), (110, RadioState(11, 2)), (120, RadioState(12, 2))]
    assert list(read_trace(small, start_ns=10**9)) == []


def test_window_of_a_trace_of_many_chunks(tmp_path: Path) -> None:
    path = tmp_path / "long.mcap"
    reason = np.random.default_rng(0).bytes(500_000).hex()
    with TraceWriter(path, {}) as writer:
        for second in range(12):
            writer.write(NodeLife(second, "failed", reason), second)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) >= 3
    found = [event.node for _, event in read_trace(path, start_ns=8, end_ns=10) if isinstance(event, NodeLife)]
    assert found == [8, 9]


def test_other_readers_see_no_wall_clock(small: Path) -> None:
    with small.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        messages = list(reader.iter_messages())
        summary = reader.get_summary()
        attachments = list(reader.iter_attachments())
    assert summary is not None
    assert [channel.topic for channel in summary.channels.values()] == [event_type.topic for event_type in EVENT_TYPES]
    assert all(message.log_time == message.publish_time for _, _, message in messages)
    assert [m.sequence for _, channel, m in messages if channel.topic == "/frames"] == list(range(50))
    assert [(a.create_time, a.log_time) for a in attachments] == [(0, 0), (0, 0)]
    assert all(schema is not None and schema.encoding == "ros2msg" for schema, _, _ in messages)


def test_equal_events_give_equal_bytes_whatever_the_hash_seed(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from tests.trace.test_trace_file import write_small;"
        "write_small(Path(sys.argv[1]))"
    )
    contents = set()
    for hash_seed in ("1", "2"):
        path = tmp_path / f"{hash_seed}.mcap"
        environment = {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(Path(__file__).parents[2])}
        subprocess.run([sys.executable, "-c", program, str(path)], check=True, env=environment)
        contents.add(path.read_bytes())
    write_small(tmp_path / "3.mcap")
    assert contents == {(tmp_path / "3.mcap").read_bytes()}


def test_time_that_runs_backwards_is_a_broken_law(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "t.mcap", {}) as writer:
        writer.write(RadioState(0, 1), 5)
        with pytest.raises(InvariantError, match="at 4 ns was recorded after one at 5 ns"):
            writer.write(RadioState(0, 1), 4)
        writer.write(RadioState(0, 2), 5)
    assert len(list(read_trace(tmp_path / "t.mcap"))) == 2


def test_a_failed_run_leaves_a_readable_partial_trace(tmp_path: Path) -> None:
    path = tmp_path / "t.mcap"
    with pytest.raises(InvariantError), TraceWriter(path, {}) as writer:
        write_backwards(writer)
    assert not path.exists()
    assert list(read_trace(partial_path(path))) == [(5, RadioState(3, 1))]
    assert is_complete(partial_path(path))


def write_backwards(writer: TraceWriter) -> None:
    """One good event and one that fails."""
    writer.write(RadioState(3, 1), 5)
    writer.write(RadioState(3, 1), 4)


def test_a_second_close_does_nothing(tmp_path: Path) -> None:
    writer = TraceWriter(tmp_path / "t.mcap", {})
    writer.close()
    writer.close()
    assert list(read_trace(tmp_path / "t.mcap")) == []
    assert not partial_path(tmp_path / "t.mcap").exists()


def test_log_lines_are_read(tmp_path: Path) -> None:
    line = Log(1, 5, 2, "hello", "n00", "", 0)
    with TraceWriter(tmp_path / "t.mcap", {}) as writer:
        writer.write(line, 1_000_000_005)
    assert list(read_trace(tmp_path / "t.mcap")) == [(1_000_000_005, line)]


def test_cut_traces_are_read_up_to_the_last_whole_record(small: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(small.read_bytes()[:-60])
    assert is_complete(small)
    assert not is_complete(cut)
    damaged = bytearray(small.read_bytes())
    damaged[-100] ^= 1
    (cut.parent / "damaged.mcap").write_bytes(damaged)
    with pytest.raises(TraceError, match="the index has a wrong checksum"):
        is_complete(cut.parent / "damaged.mcap")
    assert len(list(read_trace(cut))) == 100  # only the index is damaged
    cut.write_bytes(small.read_bytes()[:1500])
    with pytest.warns(TruncatedTraceWarning, match="cut short"):
        assert list(read_trace(cut)) == []


def complaint_about(path: Path) -> str:
    """The trace error that reading everything gives; empty if none."""
    try:
        list(read_trace(path))
        trace_attachment(path, "scenario.yaml")
    except TraceError as error:
        return str(error)
    return ""


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=150)
@given(position=st.floats(0, 1), flip=st.integers(0, 255), cut=st.booleans())
def test_damage_anywhere_raises_nothing_but_a_trace_error(
    small: Path, tmp_path: Path, position: float, flip: int, cut: bool
) -> None:
    data = bytearray(small.read_bytes())
    at = int(position * (len(data) - 1))
    data[at] ^= flip
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data[:at] if cut else data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncatedTraceWarning)
        complaint = complaint_about(path)
    assert "\n" not in complaint
    assert complaint.count(str(path)) == (1 if complaint else 0)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.binary(max_size=200))
def test_garbage_is_no_trace(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "garbage.mcap"
    for start in (b"", b"\x89MCAP0\r\n"):
        path.write_bytes(start + data)
        with pytest.raises(TraceError, match=r"not an MCAP file|not a trace of netsim|damaged"):
            read_trace(path)


def test_files_that_are_not_ours_are_refused(tmp_path: Path, small: Path) -> None:
    other = tmp_path / "other.mcap"
    with pytest.raises(TraceError, match="No such file"):
        read_trace(other)
    foreign(other, {})
    with pytest.raises(TraceError, match=r"not a trace of netsim: it has no netsim\.run record"):
        read_trace(other)
    foreign(other, {"format_version": "9"})
    with pytest.raises(
        TraceError, match=r"expected trace format version 1 \(this is netsim .*\), got 9; upgrade netsim"
    ):
        read_trace(other)
    foreign(other, {"format_version": "1"}, topic="/frames")
    with pytest.raises(TraceError, match="topic /frames is laid out otherwise"):
        list(read_trace(other))
    foreign(other, {"format_version": "1"}, topic="/elsewhere")
    assert list(read_trace(other)) == []  # a topic of a later version, for all we know
    with pytest.raises(TraceError, match=r"expected an attachment x, got metrics\.json, scenario\.yaml"):
        trace_attachment(small, "x")


def foreign(path: Path, metadata: dict[str, str], topic: str = "") -> None:
    """An MCAP file that somebody else wrote."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        if metadata:
            writer.add_metadata("netsim.run", metadata)
        if topic:
            schema = writer.register_schema("netsim/msg/Frame", "ros2msg", b"uint32 frame_id\n")
            channel = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channel, 0, b"\0\1\0\0\0\0\0\0", 0)
        writer.finish()


def test_a_folder_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="cannot write the trace: No such file"):
        TraceWriter(tmp_path / "nowhere" / "t.mcap", {})
