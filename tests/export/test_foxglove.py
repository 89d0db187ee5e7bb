"""Scenes for Foxglove: every message decodes by the schema in the file; what a hand-made trace shows, shape by shape."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

pytest.importorskip("foxglove_schemas_protobuf", reason="pip install -e '.[foxglove]' to test scenes for Foxglove")

from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet

import netsim
from netsim.export import Job, Selection, export
from netsim.export.foxglove.targets import ellipse
from netsim.replay import style
from netsim.trace import events as e
from netsim.trace.events import BROADCAST, OUTCOME_CODE, Event
from netsim.trace.writer import TraceWriter

S = 1_000_000_000
RECEIVED, OVERHEARD, COLLIDED, WEAK, ASLEEP = (
    OUTCOME_CODE[name] for name in ("received", "overheard", "collided", "weak", "asleep")
)


def frame(number: int, end_ns: int, source: int, destination: int, heard: dict[int, int], **more: Any) -> e.Frame:
    fields: dict[str, Any] = {"kind": "map", "is_ack": 0, "size_byte": 60, "attempt": 0, "message_id": 1} | more
    level = [-70.0] * len(heard)
    fields |= {"tx_power_dbm": 0.0, "rx_node": list(heard), "rx_outcome": list(heard.values())}
    return e.Frame(number, end_ns - 10**6, end_ns, source, destination, **fields, rx_rssi_dbm=level, rx_sinr_db=level)


NODES = e.NodeTable([1, 2, 3], ["a", "b", "c"], ["g"] * 3, ["sensor"] * 3, [0.0, 30.0, 0.0], [0.0, 40.0, 8.0],
                    ["r"] * 3, ["p"] * 3, [10.0, 10.0, math.inf])  # fmt: skip
ROWS: list[tuple[int, Event]] = [
    (0, e.FieldInfo(64.0, 48.0, -2.0, -4.0)),
    (0, NODES),
    (0, e.LinkTable([1, 1, 2], [2, 3, 1], [-70.0] * 3, [0.9, 0.4, 0.05])),
    (1, e.TruthTargets([5], [10.0], [20.0])),
    (S, frame(1, S, 1, 2, {2: RECEIVED, 3: OVERHEARD})),
    (S + 1, frame(2, S + 1, 2, 1, {1: RECEIVED}, is_ack=1, size_byte=5)),
    (S + 2, frame(3, S + 2, 1, BROADCAST, {2: ASLEEP, 3: WEAK}, kind="ask", attempt=1)),
    (S + 3, frame(4, S + 3, 3, BROADCAST, {1: COLLIDED, 2: RECEIVED}, kind="ask")),
    (2 * S, e.NodeEnergy([1, 2, 3], [2.5, 10.0, 1.0], [7.5, 0.0, math.inf])),
    (2 * S, e.NodeLife(2, "died", "battery empty")),
    (2 * S, e.Role(1, "leader", 1)),
    (3 * S, e.Estimate(1, 0, 13.0, 24.0, [4.0, 0.0, 1.0])),
    (3 * S, e.Belief(1, 0, 7, 2.0, 3.0, 5.0, 4, [0, 6], [0.25, 0.75])),
    (3 * S, e.Particles(1, 7, [0, 1], 50, [0.5, 0.5], [1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0])),
    (4 * S, e.Role(1, "leader", 0)),
    (4 * S, e.MessageDropped(9, 1, 2, 1, "map", "no_ack")),
]


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    with TraceWriter(tmp_path / "t.mcap", {"seed": "3"}) as writer:
        for time_ns, event in ROWS:
            writer.write(event, time_ns)
    return tmp_path / "t.mcap"


Told = list[tuple[int, Any]]


def decoded(path: Path) -> dict[str, Told]:
    """Every message of a file by topic, decoded with nothing but the schemas in the file."""
    found: dict[str, Told] = {}
    classes: dict[int, Any] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            assert schema is not None
            if schema.encoding == "jsonschema":
                value = json.loads(message.data)
                assert set(json.loads(schema.data)["properties"] or value) >= set(value)
            else:
                if schema.id not in classes:
                    classes[schema.id] = message_class(schema.name, schema.data)
                value = classes[schema.id].FromString(message.data)
                assert value.SerializeToString(deterministic=True) == message.data
            found.setdefault(channel.topic, []).append((message.log_time, value))
    return found


def message_class(name: str, description: bytes) -> Any:
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(description).file:
        pool.AddSerializedFile(file.SerializeToString())
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


def scene(trace: Path, **selection: Any) -> dict[str, Told]:
    out = trace.with_suffix(".scene.mcap")
    export(Job(trace=trace, selection=Selection(**selection)), {"foxglove": out}, force=True)
    return decoded(out)


def rgba(shape: Any) -> tuple[int, ...]:
    return tuple(round(255 * part) for part in (shape.color.r, shape.color.g, shape.color.b, shape.color.a))


def ends(arrow: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """Tail and head of an arrow: its x axis, turned by the pose's quaternion."""
    turn, tail = arrow.pose.orientation, arrow.pose.position
    length = arrow.shaft_length + arrow.head_length
    east, north = 1 - 2 * (turn.y**2 + turn.z**2), 2 * (turn.x * turn.y + turn.w * turn.z)
    return (tail.x, tail.y), (round(tail.x + length * east, 9), round(tail.y + length * north, 9))


def test_topics_and_frames_of_reference(trace: Path) -> None:
    got = scene(trace)
    assert set(got) == {
        "/scene/field", "/scene/nodes", "/scene/leaders", "/scene/links", "/scene/targets", "/scene/estimates",
        "/scene/messages/map", "/scene/messages/ask", "/scene/acknowledgements", "/beliefs/0", "/particles",
        "/log", "/energy", "/traffic", "/error",
    }  # fmt: skip
    for topic, told in got.items():
        for time_ns, message in told:
            for each in getattr(message, "entities", [message] if topic in ("/beliefs/0", "/particles") else []):
                assert (each.frame_id, each.timestamp.ToNanoseconds()) == ("map", time_ns)


def test_nodes_show_energy_death_and_leaders(trace: Path) -> None:
    got = scene(trace)
    times, updates = zip(*got["/scene/nodes"], strict=True)
    assert times == (0, 2 * S, 2 * S)
    first, sampled, died = ({each.id: each for each in update.entities} for update in updates)
    assert list(first) == list(died) == ["node/1", "node/2", "node/3"]
    assert [(each.key, each.value) for each in first["node/2"].metadata] == [("node", "2"), ("name", "b")]
    ball = first["node/2"].spheres[0]
    assert (ball.pose.position.x, ball.pose.position.y) == (30.0, 40.0)
    full, three_quarters = style.energy_colours(np.array([1.0, 0.76])).tolist()
    assert rgba(ball) == tuple(full)
    assert rgba(sampled["node/1"].spheres[0]) == tuple(three_quarters)  # 0.75, to the nearest fiftieth
    assert rgba(died["node/2"].spheres[0]) == style.DEAD
    assert rgba(first["node/3"].spheres[0]) == style.ROLE_COLOURS["sensor"]
    assert [(at, len(each.entities[0].cylinders)) for at, each in got["/scene/leaders"]] == [(2 * S, 1), (4 * S, 0)]


def test_frames_are_arrows_from_sender_to_listener(trace: Path) -> None:
    got = scene(trace)
    ((at, unicast),) = got["/scene/messages/map"]
    assert at == S
    (arrow,) = unicast.entities[0].arrows
    assert ends(arrow) == ((0.0, 0.0), (30.0, 40.0))
    assert rgba(arrow) == style.kind_colour(0)
    assert unicast.entities[0].lifetime.ToMilliseconds() == 150
    notes = {each.key: each.value for each in unicast.entities[0].metadata}
    assert notes["listeners"] == "1 received, 1 overheard"
    lost, clash = (update.entities[0].arrows for _, update in got["/scene/messages/ask"])
    assert [(ends(each)[1], rgba(each)) for each in lost] == [
        ((30.0, 40.0), style.LOST)
    ]  # the poor link promised nothing
    assert [(ends(each)[1], rgba(each)) for each in clash] == [
        ((0.0, 0.0), style.COLLIDED), ((30.0, 40.0), style.kind_colour(1))
    ]  # fmt: skip
    ((_, ack),) = got["/scene/acknowledgements"]
    assert rgba(ack.entities[0].arrows[0]) == style.ACKNOWLEDGEMENT


def test_targets_estimates_and_error(trace: Path) -> None:
    got = scene(trace)
    ((_, truth),) = got["/scene/targets"]
    assert truth.entities[0].spheres[0].pose.position.y == 20.0
    ((_, estimates),) = got["/scene/estimates"]
    (ellipse_,) = estimates.entities[0].cylinders
    assert (ellipse_.size.x, ellipse_.size.y) == (8.0, 4.0)  # twice two standard deviations
    assert got["/error"] == [
        (3 * S, {"track": 0, "thread": 0, "node": 1, "error_m": 5.0, "spread_m": math.sqrt(5.0)})
    ]  # fmt: skip
    assert ellipse([1.0, 0.0, 4.0]) == (2.0, 1.0, pytest.approx(math.pi / 2))
    long_m, wide_m, yaw_rad = ellipse([2.5, 1.5, 2.5])
    assert (long_m, wide_m) == (pytest.approx(2.0), pytest.approx(1.0))
    assert math.tan(yaw_rad) == pytest.approx(1.0)


def unpacked(message: Any, stride: int) -> list[dict[str, float]]:
    """The records of a grid or a cloud, read by the fields that it announces."""
    kinds = {1: "u1", 7: "<f4"}
    layout = np.dtype(
        {
            "names": [each.name for each in message.fields],
            "formats": [kinds[each.type] for each in message.fields],
            "offsets": [each.offset for each in message.fields],
            "itemsize": stride,
        }
    )
    return [dict(zip(layout.names or (), row.tolist(), strict=True)) for row in np.frombuffer(message.data, layout)]


def test_beliefs_are_grids_and_clouds(trace: Path) -> None:
    got = scene(trace)
    ((_, grid),) = got["/beliefs/0"]
    assert (grid.pose.position.x, grid.pose.position.y, grid.cell_size.x, grid.column_count) == (2.0, 3.0, 5.0, 4)
    cells = unpacked(grid, grid.cell_stride)
    assert grid.row_stride == 4 * grid.cell_stride
    assert [cell["probability"] for cell in cells] == [0.25, 0, 0, 0, 0, 0, 0.75, 0]
    assert [cell["alpha"] > 0 for cell in cells] == [True, False, False, False, False, False, True, False]
    ((_, cloud),) = got["/particles"]
    points = unpacked(cloud, cloud.point_stride)
    assert [(point["x"], point["y"], point["track"]) for point in points] == [
        (1, 5, 0),
        (2, 6, 0),
        (3, 7, 1),
        (4, 8, 1),
    ]
    assert {point["weight"] for point in points} == {0.5}


def test_figures_and_log(trace: Path) -> None:
    got = scene(trace)
    assert got["/energy"] == [
        (2 * S, {"total_consumed_j": 13.5, "least_left_j": 0.0, "nodes": [
            {"node": 1, "name": "a", "consumed_j": 2.5, "left_j": 7.5},
            {"node": 2, "name": "b", "consumed_j": 10.0, "left_j": 0.0},
            {"node": 3, "name": "c", "consumed_j": 1.0},
        ]})
    ]  # fmt: skip
    ((at, traffic),) = got["/traffic"]
    assert at == 2 * S
    assert (traffic["frames"], traffic["acknowledgements"], traffic["retries"], traffic["byte"]) == (4, 1, 1, 185)
    assert traffic["airtime_s"] == pytest.approx(0.004)
    assert traffic["kinds"] == {"ask": 2, "map": 2}
    assert traffic["outcomes"] == {"received": 3, "overheard": 1, "collided": 1, "weak": 1, "asleep": 1}
    lines = [(line.level, line.name, line.message) for _, line in got["/log"]]
    assert lines == [
        (3, "b", "died: battery empty"), (2, "a", "becomes leader"), (2, "a", "is no longer leader"),
        (3, "a", "message 9 (map) dropped: no_ack"),
    ]  # fmt: skip


def test_a_window_begins_with_what_was_known_by_then(trace: Path) -> None:
    got = scene(trace, start_ns=2 * S + 1, end_ns=4 * S)
    assert got["/scene/nodes"][0][0] == 2 * S + 1
    assert rgba(got["/scene/nodes"][0][1].entities[1].spheres[0]) == style.DEAD
    assert len(got["/scene/leaders"][0][1].entities[0].cylinders) == 1
    assert got["/scene/targets"][0][0] == 2 * S + 1
    assert "/scene/messages/map" not in got
    assert "/log" not in got


def test_filters(trace: Path) -> None:
    assert "/scene/messages/map" not in scene(trace, kinds={"ask"})
    assert "/scene/estimates" not in scene(trace, nodes={3})


def test_a_real_run_decodes_and_equal_runs_give_equal_bytes(scenarios: Path, tmp_path: Path) -> None:
    loaded = netsim.load(scenarios / "quickstart.yaml", ["duration_s=5"])
    done = netsim.run(loaded, folder=tmp_path / "run")
    assert done.trace is not None
    for name in ("a.mcap", "b.mcap"):
        export(Job(trace=done.trace), {"foxglove": tmp_path / name})
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    got = decoded(tmp_path / "a.mcap")
    assert got["/metrics"][-1][1]["frames"] == sum(each["frames"] for _, each in got["/traffic"])
