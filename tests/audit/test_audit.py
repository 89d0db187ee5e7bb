"""The rules of a trace: a good one passes every rule, and one broken law is found by its rule, where it is broken."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from good_trace import FILES, METADATA, MS, Row, air, changed, good_rows, state, with_event, without, write_rows
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader

from netsim.audit import Audit, audit_trace, check_trace
from netsim.audit.columns import Marks
from netsim.audit.tally import MOST_KEPT
from netsim.errors import TraceError
from netsim.trace.events import (
    BROADCAST,
    Belief,
    EnergyHarvest,
    EnergyLedger,
    FieldInfo,
    Frame,
    Log,
    Marginals,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeEnergy,
    NodeLife,
    NodePositions,
    NodeTable,
    PairProbabilities,
    RadioState,
    TruthOrigins,
)
from netsim.trace.fingerprint import fingerprint

Change = Callable[[list[Row]], list[Row]]


def broken_rules(audit: Audit) -> set[str]:
    return {tally.rule for tally in audit.tallies if tally.wrong}


def test_a_good_trace_passes_every_rule(tmp_path: Path) -> None:
    audit = audit_trace(write_rows(tmp_path / "trace.mcap", good_rows()))
    assert audit.findings == []
    assert [tally.rule for tally in audit.tallies if not tally.looked] == []
    assert audit.end.time_ns == 20 * MS
    assert len(audit.fingerprint or "") == 32


BROKEN: dict[str, tuple[Change, str, int | None, int | None]] = {
    "a node that nobody knows": (changed(MessageSent, 2, destination=9), "nodes are known", 6, 9),
    "two rows of one node": (changed(NodeTable, node=[1, 2, 2]), "nodes are known", 0, None),
    "no node table": (without(NodeTable), "nodes are known", None, None),
    "a broadcast that is a node": (changed(NodeLife, 3, node=BROADCAST), "nodes are known", 8, BROADCAST),
    "up without a crash": (changed(NodeLife, 3, event="finished"), "nodes live in order", 9, 3),
    "a short column": (changed(NodeEnergy, 1, left_j=[1.0]), "columns are of one length", 20, None),
    "a state that is none": (changed(RadioState, 0, state=77), "values are in range", 0, 1),
    "a reason that is none": (changed(MessageDropped, reason="bored"), "values are in range", 7, 1),
    "a flag of two": (changed(Frame, 1, is_strobe=2), "values are in range", 5, None),
    "a place that is none": (changed(NodeTable, x_m=[0.0, float("nan"), 1.0]), "values are in range", 0, None),
    "a level that is none": (changed(Log, level=9), "values are in range", 11, None),
    "a number twice": (changed(Frame, 1, frame_id=1), "frames have their time", 5, 2),
    "an end before the beginning": (changed(Frame, 1, t_start_ns=6 * MS), "frames have their time", 5, 2),
    "recorded before its end": (changed(Frame, 1, t_end_ns=6 * MS), "frames have their time", 5, 2),
    "recorded late": (changed(Frame, 1, t_end_ns=4 * MS), "frames have their time", 5, 2),
    "a number beyond all frames": (changed(Frame, 1, frame_id=BROADCAST), "frames have their time", 5, 2),
    "numbered before it began": (
        with_event(8, air(3, 2, 8, (3, 2), 3, (1, "busy"), (2, "busy"))), "frames have their time", 8, 3,
    ),
    "a frame is missing": (changed(Frame, 1, frame_id=3), "frames have their time", None, None),
    "a field without end": (changed(FieldInfo, width_m=float("inf")), "values are in range", 0, None),
    "a power that nobody can send": (changed(Frame, tx_power_dbm=float("nan")), "values are in range", 2, None),
    "a belief nowhere": (changed(Belief, origin_x_m=float("nan")), "values are in range", 10, 1),
    "two frames at once": (
        with_event(2, air(3, 1, 2, (1, 2), 1, (2, "busy"), (3, "busy"))), "one frame at a time", 2, 1,
    ),
    "sent asleep": (with_event(4, state(2, "sleep")), "senders are awake", 5, 2),
    "sent after death": (with_event(2, NodeLife(2, "died", "battery empty")), "senders are awake", 5, 2),
    "heard asleep": (with_event(4, state(1, "sleep")), "listeners are awake", 5, 1),
    "a frame without its state": (without(RadioState, 3), "radios transmit their frames", 2, 1),
    "a state without its frame": (with_event(7, state(2, "transmit")), "radios transmit their frames", 20, 2),
    "a listener twice": (
        changed(Frame, rx_node=[2, 2, 3], rx_outcome=[0, 0, 1], rx_rssi_dbm=[-70.0] * 3, rx_sinr_db=[9.0] * 3),
        "one outcome a listener", 2, 2,
    ),
    "its own listener": (changed(Frame, rx_node=[2, 1]), "one outcome a listener", 2, 1),
    "an outcome that is none": (changed(Frame, rx_outcome=[0, 99]), "one outcome a listener", 2, 3),
    "received, but not for it": (changed(Frame, rx_outcome=[0, 0]), "one outcome a listener", 2, 3),
    "overheard, but for it": (changed(Frame, 1, rx_outcome=[1, 3]), "one outcome a listener", 5, 1),
    "a power that is no number": (
        changed(Frame, rx_rssi_dbm=[float("nan"), 1.0]), "one outcome a listener", 2, None,
    ),
    "no outcome at a listener": (
        changed(Frame, rx_node=[2], rx_outcome=[0], rx_rssi_dbm=[-70.0], rx_sinr_db=[9.0]),
        "every listener has an outcome", 2, 3,
    ),
    "no outcome at the addressee": (
        changed(Frame, rx_node=[3], rx_outcome=[1], rx_rssi_dbm=[-70.0], rx_sinr_db=[9.0]),
        "every listener has an outcome", 2, 2,
    ),
    "a number left out": (changed(MessageSent, 2, message_id=4), "messages are numbered", 6, 1),
    "a number sent twice": (changed(MessageSent, 2, message_id=2), "messages are numbered", 6, 1),
    "a number beyond all": (changed(MessageSent, 2, message_id=BROADCAST), "messages are numbered", 6, 1),
    "a cause that was not received": (changed(MessageSent, 1, causes=[2]), "causes were received", 3, 2),
    "a frame of nothing": (changed(Frame, 1, message_id=40), "frames carry messages", 5, 2),
    "a frame before its message": (changed(Frame, 1, t_start_ns=2 * MS), "frames carry messages", 5, 2),
    "a frame of another kind": (changed(Frame, kind="answer"), "frames carry messages", 2, 1),
    "delivered without a frame": (changed(MessageDelivered, 1, node=3), "delivered by frames", 5, 3),
    "delivered, not sent": (changed(MessageDelivered, 1, message_id=9), "delivered as sent", 5, 1),
    "delivered with another size": (changed(MessageDelivered, 1, size_byte=9), "delivered as sent", 5, 1),
    "delivered with another latency": (changed(MessageDelivered, 1, latency_ns=9), "delivered as sent", 5, 1),
    "delivered to another": (changed(MessageDelivered, 0, node=1), "delivered as sent", 2, 1),
    "delivered twice": (
        with_event(6, MessageDelivered(2, 2, 1, "answer", 20, 1, 3 * MS)), "delivered once", 6, 1,
    ),
    "dropped, not sent": (changed(MessageDropped, message_id=40), "dropped as sent", 7, 1),
    "dropped as another kind": (changed(MessageDropped, kind="answer"), "dropped as sent", 7, 1),
    "a joule too many": (changed(NodeEnergy, 1, consumed_j=[0.5 + 2e-9, 0.25, 0.1]), "energy closes", 20, 1),
    "no ledger": (without(EnergyLedger), "energy closes", 20, None),
    "time booked twice": (
        changed(EnergyLedger, time_s=[0.019, 0.001, 0.018, 0.003, 0.02]), "time is booked once", 20, 2,
    ),
    "too little left": (changed(NodeEnergy, 1, left_j=[9.4, 10.0, float("inf")]), "batteries close", 20, 1),
    "mains power that ends": (changed(NodeEnergy, 1, left_j=[9.5, 10.0, 5.0]), "batteries close", 20, 3),
    "energy that comes back": (changed(NodeEnergy, 0, consumed_j=[9.0, 0.0, 0.0]), "batteries close", 20, 1),
    "more spilled than there was": (
        changed(EnergyHarvest, offered_j=[0.5], spilled_j=[0.75]), "batteries close", 20, 2,
    ),
    "no harvest where there was": (without(EnergyHarvest), "batteries close", 20, 2),
    "airtime that is not booked": (
        changed(EnergyLedger, state=["listen", "transmit", "listen", "listen", "listen"]), "airtime is booked", 20, 2,
    ),
    "airtime of another kind": (
        changed(EnergyLedger, kind=["", "hello", "", "hello", ""]), "airtime is booked", 20, 2,
    ),
    "above one": (changed(Marginals, probability=[-0.25, 1.25]), "probabilities are in [0, 1]", 10, 1),
    "no number": (changed(Belief, probability=[float("nan"), 0.5]), "probabilities are in [0, 1]", 10, 1),
    "outside of its bounds": (changed(PairProbabilities, high=[0.4]), "probabilities are in [0, 1]", 10, 1),
    "less than one in all": (changed(Belief, probability=[0.5, 0.4]), "probabilities sum to one", 10, 1),
}  # fmt: skip
"""What is broken, and where its rule must find it: the rule, the millisecond, the node."""


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_law_is_found(name: str, tmp_path: Path) -> None:
    change, rule, time_ms, node = BROKEN[name]
    audit = audit_trace(write_rows(tmp_path / "trace.mcap", change(good_rows())))
    assert rule in broken_rules(audit)
    places = [(each.time_ns, each.node) for each in audit.findings if each.rule == rule]
    assert (None if time_ms is None else time_ms * MS, node) in places


def test_every_rule_of_events_is_broken_by_some_case(tmp_path: Path) -> None:
    audit = audit_trace(write_rows(tmp_path / "trace.mcap", good_rows()))
    of_file = {"the file is whole", "time goes on", "topics are described", "attachments are readable"}
    assert {rule for _, rule, _, _ in BROKEN.values()} | of_file == {tally.rule for tally in audit.tallies}


def test_a_message_may_come_again_after_a_crash(tmp_path: Path) -> None:
    again = [
        with_event(6, NodeLife(1, "crashed", "a fault")),
        with_event(7, NodeLife(1, "rebooted", "Talk")),
        with_event(7, MessageDelivered(2, 2, 1, "answer", 20, 1, 4 * MS)),
    ]
    rows = good_rows()
    for change in again:
        rows = change(rows)
    assert check_trace(write_rows(tmp_path / "trace.mcap", rows)) == []


def test_frames_under_way_on_the_ideal_medium_are_recorded_after_one_that_a_crash_breaks_off(tmp_path: Path) -> None:
    """Message 4 goes out twice; the second frame is broken off at 14 ms, the first arrives at 17 ms, 5 ms after its end."""
    files = {
        **FILES,
        "scenario.yaml": FILES["scenario.yaml"].replace(b"type: log-distance", b"type: ideal, delay_s: 0.005"),
    }
    rows = good_rows()
    for change in (
        with_event(11, MessageSent(4, 2, BROADCAST, "hello", 9, 1, [])),
        with_event(11, state(2, "transmit")),
        with_event(12, state(2, "transmit")),
        with_event(14, NodeLife(2, "crashed", "a fault")),
        with_event(14, state(2, "off")),
        with_event(14, air(4, 12, 14, (2, BROADCAST), 4, (1, "dead"), (3, "dead"))),
        with_event(17, air(3, 11, 12, (2, BROADCAST), 4, (1, "lost"), (3, "lost"))),
        changed(
            EnergyLedger, node=[1, 1, 2, 2, 2, 3], device=["radio"] * 6,
            state=["listen", "transmit", "listen", "transmit", "transmit", "listen"],
            kind=["", "hello", "", "answer", "hello", ""], energy_j=[0.375, 0.125, 0.125, 0.0625, 0.0625, 0.1],
            time_s=[0.019, 0.001, 0.015, 0.002, 0.003, 0.02],
        ),
    ):  # fmt: skip
        rows = change(rows)
    assert check_trace(write_rows(tmp_path / "t.mcap", rows, files=files)) == []


def test_a_bearing_has_no_place(tmp_path: Path) -> None:
    rows = with_event(0, TruthOrigins(1, [float("nan")], [float("nan")], [0]))(good_rows())
    assert check_trace(write_rows(tmp_path / "trace.mcap", rows)) == []


def test_a_jammer_takes_numbers_too(tmp_path: Path) -> None:
    rows = changed(Frame, 1, frame_id=4)(good_rows())
    assert broken_rules(audit_trace(write_rows(tmp_path / "without.mcap", rows))) == {"frames have their time"}
    jammed = FILES["scenario.yaml"] + b"faults: [{type: jammer, position_m: [1, 1], power_dbm: 0}]\n"
    audit = audit_trace(write_rows(tmp_path / "with.mcap", rows, files={**FILES, "scenario.yaml": jammed}))
    assert audit.findings == []
    assert any("jammer" in tally.note for tally in audit.tallies)


def test_where_corrupted_frames_pass_nothing_is_expected_of_what_they_name(tmp_path: Path) -> None:
    rows = changed(MessageDropped, source=77, message_id=50)(changed(MessageDelivered, size_byte=3)(good_rows()))
    assert len(check_trace(write_rows(tmp_path / "sure.mcap", rows))) == 3
    faults = b"faults: [{type: corruption, share: 0.1, undetected_share: 0.5}]\n"
    files = {**FILES, "scenario.yaml": FILES["scenario.yaml"] + faults}
    assert check_trace(write_rows(tmp_path / "unsure.mcap", rows, files=files)) == []


def test_links_of_moved_nodes_and_links_that_vary_are_not_expected(tmp_path: Path) -> None:
    rows = changed(Frame, rx_node=[2], rx_outcome=[0], rx_rssi_dbm=[-70.0], rx_sinr_db=[9.0])(good_rows())
    moved = with_event(1, NodePositions([3], [99.0], [0.0]))(rows)
    audit = audit_trace(write_rows(tmp_path / "moved.mcap", moved))
    assert audit.findings == []
    assert next(t.note for t in audit.tallies if t.rule == "every listener has an outcome").startswith(
        "without links of 1"
    )
    fading = {**FILES, "scenario.yaml": FILES["scenario.yaml"].replace(b"fading: null", b"fading: {type: rayleigh}")}
    assert check_trace(write_rows(tmp_path / "fading.mcap", rows, files=fading)) == []


def test_a_cell_that_is_not_linear_may_have_less_left_but_not_more(tmp_path: Path) -> None:
    table = FILES["scenario.yaml"].replace(
        b"battery: {type: capacity, energy_j: 10.0}", b"battery: {type: device, device: aa_pair_peukert}"
    )
    files = {**FILES, "scenario.yaml": table}
    less = changed(NodeEnergy, 1, left_j=[9.0, 10.0, float("inf")])(good_rows())
    more = changed(NodeEnergy, 1, left_j=[9.6, 10.0, float("inf")])(good_rows())
    assert check_trace(write_rows(tmp_path / "less.mcap", less, files=files)) == []
    assert [each.rule for each in check_trace(write_rows(tmp_path / "more.mcap", more, files=files))] == [
        "batteries close"
    ]


def test_a_summary_has_the_addressee_only(tmp_path: Path) -> None:
    summary, files = {**METADATA, "detail": "summary"}, {**FILES}
    files["scenario.yaml"] = files["scenario.yaml"].replace(b"detail: full", b"detail: summary")
    rows = good_rows()
    assert broken_rules(audit_trace(write_rows(tmp_path / "t.mcap", rows, summary, files))) == {
        "one outcome a listener"
    }
    empty = {"rx_node": [], "rx_outcome": [], "rx_rssi_dbm": [], "rx_sinr_db": []}
    one = {"rx_node": [2], "rx_outcome": [0], "rx_rssi_dbm": [-70.0], "rx_sinr_db": [9.0]}
    rows = changed(Frame, 1, **empty)(changed(Frame, 0, **one)(rows))
    assert check_trace(write_rows(tmp_path / "good.mcap", rows, summary, files)) == []
    rows = changed(Frame, 0, **empty)(rows)
    assert "every listener has an outcome" in broken_rules(
        audit_trace(write_rows(tmp_path / "bad.mcap", rows, summary, files))
    )


def test_time_that_goes_back_is_found(tmp_path: Path) -> None:
    path = tmp_path / "trace.mcap"
    rows = good_rows()
    with mock.patch("netsim.trace.writer.TraceWriter.write", _write_unchecked):
        write_rows(path, [*rows[:-3], (12 * MS, Log(0, 0, 2, "late", "", "", 0)), (2 * MS, rows[-4][1]), *rows[-3:]])
    finding = next(each for each in check_trace(path) if each.rule == "time goes on")
    assert (finding.time_ns, finding.what) == (2 * MS, "/log: recorded after an event at 0.012 s")


def _write_unchecked(writer: object, event: object, time_ns: int) -> None:
    """As the writer does, without its guard."""
    from netsim.trace.cdr import encode

    channel = writer._channels[type(event)]  # type: ignore[attr-defined]
    writer._mcap.add_message(channel.id, time_ns, encode(event), time_ns, channel.sequence)  # type: ignore
    channel.sequence += 1


@pytest.mark.parametrize(
    ("files", "what"),
    [
        ({"metrics.json": b"{}"}, "scenario.yaml is missing"),
        ({"scenario.yaml": b"kind: [", "metrics.json": b"{}"}, "scenario.yaml is no scenario"),
        ({**FILES, "metrics.json": b"{"}, "metrics.json is no JSON"),
        ({**FILES, "metrics.json": b"[]"}, "metrics.json: expected an object, got list"),
        ({"scenario.yaml": FILES["scenario.yaml"]}, "metrics.json is missing"),
        ({**FILES, "scenario.yaml": FILES["scenario.yaml"].replace(b"seed: 7", b"seed: 8")}, "says seed 8"),
    ],
)
def test_attachments_are_read(files: dict[str, bytes], what: str, tmp_path: Path) -> None:
    findings = check_trace(write_rows(tmp_path / "trace.mcap", good_rows(), files=files))
    assert any(each.rule == "attachments are readable" and what in each.what for each in findings)


def test_a_trace_cut_short_is_checked_as_far_as_it_goes(tmp_path: Path) -> None:
    rows = good_rows()
    with mock.patch("netsim.trace.writer._CHUNK_SIZE_BYTE", 1):
        path = write_rows(tmp_path / "trace.mcap", changed(Frame, rx_outcome=[0, 0])(rows))
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: summary.chunk_indexes[20].chunk_start_offset + 50])
    audit = audit_trace(cut)
    assert broken_rules(audit) == {"the file is whole", "one outcome a listener"}
    assert not audit.end.is_whole
    assert audit.fingerprint is None
    assert audit.tallies[0].looked == 20


def test_damage_is_a_finding_with_its_instant(tmp_path: Path) -> None:
    with mock.patch("netsim.trace.writer._CHUNK_SIZE_BYTE", 1):
        path = write_rows(tmp_path / "trace.mcap", good_rows())
    data = bytearray(path.read_bytes())
    data[data.index(b"channel_busy")] ^= 1
    path.write_bytes(data)
    first = check_trace(path)[0]
    assert first.rule == "the file is whole"
    assert "checksum" in first.what or "damaged" in first.what


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(position=st.floats(0, 1), flip=st.integers(1, 255))
def test_damage_anywhere_gives_findings_or_a_trace_error(tmp_path: Path, position: float, flip: int) -> None:
    path = tmp_path / "trace.mcap"
    if not path.exists():
        write_rows(path, good_rows())
    data = bytearray(path.read_bytes())
    data[int(position * (len(data) - 1))] ^= flip
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    with suppress(TraceError):
        assert all(str(each) for each in check_trace(damaged))


def test_a_wrong_length_is_damage_though_the_file_has_its_end(tmp_path: Path) -> None:
    path = write_rows(tmp_path / "trace.mcap", good_rows())
    data = bytearray(path.read_bytes())
    at = data.index(b"metrics.json") - 28  # the record of an attachment: opcode, length, two times, length of its name
    assert data[at - 1] == Opcode.ATTACHMENT
    data[at + 7] ^= 1
    path.write_bytes(data)
    audit = audit_trace(path)
    assert "a record has a wrong length" in audit.findings[0].what
    assert audit.fingerprint is None
    with pytest.raises(TraceError, match="a record has a wrong length"):
        fingerprint(path)


def test_what_is_no_trace_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "other.mcap").write_bytes(b"no trace at all")
    with pytest.raises(TraceError, match="not an MCAP file"):
        check_trace(tmp_path / "other.mcap")


def test_findings_are_bounded_and_counted(tmp_path: Path) -> None:
    rows = [*good_rows(), *[(21 * MS + n, Log(0, 0, 9, "x", "", "", 0)) for n in range(3 * MOST_KEPT)]]
    findings = [
        each for each in check_trace(write_rows(tmp_path / "t.mcap", rows)) if each.rule == "values are in range"
    ]
    assert len(findings) == MOST_KEPT + 1
    assert findings[-1].what == f"and {2 * MOST_KEPT} more"


def test_marks_are_a_set_of_pairs() -> None:
    rng = np.random.default_rng(4)
    nodes = [3, 5, 8, 13, 21, 34, 55, 89, 144, 233]
    marks, known = Marks(nodes), set()
    for size in range(1, 60):
        marks.grow(size)
        for _ in range(5):
            pair = (int(rng.integers(size)), nodes[rng.integers(len(nodes))])
            assert marks.mark(*pair) == (pair in known)
            known.add(pair)
        if size % 20 == 0:
            marks.clear(13)
            known = {(row, node) for row, node in known if node != 13}
    assert {(row, node) for row in range(60) for node in nodes if marks.has(row, node)} == known
    assert not marks.has(0, 999)
    assert not marks.mark(10**6, 3)
