"""Captures: a hand-made trace frame by frame, the order of times, the numbers of a real MAC, and what tshark reads."""

import shutil
import subprocess
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import pytest
from captures import Captured, read_capture
from hypothesis import given
from hypothesis import strategies as st

import netsim
from netsim.errors import TraceError
from netsim.export import ExportWarning, Job, Selection, export
from netsim.export.ieee802154 import checksum
from netsim.export.ordering import ByStart
from netsim.export.sequences import SequenceNumbers
from netsim.sim.air import FrameLog
from netsim.sim.frames import Transmission
from netsim.trace.events import BROADCAST, OUTCOME_CODE, Frame, NodeTable
from netsim.trace.reader import read_trace
from netsim.trace.writer import Attachment, TraceWriter

RECEIVED, OVERHEARD, WEAK = (OUTCOME_CODE[name] for name in ("received", "overheard", "weak"))
CSMA = b"medium: {type: log-distance}\nmac: {type: csma, acknowledge: true}\n"


def frame(number: int, start_ns: int, end_ns: int, source: int, destination: int, **more: object) -> Frame:
    """A data frame of 20 bytes, unless told otherwise."""
    fields: dict[str, object] = {"kind": "belief", "is_ack": 0, "size_byte": 20, "attempt": 0, "message_id": 1}
    fields |= {"tx_power_dbm": 0.0, "rx_node": [], "rx_outcome": [], "rx_rssi_dbm": [], "rx_sinr_db": []} | more
    return Frame(number, start_ns, end_ns, source, destination, **fields)


def heard(*rows: tuple[int, int, float]) -> dict[str, list[float]]:
    nodes, outcomes, powers = zip(*rows, strict=True)
    return {"rx_node": nodes, "rx_outcome": outcomes, "rx_rssi_dbm": powers, "rx_sinr_db": powers}


# A long broadcast of node 7, during which node 1 sends to 2, is acknowledged, and repeats itself after a while.
FRAMES = [
    frame(2, 1_000_000_100, 1_000_700_100, 1, 2, **heard((2, RECEIVED, -60.5), (7, WEAK, -90.0))),
    frame(3, 1_000_892_100, 1_001_244_100, 2, 1, is_ack=1, size_byte=5, **heard((1, WEAK, -61.0), (7, OVERHEARD, -89.0))),
    frame(1, 999_999_999, 1_003_999_999, 7, BROADCAST, kind="map", message_id=9, size_byte=127,
          **heard((1, RECEIVED, -80.25), (2, RECEIVED, -70.75))),
    frame(4, 2_000_000_000, 2_000_700_000, 1, 2, attempt=1, **heard((2, RECEIVED, -60.5))),
    frame(5, 3_000_000_000, 3_000_700_000, 1, 2, message_id=2, **heard((2, RECEIVED, -60.5))),
]  # fmt: skip


def write(path: Path, frames: list[Frame], radio: str = "CC2420", scenario: bytes = CSMA) -> Path:
    nodes = [1, 2, 7]
    table = NodeTable(nodes, ["a", "b", "c"], [""] * 3, ["sensor"] * 3, nodes, nodes, [radio] * 3, [""] * 3, nodes)
    with TraceWriter(path, {}, [Attachment("scenario.yaml", "application/yaml", scenario)]) as writer:
        writer.write(table, 0)
        for each in frames:
            writer.write(each, each.t_end_ns)
    return path


def captured(trace: Path, **options: object) -> list[Captured]:
    out = trace.with_suffix(".pcap")
    export(Job(trace=trace, **options), {"pcap": out}, force=True)
    return read_capture(out)


def test_frames_that_are_recorded_late_are_in_order_too(tmp_path: Path) -> None:
    """On the ideal medium with a delay, but for those that a crash breaks off."""
    table = NodeTable(
        [1, 2, 7], ["a", "b", "c"], [""] * 3, ["sensor"] * 3, *[[0.0] * 3] * 2, ["CC2420"] * 3, [""] * 3, [1] * 3
    )
    ms, path = 1_000_000, tmp_path / "t.mcap"
    with TraceWriter(path, {}, [Attachment("scenario.yaml", "application/yaml", CSMA)]) as writer:
        writer.write(table, 0)
        for number, start_ms, end_ms, source, recorded_ms in (
            (2, 50, 52, 2, 52),
            (3, 60, 62, 7, 62),
            (1, 0, 1, 1, 101),
        ):
            writer.write(frame(number, start_ms * ms, end_ms * ms, source, BROADCAST), recorded_ms * ms)
    assert [each.time_ns // ms for each in captured(path)] == [0, 50, 60]


def test_broadcasts_that_a_node_received_are_its_traffic(tmp_path: Path) -> None:
    trace = write(tmp_path / "t.mcap", FRAMES)
    assert [len(each.psdu) for each in captured(trace, selection=Selection(nodes={2}))] == [127, 20, 5, 20, 20]
    weak = frame(1, 0, 10, 1, BROADCAST, **heard((2, WEAK, -99.0), (7, RECEIVED, -50.0)))
    with pytest.warns(UserWarning, match="no frame"):
        assert captured(write(tmp_path / "u.mcap", [weak]), selection=Selection(nodes={2})) == []


def test_every_frame_once_as_it_was_on_the_air(tmp_path: Path) -> None:
    got = captured(write(tmp_path / "t.mcap", FRAMES))
    assert [each.time_ns for each in got] == [999_999_999, 1_000_000_100, 1_000_892_100, 2_000_000_000, 3_000_000_000]
    assert [each.span_ns[0] for each in got] == [each.time_ns for each in got]
    assert got[0].span_ns == (999_999_999, 1_003_999_999)
    assert [len(each.psdu) for each in got] == [127, 20, 5, 20, 20]
    assert [each.sequence for each in got] == [0, 0, 0, 0, 1]
    assert [each.rss_dbm for each in got] == [-70.75, -60.5, -61.0, -60.5, -60.5]
    assert {each.channel for each in got} == {(11, 0)}
    broadcast, data, ack, *_ = got
    assert broadcast.psdu[:10] == bytes.fromhex("4188 00 534e ffff 0700 3f")
    assert broadcast.psdu[10:-2] == bytes(115)
    assert data.psdu[:10] == bytes.fromhex("6188 00 534e 0200 0100 3f")
    assert ack.psdu[:3] == bytes.fromhex("0200 00")


def test_a_capture_at_a_node_has_what_it_sent_or_decoded_with_its_power(tmp_path: Path) -> None:
    trace = write(tmp_path / "t.mcap", FRAMES)
    assert [each.rss_dbm for each in captured(trace, pcap_node=1)] == [-80.25, None, None, None]
    assert [each.rss_dbm for each in captured(trace, pcap_node=7)] == [None, -89.0]


def test_filters_leave_the_numbers_as_they_are(tmp_path: Path) -> None:
    trace = write(tmp_path / "t.mcap", FRAMES)
    only = captured(trace, selection=Selection(nodes={7}))
    assert [each.addresses for each in only] == [(0xFFFF, 7)]
    assert len(captured(trace, selection=Selection(kinds={"map"}))) == 1
    late = captured(trace, selection=Selection(start_ns=1_000_700_101, end_ns=3_000_000_000))
    assert [each.time_ns for each in late] == [999_999_999, 1_000_892_100, 2_000_000_000]


def test_other_radios_and_ideal_media_are_told_of(tmp_path: Path) -> None:
    long = frame(1, 0, 400_000_000, 1, 2, size_byte=255, **heard((2, RECEIVED, -110.0)))
    with pytest.warns(ExportWarning, match=r"SX1276 \(SF9\) is not of IEEE 802\.15\.4: .* no channel"):
        (got,) = captured(write(tmp_path / "lora.mcap", [long], radio="SX1276 (SF9)"))
    assert (got.channel, got.rss_dbm, len(got.psdu)) == (None, -110.0, 255)
    with pytest.warns(ExportWarning, match="the medium is ideal: .* neither received power nor channel"):
        (got,) = captured(
            write(tmp_path / "ideal.mcap", FRAMES[:1], scenario=b"medium: {type: ideal}\nmac: {type: ideal}")
        )
    assert (got.channel, got.rss_dbm, got.psdu[:2]) == (None, None, bytes.fromhex("4188"))


@pytest.mark.parametrize(
    ("medium", "channel"),
    [
        ("{type: free-space, frequency_hz: 2.48e9}", (26, 0)),
        ("{type: free-space, frequency_hz: 868.0e6}", None),
        ("{type: trace, channel: 17}", (17, 0)),
        ("{type: trace, channel: null}", None),
    ],
)
def test_the_channel_is_the_medium_s(tmp_path: Path, medium: str, channel: tuple[int, int] | None) -> None:
    trace = write(tmp_path / "t.mcap", FRAMES[:1], scenario=f"medium: {medium}\n".encode())
    assert captured(trace)[0].channel == channel


def test_what_is_no_frame_of_the_standard_is_refused(tmp_path: Path) -> None:
    trace = write(tmp_path / "t.mcap", [frame(6, 0, 10, 1, 2, size_byte=7)])
    with pytest.raises(TraceError, match="frame 6: 7 bytes are no frame"):
        captured(trace)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["t.mcap"]


def test_the_checksum_is_that_of_the_standard() -> None:
    """IEEE 802.15.4-2006, 7.2.1.9: the acknowledgement 02 00 56; and the check value of CRC-16/KERMIT, 0x2189."""
    assert checksum(b"123456789") == (0x2189).to_bytes(2, "little")
    bits = [int(bit) for byte in bytes.fromhex("020056") for bit in f"{byte:08b}"[::-1]]
    register = [0] * 16
    for bit in bits:  # figure 52: the register r0 ... r15, shifted once a bit
        back = bit ^ register[15]
        register = [back, *register[:15]]
        register[5] ^= back
        register[12] ^= back
    reversed_bits = "".join(map(str, register[::-1]))
    sent = bytes(int(reversed_bits[at : at + 8][::-1], 2) for at in (0, 8))
    assert checksum(bytes.fromhex("020056")) == sent


@given(st.lists(st.tuples(st.integers(0, 50), st.integers(0, 20)), max_size=40))
def test_records_come_in_the_order_of_their_beginnings(spans: list[tuple[int, int]]) -> None:
    ends = sorted((start + length, start, number) for number, (start, length) in enumerate(spans))
    order = ByStart(max((length for _, length in spans), default=0))
    out = []
    for end, start, number in ends:
        out += order.add(start, end, number, bytes([start, number]))
    out += order.rest()
    assert out == sorted(bytes([start, number]) for _, start, number in ends)


LISTENING = ["mac={type: lpl, variant: x-mac}", "duration_s=6"]


@pytest.mark.parametrize("overrides", [["duration_s=6"], LISTENING], ids=["csma", "lpl"])
def test_numbers_are_those_of_the_mac(
    scenarios: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, overrides: list[str]
) -> None:
    """But for where they begin, and for frames that never got on the air."""
    true: dict[int, int] = {}
    record = FrameLog.record

    def noted(log: FrameLog, transmission: Transmission) -> None:
        true[transmission.id] = transmission.frame.sequence
        record(log, transmission)

    monkeypatch.setattr(FrameLog, "record", noted)
    done = netsim.run(netsim.load(scenarios / "quickstart.yaml", overrides), folder=tmp_path / "run")
    assert done.trace is not None
    numbers, told = SequenceNumbers(), defaultdict(list)
    for _, event in read_trace(done.trace, {Frame.topic}):
        assert isinstance(event, Frame)
        number = numbers.of(event)
        told[event.destination if event.is_ack else event.source].append((number, true[event.frame_id]))
    assert sum(map(len, told.values())) > 50
    for pairs in told.values():
        for (number, sequence), (next_number, next_sequence) in pairwise(pairs):
            assert (number == next_number) == (sequence == next_sequence)


def tshark(capture: Path, *fields: str) -> list[list[str]]:
    if shutil.which("tshark") is None:
        pytest.skip(
            "tshark is not installed (Debian package tshark): captures are not read by Wireshark's own dissector"
        )
    names = [word for field in fields for word in ("-e", field)]
    done = subprocess.run(
        ["tshark", "-r", capture, "-T", "fields", *names], capture_output=True, text=True, check=True, timeout=60
    )
    return [line.split("\t") for line in done.stdout.splitlines()]


def test_tshark_reads_a_real_run_as_it_was(scenarios: Path, tmp_path: Path) -> None:
    loaded = netsim.load(scenarios / "lifetime.yaml", ["duration_s=1.5", "trace.detail=frames"])
    done = netsim.run(loaded, folder=tmp_path / "run")
    assert done.trace is not None
    frames = [event for _, event in read_trace(done.trace, {Frame.topic}) if isinstance(event, Frame)]
    numbers = SequenceNumbers()
    sequences = {each.frame_id: numbers.of(each) for each in frames}
    out = tmp_path / "run.pcap"
    export(Job(trace=done.trace), {"pcap": out})
    rows = tshark(
        out, "_ws.malformed", "frame.protocols", "frame.time_epoch", "wpan.frame_type", "wpan.src16", "wpan.dst16",
        "wpan.seq_no", "wpan.fcs_ok", "wpan-tap.rss", "wpan-tap.ch_num",
    )  # fmt: skip
    expected = sorted(frames, key=lambda each: (each.t_start_ns, each.frame_id))
    assert len(rows) == len(expected) > 100
    for each, row in zip(expected, rows, strict=True):
        malformed, protocols, time, kind, source, destination, number, right, rss, channel = row
        assert (malformed, right, channel) == ("", "1", "11")
        assert protocols == ("wpan-tap" if each.is_ack else "wpan-tap:data")
        assert time.split(".") == [f"{each.t_start_ns // 10**9}", f"{each.t_start_ns % 10**9:09d}"]
        assert (kind, int(number)) == ("0x0002" if each.is_ack else "0x0001", sequences[each.frame_id])
        if not each.is_ack:
            assert int(source, 16) == each.source
            assert int(destination, 16) == min(each.destination, 0xFFFF)
        powers = dict(zip(map(int, each.rx_node), each.rx_rssi_dbm, strict=True))
        power = max(powers.values()) if each.destination == BROADCAST else powers[each.destination]
        assert float(rss) == pytest.approx(power, rel=1e-6)


def test_tshark_finds_nothing_wrong_with_long_frames(tmp_path: Path) -> None:
    long = [frame(n, n * 10**9, n * 10**9 + 400_000_000, 1, 2, size_byte=255, message_id=n) for n in range(3)]
    trace, out = write(tmp_path / "t.mcap", long, radio="SX1276"), tmp_path / "t.pcap"
    with pytest.warns(ExportWarning):
        export(Job(trace=trace), {"pcap": out})
    assert tshark(out, "_ws.malformed", "_ws.expert", "wpan.fcs_ok") == [["", "", "1"]] * 3
