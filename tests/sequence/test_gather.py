"""From a trace to what a chart shows: the exactly known rows of a hand-made talk."""

import math
from pathlib import Path

import pytest
from short_talk import NAMES, TALK, TX_W, A, B, C, frame, ms, sent, tables, write

from netsim.errors import ScenarioError
from netsim.sequence import Asked
from netsim.sequence.gather import gather
from netsim.sequence.links import Link, cause_links
from netsim.sequence.plan import node_order
from netsim.sequence.records import Exchange
from netsim.sequence.states import RoleSpan, announced, roles
from netsim.trace.events import BROADCAST, RADIO_STATE_CODE, MessageDelivered, NodeLife, NodePositions, RadioState


@pytest.fixture(scope="module")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("talk") / "talk.mcap")


def told(exchange: Exchange) -> list[tuple]:
    return [
        (
            each.frame_id,
            each.start_ns,
            each.end_ns,
            each.source,
            each.role,
            [(arm.node, arm.outcome) for arm in each.arms],
        )
        for each in exchange.transmissions
    ]


def test_every_frame_has_its_arrows(talk: Path) -> None:
    assert told(gather(talk, Asked())) == [
        (1, ms(1001), ms(1003), A, "data", [(B, "received")]),
        (2, ms(1003.2), ms(1003.6), B, "ack", [(A, "received")]),
        (3, ms(1005), ms(1007), B, "data", [(A, "received"), (C, "half_duplex")]),
        (4, ms(1005.5), ms(1007.5), C, "data", [(B, "half_duplex")]),
        (5, ms(3000), ms(3002), C, "retry", [(B, "collided")]),
    ]


def test_the_chart_knows_names_kinds_energy_and_the_order_of_talk(talk: Path) -> None:
    exchange = gather(talk, Asked())
    assert (exchange.title, dict(exchange.names), exchange.kinds) == ("talk <&> more", NAMES, ["ask", "tell"])
    assert node_order(exchange) == [A, B, C]
    spent = [each.spent_j for each in exchange.transmissions]
    assert spent[0] == pytest.approx(TX_W * 0.002)
    assert spent[1] is None  # the ledger tells nothing of acknowledgements
    heard = [(span.node, span.state) for span in exchange.transmissions[0].heard]
    assert heard == [(B, "receive"), (C, "overhear")]


def test_causes_link_receptions_to_sendings(talk: Path) -> None:
    assert cause_links(gather(talk, Asked())) == [Link(B, ms(1003), ms(1005), 1, 2)]


def test_a_message_that_is_passed_on_is_linked_at_every_hop(tmp_path: Path) -> None:
    rows = [
        *tables(),
        sent(1, 10, A, C, "ask", []),
        frame(1, 11, 12, A, B, {B: "received"}, message=1),
        frame(2, 14, 15, B, C, {C: "received"}, message=1),
        (ms(15), MessageDelivered(1, A, C, "ask", 24, 2, ms(5))),
        sent(2, 16, C, A, "tell", [1, 1]),
        frame(3, 17, 18, C, A, {A: "received"}, message=2, kind="tell"),
    ]
    exchange = gather(write(tmp_path / "hops.mcap", rows), Asked())
    assert cause_links(exchange) == [Link(B, ms(12), ms(14), 1, 1), Link(C, ms(15), ms(17), 1, 2)]


def test_losses_of_broadcasts_are_expected_of_links_that_are_still_known_only(tmp_path: Path) -> None:
    rows = [
        *tables(),
        frame(1, 5, 7, A, BROADCAST, {B: "received", C: "weak"}, message=0),
        (ms(8), NodePositions([C], [500.0], [0.0])),
        frame(2, 9, 11, A, BROADCAST, {B: "received", C: "weak"}, message=0),
    ]
    shown = gather(write(tmp_path / "moved.mcap", rows), Asked()).transmissions
    assert [[arm.node for arm in each.arms] for each in shown] == [[B, C], [B]]


def test_roles_and_deaths(talk: Path) -> None:
    exchange = gather(talk, Asked())
    assert roles(exchange, B, ms(1001), ms(3002)) == [RoleSpan(B, "leader", ms(1003), ms(3002), True)]
    assert roles(exchange, B, ms(2000), ms(4000)) == [RoleSpan(B, "leader", ms(2000), ms(3003), False)]
    assert [(note.event.node, note.event.reason) for note in exchange.lives] == [(C, "battery")]
    assert [note.event.reason for note in exchange.dropped] == ["no_ack"]


def test_a_window_holds_the_frames_that_end_in_it(talk: Path) -> None:
    exchange = gather(talk, Asked(start_ns=ms(1003), end_ns=ms(1007.5)))
    assert [each.frame_id for each in exchange.transmissions] == [1, 2, 3]
    later = gather(talk, Asked(start_ns=ms(2000)))
    assert [each.frame_id for each in later.transmissions] == [5]
    assert later.kinds == exchange.kinds  # colours do not depend on the window
    assert [note.event.role for note in later.roles] == ["leader", "leader"]


def test_filters(talk: Path) -> None:
    assert [row[0] for row in told(gather(talk, Asked(kinds={"tell"})))] == [3]
    assert [row[0] for row in told(gather(talk, Asked(nodes={A})))] == [1, 2, 3]
    assert told(gather(talk, Asked(nodes={A})))[2][-1] == [(A, "received")]
    assert gather(talk, Asked(nodes={A})).dropped == []
    assert len(gather(talk, Asked(nodes={B})).dropped) == 1


def test_an_addressee_that_no_medium_decided_about_is_out_of_reach(tmp_path: Path) -> None:
    rows = [*tables(), frame(1, 1, 2, A, C, {B: "overheard"}, message=1)]
    (only,) = gather(write(tmp_path / "far.mcap", rows), Asked()).transmissions
    assert [(arm.node, arm.outcome) for arm in only.arms] == [(C, "out_of_reach")]
    assert math.isnan(only.arms[0].rssi_dbm)


def test_wake_up_frames_are_trains(tmp_path: Path) -> None:
    strobes = [
        frame(1 + place, 10 + 2 * place, 11 + 2 * place, A, B, {B: outcome, C: "asleep"}, message=1, is_strobe=True)
        for place, outcome in enumerate(("asleep", "asleep", "received", "asleep"))
    ]
    other = frame(9, 20, 21, C, B, {B: "received"}, message=2)
    again = frame(10, 22, 23, A, B, {B: "asleep"}, message=1, is_strobe=True)
    exchange = gather(write(tmp_path / "train.mcap", [*tables(), *strobes, other, again]), Asked())
    assert [(each.count, each.airtime_ns, each.arms[0].outcome) for each in exchange.transmissions] == [
        (4, ms(4), "received"),
        (1, ms(1), "received"),
        (1, ms(1), "asleep"),
    ]
    train = exchange.transmissions[0]
    assert (train.start_ns, train.end_ns) == (ms(10), ms(17))
    assert [(span.start_ns, span.end_ns) for span in train.heard] == [(ms(14), ms(15))]


def test_parts_of_a_message_are_numbered_and_tries_are_not_parts(tmp_path: Path) -> None:
    rows = [
        *tables(),
        sent(1, 1, A, B, "ask", [], fragments=2),
        frame(1, 2, 3, A, B, {B: "received"}, message=1),
        frame(2, 4, 5, A, B, {B: "weak"}, message=1),
        frame(3, 6, 7, A, B, {B: "received"}, message=1, attempt=1),
    ]
    exchange = gather(write(tmp_path / "parts.mcap", rows), Asked())
    assert [each.part for each in exchange.transmissions] == [1, 2, 2]


def test_a_crash_prevails_over_what_the_radio_says_at_that_instant_and_a_reboot_yields(tmp_path: Path) -> None:
    rows = [
        *tables(),
        (ms(2), NodeLife(B, "crashed", "fault rule")),
        (ms(2), RadioState(B, RADIO_STATE_CODE["off"])),
        (ms(5), NodeLife(B, "rebooted", "Talk")),
        (ms(5), RadioState(B, RADIO_STATE_CODE["sleep"])),
        frame(1, 8, 9, A, B, {B: "asleep"}, message=1),
    ]
    exchange = gather(write(tmp_path / "crash.mcap", rows), Asked())
    states = [(span.state, span.start_ns, span.end_ns) for span in announced(exchange, B, 0, ms(9))]
    assert states == [("listen", 0, ms(2)), ("crashed", ms(2), ms(5)), ("sleep", ms(5), ms(9))]


@pytest.mark.parametrize(("full", "then"), [(False, "listen"), (True, "switch")])
def test_where_only_waking_is_announced_the_radio_listens_from_then_on(tmp_path: Path, full: bool, then: str) -> None:
    radio = [(4, "sleep"), (6, "switch")] + ([(7, "receive")] if full else [])
    changes = [(ms(at), RadioState(B, RADIO_STATE_CODE[state])) for at, state in radio]
    rows = [*tables(), *changes, frame(1, 8, 9, A, B, {B: "received"}, message=1)]
    exchange = gather(write(tmp_path / "radio.mcap", rows), Asked())
    states = [(span.state, span.start_ns, span.end_ns) for span in announced(exchange, B, ms(3), ms(6.5))]
    assert states == [("listen", ms(3), ms(4)), ("sleep", ms(4), ms(6)), (then, ms(6), ms(6.5))]
    later = gather(tmp_path / "radio.mcap", Asked(start_ns=ms(6.5)))
    assert announced(later, B, ms(6.5), ms(7))[0].state == then


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (Asked(limit=4), "at most 4 frames in a chart, got 5 from 0 to 5 s; narrow the window (--end 3.002 would do)"),
        (
            Asked(start_ns=ms(1500), end_ns=ms(2500)),
            "nothing was on the air from 1.5 to 2.5 s; the next frame ends at 3.002 s",
        ),
        (Asked(start_ns=ms(3500)), "nothing was on the air from 3.5 to 5 s; choose another --start"),
        (Asked(kinds={"yell"}), "--kinds: expected some of ask, tell, sent up to 5 s; got yell"),
        (Asked(start_ns=ms(6000)), "--start: expected a time up to 5 s, where the trace ends, got 6 s"),
        (Asked(start_ns=ms(2000), end_ns=ms(2000)), "--end: expected a time after --start (2 s), got 2 s"),
    ],
)
def test_what_cannot_be_drawn_is_refused_with_a_remedy(talk: Path, asked: Asked, words: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        gather(talk, asked)
    assert words in str(refused.value)


def test_the_end_that_a_refusal_proposes_will_do(talk: Path) -> None:
    assert len(gather(talk, Asked(limit=4, end_ns=ms(3002))).transmissions) == 4


def test_the_talk_is_in_order() -> None:
    assert [time_ns for time_ns, _ in TALK] == sorted(time_ns for time_ns, _ in TALK)
