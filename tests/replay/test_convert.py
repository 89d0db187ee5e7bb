"""What a recording holds: exact rows for three frames worked out by hand, and everything that a whole run should show."""

import os
import re
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings import MS, Table, log_of, named_nodes, recording, timed, write_three_frames
from rerun.chunk import McapReader
from synthetic import DEAD_NODE, DEATH_S, NODES, write_synthetic

from netsim import replay
from netsim.errors import NetsimError, ScenarioError, TraceError
from netsim.replay import ReplayOptions, style
from netsim.replay.lanes import LaneTrack
from netsim.replay.options import decide, nice
from netsim.replay.scene import load_scene
from netsim.replay.source import batches
from netsim.replay.track import Kinds, Setting
from netsim.trace.cdr import wire_types
from netsim.trace.events import (
    EVENT_TYPES,
    OUTCOME_CODE,
    Association,
    Frame,
    LinkTable,
    MessageSent,
    NodeLife,
    NodeTable,
)
from netsim.trace.reader import TruncatedTraceWarning, read_trace
from netsim.trace.writer import TraceWriter


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("grid") / "grid.mcap"
    write_synthetic(path, duration_s=20.0)
    return path


@pytest.fixture(scope="module")
def whole(grid: Path, tmp_path_factory: pytest.TempPathFactory) -> Table:
    return recording(grid, tmp_path_factory.mktemp("whole"))


def test_three_frames_give_the_rows_worked_out_by_hand(tmp_path: Path) -> None:
    write_three_frames(tmp_path / "three.mcap")
    rows = recording(tmp_path / "three.mcap", tmp_path, hold_s=0.15, tick_s=0.05)
    # Radius 10 m / 8; arrows run from 1.3 radii off the sender to 1.3 radii off the receiver, 0.3 radii to the right.
    gap, aside, shaft = 1.625, 0.375, 6.75
    hello = rows["/map/messages/hello/broadcast"]
    for (instant, vectors), reach in zip(sorted(timed(hello, "Arrows2D:vectors").items()), (1, 2, 3, 0), strict=True):
        assert instant == (50 + 50 * (reach or 4)) * MS
        expected = [[shaft * reach / 3, 0], [0, -shaft * reach / 3]] if reach else []
        np.testing.assert_allclose(np.reshape(vectors, (-1, 2)), np.reshape(expected, (-1, 2)), atol=1e-5)
    origins = timed(hello, "Arrows2D:origins")[100 * MS]
    np.testing.assert_allclose(origins, [[gap, aside], [aside, -gap]], atol=1e-5)
    collided = rows["/map/losses/interference"]
    assert sorted(timed(collided, "Arrows2D:labels").values()) == [[], ["collided"], ["collided"], ["collided"]]
    assert [row["Arrows2D:show_labels"] for row in collided if "simulated_time" not in row] == [[False]]
    np.testing.assert_allclose(timed(collided, "Arrows2D:vectors")[200 * MS], [[-0.6 * shaft, 0]], atol=1e-5)
    assert sorted(timed(rows["/map/acks"], "Arrows2D:vectors")) == [400 * MS, 450 * MS, 500 * MS, 550 * MS]
    assert "/map/messages/data" not in rows  # only its acknowledgement was received
    states = [(row["simulated_time"], row["StateChange:state"]) for row in rows["/radio/a"] if "simulated_time" in row]
    assert [(time_ns // MS, state[0]) for time_ns, state in states] == [
        (0, "listen"), (100, "transmit"), (100, "collided"), (102, "listen"), (103, "listen"), (400, "transmit"),
        (401, "listen"),
    ]  # fmt: skip


def test_every_part_of_a_run_is_there(whole: Table) -> None:
    expected = {"/map/field", "/map/links", "/map/nodes", "/map/nodes/rims", "/map/nodes/labels", "/map/dead"}
    expected |= {"/map/model/edges", "/map/model/variables", "/map/targets", "/map/estimates/0", "/map/losses/acks"}
    expected |= {f"/map/legend/{part}" for part in ("labels", "arrows", "lines", "discs")}
    expected |= {
        "/map/messages/observations/broadcast",
        "/map/messages/belief",
        "/map/acks",
        "/map/losses/lost",
        "/log/info",
    }
    expected |= {
        "/map/losses/lost/reasons",
        "/plots/messages/belief",
        "/plots/senders/graph_messages",
        "/plots/accuracy",
        "/plots/energy/n01",
    }
    expected |= {f"/radio/n{node:02d}" for node in range(NODES)}
    assert expected <= set(whole)


def test_nodes_fade_and_die_when_they_do(whole: Table) -> None:
    colours = timed(whole["/map/nodes"], "Points2D:colors")
    green, red = (np.array([row[5] >> shift & 255 for shift in (16, 24)]) for row in (colours[0], colours[20 * 10**9]))
    assert green[0] > green[1]
    assert red[0] < green[0]
    assert list(timed(whole["/map/dead"], "Points2D:positions")) == [round(DEATH_S * 1e9)]
    states = timed(whole[f"/radio/n{DEAD_NODE}"], "StateChange:state")
    assert states[round(DEATH_S * 1e9)] == ["dead"]
    assert all(len(row) == NODES for row in colours.values())


def test_log_tells_reasons(whole: Table) -> None:
    lines = {text for *_, text in log_of(whole)}
    assert f"n{DEAD_NODE} died: battery empty" in lines
    assert f"{NODES} nodes started" in lines
    assert "n06: becomes leader" in lines
    identified = sorted(line for line in lines if "takes track" in line)
    assert identified == ["n06 takes track 0 for target 0 (70 %)", "n06 takes track 0 for target 1 (75 %)"]
    assert "n06: hand-off to n07" in lines
    assert any(re.search(r"^n\d\d: gave up belief #\d+ to n\d\d: no ack \(last loss: \w+\)$", line) for line in lines)
    levels = {text: level for _, level, text in log_of(whole)}
    assert levels[f"n{DEAD_NODE} died: battery empty"] == "ERROR"


def test_log_tells_a_decision_only_when_it_changes(tmp_path: Path) -> None:
    decisions = [(0, [3, -1]), (1, [3, -1]), (2, [3, 12]), (3, [3, 12])]
    with TraceWriter(tmp_path / "three.mcap", {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        for number, targets in decisions:
            writer.write(Association(0, targets, number), number * MS)
            writer.write(Association(1, [], number), number * MS)
    assert log_of(recording(tmp_path / "three.mcap", tmp_path)) == [
        (0, "INFO", "a decides its measurements' targets: 3, none"),
        (2 * MS, "INFO", "a decides its measurements' targets: 3, 12"),
    ]


def test_messages_a_second_add_up(whole: Table, grid: Path) -> None:
    sent = sum(1 for _ in read_trace(grid, {"/messages/sent"}))
    curves = [timed(whole[f"/plots/messages/{kind}"], "Scalars:scalars") for kind in ("observations", "belief")]
    width_s = nice(20 / 60)
    assert sum(value[0] * width_s for curve in curves for value in curve.values()) == pytest.approx(sent)


def test_kinds_nodes_and_window_select(grid: Path, tmp_path: Path) -> None:
    rows = recording(grid, tmp_path, kinds=frozenset({"belief"}), nodes=frozenset({6}), start_s=5.0, end_s=7.0)
    assert "/map/messages/observations/broadcast" not in rows
    assert {path for path in rows if path.startswith(("/radio", "/plots/energy/"))} == {
        "/radio/n06",
        "/plots/energy/n06",
    }
    instants = [row["simulated_time"] for row in rows["/map/messages/belief"] if "simulated_time" in row]
    assert min(instants) >= 5 * 10**9
    assert max(instants) <= 7.2 * 10**9


def test_a_late_window_remembers_what_still_holds(grid: Path, tmp_path: Path) -> None:
    rows = recording(grid, tmp_path, start_s=19.1, end_s=19.9)
    start = round(19.1 * 1e9)
    assert list(timed(rows["/map/dead"], "Points2D:positions")) == [start]
    assert list(timed(rows["/map/nodes"], "Points2D:colors")) == [start]
    lane = [row["StateChange:state"] for row in rows[f"/radio/n{DEAD_NODE}"] if "simulated_time" in row]
    assert lane[-1] == ["dead"]
    times = [
        row["simulated_time"]
        for path, part in rows.items()
        for row in part
        if "simulated_time" in row and path != "/map"
    ]
    assert min(times) >= start - 10**9  # a bar of a rate may begin before
    assert log_of(rows)[0][0] >= start
    assert min(timed(rows["/map/targets"], "LineStrips2D:strips")) == start


def test_links_thin_out_where_they_crowd_and_go_with_the_dead(tmp_path: Path) -> None:
    count = 20
    pairs = [(a, b) for a in range(count) for b in range(count) if a != b]
    with TraceWriter(tmp_path / "dense.mcap", {}) as writer:
        writer.write(named_nodes(*(f"n{node:02d}" for node in range(count))), 0)
        gains = [-50.0 - abs(a - b) for a, b in pairs]
        writer.write(LinkTable([a for a, _ in pairs], [b for _, b in pairs], gains, [1.0] * len(pairs)), 0)
        writer.write(NodeLife(10, "died", ""), 5 * MS)
        writer.write(NodeLife(10, "started", ""), 7 * MS)
    lines = timed(recording(tmp_path / "dense.mcap", tmp_path)["/map/links"], "LineStrips2D:strips")
    ends = {
        when: {tuple(sorted(round(x / 10) for x, _ in strip)) for strip in strips} for when, strips in lines.items()
    }
    # In a row the best links are those to the two neighbours on either side; at the ends, to the next four.
    near = {(a, b) for a in range(count) for b in (a + 1, a + 2) if b < count}
    assert ends[0] == near | {(0, 3), (0, 4), (1, 4), (15, 18), (15, 19), (16, 19)}
    assert ends[5 * MS] == {pair for pair in ends[0] if 10 not in pair}
    assert ends[7 * MS] == ends[0]


def test_of_a_sender_one_reason_is_told_and_of_many_none(tmp_path: Path) -> None:
    busy, count = OUTCOME_CODE["busy"], 12
    with TraceWriter(tmp_path / "busy.mcap", {}) as writer:
        writer.write(named_nodes(*(f"n{node:02d}" for node in range(count))), 0)
        for start, senders in ((0, [0, 0, 3]), (400 * MS, range(count - 1))):
            for source in senders:
                frame = Frame(
                    0, start, start + MS, source, source + 1, "x", 0, 9, 0, 1, 0.0, [source + 1], [busy], [0.0], [0.0]
                )
                writer.write(frame, start + MS)
        ack = Frame(0, 800 * MS, 801 * MS, 1, 0, "x", 1, 5, 0, 1, 0.0, [0], [busy], [0.0], [0.0])
        writer.write(ack, 801 * MS)
    rows = recording(tmp_path / "busy.mcap", tmp_path, hold_s=0.15, tick_s=0.05)
    labels = timed(rows["/map/losses/lost/reasons"], "Points2D:labels")
    assert labels[0] == ["busy", "busy"]
    assert labels[400 * MS] == []
    assert max(labels) < 800 * MS
    assert 800 * MS in timed(rows["/map/losses/acks"], "Arrows2D:vectors")


def test_the_busiest_radios_come_first(grid: Path) -> None:
    sent: Counter[int] = Counter(event.source for _, event in read_trace(grid, {"/frames"}) if isinstance(event, Frame))
    scene = load_scene(grid)
    pace = decide(ReplayOptions(), 20 * 10**9)
    lanes = LaneTrack(Setting(scene, pace, ReplayOptions(), Kinds(None), np.ones(NODES, bool), drained=False))
    for batch in batches(grid, ["/frames"], 0, pace.end_ns):
        assert list(lanes.take(batch))
    assert lanes.busiest() == [f"/radio/n{node:02d}" for node in sorted(range(NODES), key=lambda n: (-sent[n], n))]


@pytest.mark.parametrize("options", [{"start_s": 10.0}, {"kinds": frozenset({"tell"})}], ids=str)
def test_a_window_and_a_choice_of_kinds_keep_the_colours_of_the_run(tmp_path: Path, options: dict[str, Any]) -> None:
    """In the order in which messages were first sent, also where the first frame is of another kind."""
    trace, ears = tmp_path / "talk.mcap", ([1], [OUTCOME_CODE["received"]], [-60.0], [9.0])
    with TraceWriter(trace, {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        for number, (at_s, kind) in enumerate([(1, "ask"), (2, "tell"), (12, "tell"), (20, "ask")], start=1):
            start_ns = at_s * 1000 * MS
            writer.write(MessageSent(number, 0, 1, kind, 20, 1, []), start_ns)
            if at_s > 1:
                frame = Frame(number, start_ns, start_ns + MS, 0, 1, kind, 0, 20, 0, number, 0.0, *ears)
                writer.write(frame, start_ns + MS)
    red, green, blue, alpha = style.kind_colour(1)
    rows = recording(trace, tmp_path, **options)["/map/messages/tell"]
    colours = [row["Arrows2D:colors"] for row in rows if row.get("Arrows2D:colors")]
    assert colours == [[red << 24 | green << 16 | blue << 8 | alpha]]


def test_a_cut_trace_is_shown_up_to_the_cut(grid: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(grid.read_bytes()[:-60])
    with pytest.warns(UserWarning, match="cut short"):
        rows = recording(cut, tmp_path)
    assert "/map/messages/belief" in rows


def test_of_a_cut_trace_rerun_itself_says_nothing(grid: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(grid.read_bytes()[:-60])
    program = f"from netsim import replay; replay.save({str(cut)!r}, {str(tmp_path / 'cut.rrd')!r})"
    quiet = {name: value for name, value in os.environ.items() if name != "RUST_LOG"}
    done = subprocess.run([sys.executable, "-c", program], env=quiet, capture_output=True, text=True, check=True)
    assert "re_mcap" not in done.stdout + done.stderr


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=30)
@given(position=st.floats(0, 1), flip=st.integers(0, 255), cut=st.booleans())
def test_damage_anywhere_raises_nothing_but_a_trace_error(
    grid: Path, tmp_path: Path, position: float, flip: int, cut: bool
) -> None:
    data = bytearray(grid.read_bytes())
    at = int(position * (len(data) - 1))
    data[at] ^= flip
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data[:at] if cut else data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncatedTraceWarning)
        complaint = complaint_about(path, tmp_path / "damaged.rrd")
    assert "\n" not in complaint
    assert complaint.count(str(path)) <= 1


def complaint_about(path: Path, rrd: Path) -> str:
    """The trace error that converting gives; empty if none."""
    try:
        replay.save(path, rrd)
    except TraceError as error:
        return str(error)
    return ""


def test_any_kind_and_name_will_do(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "odd.mcap", {}) as writer:
        odd, none = ["a b/c", "\u00e9!"], [""] * 2
        writer.write(NodeTable([5, 9], odd, none, none, [0, 1], [0, 0], none, none, [1.0] * 2), 0)
        frame = Frame(0, 0, 2 * MS, 5, 9, "x / y#1", 0, 5, 0, 1, 0.0, [9], [0], [0.0], [0.0])
        writer.write(frame, 2 * MS)
        writer.write(MessageSent(1, 5, 9, "x / y#1", 5, 1, []), 2 * MS)
    rows = recording(tmp_path / "odd.mcap", tmp_path)
    assert sum(path.startswith(("/map/messages/", "/plots/messages/", "/radio/")) for path in rows) == 4


def test_what_is_no_trace_is_one_clear_error(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(b"garbage")
    with pytest.raises(TraceError, match="not an MCAP file"):
        replay.save(path, tmp_path / "x.rrd")
    with TraceWriter(path, {}):
        pass
    with pytest.raises(TraceError, match="names no nodes"):
        replay.save(path, tmp_path / "x.rrd")
    write_three_frames(path)
    with pytest.raises(NetsimError, match="cannot write the recording"):
        replay.save(path, tmp_path / "nowhere" / "x.rrd")


def test_a_recording_never_takes_the_place_of_its_trace(grid: Path, tmp_path: Path) -> None:
    trace = tmp_path / "t.rrd"  # whatever its name, and whichever way it is named
    trace.write_bytes(grid.read_bytes())
    (tmp_path / "link.rrd").symlink_to(trace)
    for out in (trace, tmp_path / "link.rrd"):
        with pytest.raises(ScenarioError, match="the trace itself, which would be lost"):
            replay.save(trace, out)
    assert trace.read_bytes() == grid.read_bytes()


def test_a_full_disk_leaves_no_half_recording(grid: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.rrd"
    path.write_bytes(b"mine")
    program = (
        "import resource, signal, sys; from netsim import errors, replay\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        f"try: replay.save({str(grid)!r}, {str(path)!r})\n"
        "except errors.NetsimError as error: sys.exit(str(error))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "x.rrd: cannot write the recording: File too large" in done.stderr
    assert path.read_bytes() == b"mine"
    assert [each.name for each in tmp_path.iterdir()] == ["x.rrd"]


def test_rerun_decodes_what_we_encode(grid: Path) -> None:
    """Rerun's own decoder gives the same values, field by field, for every topic in the trace."""
    ours: dict[str, list[Any]] = {}
    for _, event in read_trace(grid):
        ours.setdefault(event.topic, []).append(event)
    types = {event_type.topic: event_type for event_type in EVENT_TYPES if event_type.topic != "/log"}
    seen = 0
    for chunk in McapReader(grid, timeline_type="duration", decoders=["ros2_reflection"]).stream():
        batch = chunk.to_record_batch()
        column = next((name for name in batch.schema.names if name.endswith(":message")), None)
        if str(chunk.entity_path) not in types or column is None:
            continue
        theirs = batch.column(batch.schema.get_field_index(column)).flatten().to_pylist()
        events = ours[str(chunk.entity_path)]
        assert len(theirs) == len(events)
        for event, row in list(zip(events, theirs, strict=True))[:200]:
            for name in wire_types(type(event)):
                np.testing.assert_array_equal(np.asarray(getattr(event, name)), np.asarray(row[name]))
        seen += len(events)
    assert seen == sum(map(len, ours.values())) - len(ours["/log"])


def test_importing_replay_does_not_import_rerun() -> None:
    program = "import sys, netsim.replay; sys.exit('rerun' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
