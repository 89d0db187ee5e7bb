"""A run watched while its trace grows: in the end all is shown that a finished trace shows, and nothing twice."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from mcap.reader import make_reader
from recordings import named_nodes, recording, timed
from rerun.chunk import RrdReader

from netsim.replay import ReplayOptions
from netsim.replay.live import Follower, follow
from netsim.trace import writer as trace_writer
from netsim.trace.events import (
    OUTCOME_CODE,
    Estimate,
    Frame,
    GraphMessages,
    Identity,
    MessageSent,
    NodeEnergy,
    TruthTargets,
    VariablePlacement,
)
from netsim.trace.writer import TraceWriter, partial_path

S = 1_000_000_000
MS = 1_000_000
SECONDS = 40


def write_run(path: Path) -> None:
    """A frame a second from a to b of two kinds in turn, a target that both follow."""
    with TraceWriter(path, {"horizon_s": str(float(SECONDS)), "scenario": "walk"}) as writer:
        writer.write(named_nodes("a", "b", battery_j=10.0), 0)
        for second in range(SECONDS):
            now_ns = second * S
            kind = ("hello", "data")[second % 2]
            writer.write(NodeEnergy([0, 1], [0.1 * second, 1.0], [10.0 - 0.1 * second, 9.0]), now_ns)
            writer.write(TruthTargets([0], [float(second)], [0.0]), now_ns)
            writer.write(MessageSent(second + 1, 0, 1, kind, 20, 1, []), now_ns)
            end_ns = now_ns + 2 * MS
            ears = [1], [OUTCOME_CODE["received"]], [-60.0], [9.0]
            writer.write(Frame(second, now_ns, end_ns, 0, 1, kind, 0, 20, 0, second + 1, 0.0, *ears), end_ns)
            writer.write(Estimate(0, 0, float(second), 1.0, []), end_ns)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "whole.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace_writer, "_CHUNK_SIZE_BYTE", 1500)
        write_run(path)
    return path


def shown(rrd: Path) -> dict[str, list[dict[str, object]]]:
    """Rows by entity; of an instant's the last one."""
    rows: dict[str, list[dict[str, object]]] = {}
    for chunk in RrdReader(rrd).stream():
        rows.setdefault(str(chunk.entity_path), []).extend(_plain(chunk.to_record_batch()))
    return rows


def _plain(batch):
    import pyarrow as pa

    for name in batch.schema.names:
        if pa.types.is_duration(batch.schema.field(name).type):
            index = batch.schema.get_field_index(name)
            batch = batch.set_column(index, name, batch.column(index).cast(pa.int64()))
    return batch.to_pylist()


def stream_to(path: Path) -> rr.RecordingStream:
    stream = rr.RecordingStream("netsim", send_properties=False)
    stream.save(path)
    return stream


def watched(whole: Path, folder: Path, looks: int) -> tuple[dict[str, list[dict[str, object]]], list[int]]:
    """What is shown of a trace that grows in so many steps, and how far after each."""
    trace, data = folder / "run.mcap", whole.read_bytes()
    stream = stream_to(folder / "live.rrd")
    follower = Follower(trace, stream, ReplayOptions())
    reached = []
    for look in range(looks):
        partial_path(trace).write_bytes(data[: len(data) * look // looks])
        assert not follower.advance()
        reached.append(follower.shown_ns)
    partial_path(trace).write_bytes(data)
    partial_path(trace).rename(trace)
    assert follower.advance()
    stream.flush()
    stream.disconnect()
    return shown(folder / "live.rrd"), reached


def test_a_growing_trace_is_shown_whole_in_the_end(whole: Path, tmp_path: Path) -> None:
    once = recording(whole, tmp_path)
    live, reached = watched(whole, tmp_path, 9)
    assert reached == sorted(reached)
    assert reached[-1] > SECONDS * S // 2
    for path, component in [
        ("/map/messages/hello", "Arrows2D:vectors"),
        ("/map/messages/data", "Arrows2D:vectors"),
        ("/map/nodes", "Points2D:colors"),
        ("/map/targets", "LineStrips2D:strips"),
        ("/plots/messages/hello", "Scalars:scalars"),
        ("/plots/track/error_0", "Scalars:scalars"),
    ]:
        expected, got = timed(once[path], component), timed(live[path], component)
        assert sorted(set(expected) - set(got)) == []
        for at_ns, value in expected.items():
            np.testing.assert_allclose(np.array(got[at_ns], float), np.array(value, float), err_msg=f"{path} {at_ns}")


def test_kinds_keep_their_colours(whole: Path, tmp_path: Path) -> None:
    live, _ = watched(whole, tmp_path, 9)
    for kind in ("hello", "data"):
        looks = {tuple(row["Arrows2D:colors"]) for row in live[f"/map/messages/{kind}"] if row.get("Arrows2D:colors")}
        assert len(looks) == 1


def test_following_ends_with_the_run_or_with_the_viewer(whole: Path, tmp_path: Path) -> None:
    stream = stream_to(tmp_path / "out.rrd")
    assert list(follow(tmp_path / "never.mcap", stream, ReplayOptions(), alive=lambda: False)) == []
    assert list(follow(whole, stream, ReplayOptions()))[-1] > (SECONDS - 1) * S
    stream.disconnect()


@pytest.fixture(scope="module")
def growing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second track is told of from 20 s on; in the first ten rounds of a graphical model there are messages."""
    path = tmp_path_factory.mktemp("growing") / "whole.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace_writer, "_CHUNK_SIZE_BYTE", 1)
        with TraceWriter(path, {"horizon_s": str(float(SECONDS))}) as writer:
            writer.write(named_nodes("a", "b"), 0)
            writer.write(VariablePlacement([0, 1], ["one", "two"], [0, 1], [0], [1]), 0)
            for second in range(SECONDS):
                edge = ([0], [1], [1]) if second < 10 else ([], [], [])
                writer.write(GraphMessages(0, second, *edge, 2, 0.5, 1, 0), second * S)
                for track in (0, 1) if second >= 20 else (0,):
                    writer.write(Identity(0, track, [0.5, 0.5]), second * S)
    return path


def test_bars_of_every_look_fit_their_picture(growing: Path, tmp_path: Path) -> None:
    live, _ = watched(growing, tmp_path, 9)
    sizes, buffers = (timed(live["/identity/bars"], f"Image:{name}") for name in ("format", "buffer"))
    heights = set()
    for at_ns, buffer in buffers.items():
        size = sizes[at_ns][0]
        assert len(buffer[0]) == 4 * size["width"] * size["height"]
        heights.add(size["height"])
    assert len(heights) == 2


def test_arrows_of_an_earlier_look_do_not_stay(growing: Path, tmp_path: Path) -> None:
    """The second look begins with the first round without messages."""
    trace, stream = tmp_path / "run.mcap", stream_to(tmp_path / "live.rrd")
    with growing.open("rb") as data:
        summary = make_reader(data).get_summary()
    assert summary is not None
    last = next(chunk for chunk in summary.chunk_indexes if chunk.message_end_time == 10 * S)
    partial_path(trace).write_bytes(growing.read_bytes()[: last.chunk_start_offset + last.chunk_length])
    follower = Follower(trace, stream, ReplayOptions())
    follower.advance()
    assert follower.shown_ns == 10 * S
    partial_path(trace).unlink()
    trace.write_bytes(growing.read_bytes())
    assert follower.advance()
    stream.flush()
    stream.disconnect()
    arrows = timed(shown(tmp_path / "live.rrd")["/graph/messages"], "Arrows2D:vectors")
    assert len(arrows[9 * S]) == 1
    assert len(arrows[10 * S]) == 0
