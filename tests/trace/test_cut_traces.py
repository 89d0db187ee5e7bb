"""A trace cut anywhere gives its whole chunks and a warning, to every reader, or one clear error."""

import warnings
from contextlib import suppress
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from netsim.errors import TraceError
from netsim.replay.source import batches
from netsim.trace.events import Log, MessageSent, NodeLife, RadioState
from netsim.trace.index import indexed_counts
from netsim.trace.mending import mended
from netsim.trace.reader import TruncatedTraceWarning, has_events, is_complete, read_raw, read_trace
from netsim.trace.writer import Attachment, TraceWriter

COUNT = 300
SLOW_OR_SHARED = [HealthCheck.function_scoped_fixture]


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace of many chunks."""
    path = tmp_path_factory.mktemp("cut") / "trace.mcap"
    with mock.patch("netsim.trace.writer._CHUNK_SIZE_BYTE", 400):
        writer = TraceWriter(path, {"seed": "1"}, [Attachment("scenario.yaml", "application/yaml", b"seed: 1\n")])
    with writer:
        for number in range(COUNT):
            writer.write(RadioState(number, number % 8), 10 * number)
    return path


def ends_of_chunks(trace: Path) -> list[tuple[int, int]]:
    """Where each chunk ends in the file, and how many events it and those before it hold."""
    with trace.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    found, events = [], 0
    for chunk in summary.chunk_indexes:
        events = next((n for n in range(events, COUNT) if 10 * n > chunk.message_end_time), COUNT)
        found.append((chunk.chunk_start_offset + chunk.chunk_length, events))
    return found


@settings(suppress_health_check=SLOW_OR_SHARED, deadline=None, max_examples=60)
@given(share=st.floats(0, 1))
def test_rows_are_those_of_the_whole_chunks(trace: Path, tmp_path: Path, share: float) -> None:
    data = trace.read_bytes()
    size = int(share * len(data))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[:size])
    whole = list(read_trace(trace))
    expected = max((events for end, events in ends_of_chunks(trace) if end <= size), default=0)
    rows = None
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        with suppress(TraceError):
            rows = list(read_trace(cut))
    if rows is None:
        assert size < data.index(b"netsim.run") + 500  # not even the record of what was run is whole
        return
    assert rows == whole[:expected]
    lacks_data = expected < COUNT
    assert any(issubclass(each.category, TruncatedTraceWarning) for each in told) >= lacks_data
    assert is_complete(cut) == (size == len(data))
    assert has_events(cut) == (size >= ends_of_chunks(trace)[0][0])


@settings(suppress_health_check=SLOW_OR_SHARED, deadline=None, max_examples=25)
@given(share=st.floats(0.05, 1))
def test_the_replay_shows_the_whole_chunks(trace: Path, tmp_path: Path, share: float) -> None:
    data = trace.read_bytes()
    size = int(share * len(data))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[:size])
    expected = max((events for end, events in ends_of_chunks(trace) if end <= size), default=0)
    try:
        nodes = [
            node for part in batches(cut, [RadioState.topic], 0, 1 << 62) for node in part.numbers("node").tolist()
        ]
    except TraceError:
        assert expected == 0
        return
    assert nodes == list(range(expected))


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace of many chunks with several topics in each."""
    path = tmp_path_factory.mktemp("mixed") / "trace.mcap"
    with mock.patch("netsim.trace.writer._CHUNK_SIZE_BYTE", 3000), TraceWriter(path, {"seed": "1"}) as writer:
        for number in range(COUNT):
            writer.write(RadioState(number, number % 8), 10 * number)
            writer.write(MessageSent(number, 0, 1, "ping", 20, 1, []), 10 * number)
            writer.write(NodeLife(number, "started", ""), 10 * number)
            writer.write(Log(0, 10 * number, 2, "hello", "n", "", 0), 10 * number)
    return path


@settings(suppress_health_check=SLOW_OR_SHARED, deadline=None, max_examples=40)
@given(share=st.floats(0.05, 1))
def test_a_mended_trace_has_all_that_the_cut_one_has(mixed: Path, tmp_path: Path, share: float) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(mixed.read_bytes()[: int(share * mixed.stat().st_size)])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncatedTraceWarning)
        events = list(read_raw(cut))
    topics = {RadioState.topic, MessageSent.topic, NodeLife.topic, Log.topic}
    with mended(cut, warns=False) as copy:
        assert is_complete(copy)
        assert list(read_raw(copy)) == events
        counts = {topic: sum(each.topic == topic for each in events) for topic in topics if events}
        assert indexed_counts(copy) == counts
        with copy.open("rb") as stream:
            rows = [
                (channel.topic, each.log_time, each.data) for _, channel, each in make_reader(stream).iter_messages()
            ]
        assert sorted(rows) == sorted((each.topic, each.time_ns, each.data) for each in events)
        if events:
            found = {topic: 0 for topic in topics}
            for part in batches(cut, sorted(topics), 0, 1 << 62):
                found[part.topic] += len(part.time_ns)
            assert found == counts


def test_a_cut_just_after_a_chunk_loses_nothing_of_it(mixed: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    with mixed.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    last = summary.chunk_indexes[-1]
    cut.write_bytes(mixed.read_bytes()[: last.chunk_start_offset + last.chunk_length])
    with pytest.warns(TruncatedTraceWarning), mended(cut) as copy:
        assert list(read_raw(copy)) == list(read_raw(mixed))


def test_a_whole_trace_is_not_copied(mixed: Path) -> None:
    with mended(mixed) as same:
        assert same == mixed
