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
from netsim.trace.events import RadioState
from netsim.trace.reader import TruncatedTraceWarning, has_events, is_complete, read_trace
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
