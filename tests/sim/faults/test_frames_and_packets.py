"""What rules do to single frames, packets and readings."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.rng import Streams
from netsim.sim.clock import Clock
from netsim.sim.faults.announce import Announcer, Span
from netsim.sim.faults.chance import KeyedUniforms, Means
from netsim.sim.faults.frames import Bursts, Corruption, CutLinks, CutNodes, FrameFault, FrameFaults, Partition
from netsim.sim.faults.packets import Garbled, Late, PacketFault, PacketFaults, Repeated, undetected
from netsim.sim.faults.sensors import Biased, Dead, Noisy, SensorFault, Stuck, faulty
from netsim.sim.frames import LinkFrame
from netsim.trace.events import BROADCAST, OUTCOME_CODE, Fault
from netsim.trace.recorder import Recorder

MS = 1_000_000
HOUR_NS = 3600 * 1_000_000_000
NODES = np.arange(1, 6)


@pytest.fixture
def said():
    return []


@pytest.fixture
def announcer(said):
    class Notes:
        def handlers(self):
            return {Fault: lambda event, _: said.append(event)}

    return Announcer(Clock(), Recorder(lambda: 0, [Notes()]), 3, "test")


def frame(source=0, destination=BROADCAST):
    return LinkFrame(source, destination, 0, False, False, b"data", "k", 1)


def lost(befalls, announcer, source=0, span=Span(0, None), now_ns=5, destination=BROADCAST):  # noqa: B008
    """Listeners that lose a frame."""
    faults = FrameFaults([FrameFault("outage", befalls, announcer, span)])
    codes = faults.verdicts(source, NODES, frame(source, destination), now_ns)
    assert set(codes.tolist()) <= {-1, OUTCOME_CODE["outage"]}
    return set(NODES[codes >= 0].tolist())


def test_cuts(announcer):
    links = CutLinks({(0, 1), (0, 3), (2, 1)})
    assert [lost(links, announcer, source) for source in (0, 1, 2)] == [{1, 3}, set(), {1}]
    nodes = CutNodes({2, 4})
    assert [lost(nodes, announcer, source) for source in (0, 2)] == [{2, 4}, {1, 2, 3, 4, 5}]
    parts = Partition({0: 1, 1: 1, 3: 2})
    assert [lost(parts, announcer, source) for source in (0, 3, 2)] == [{2, 3, 4, 5}, {1, 2, 4, 5}, {1, 3}]


def test_spans_are_half_open(announcer):
    cut = CutNodes({1})
    assert [bool(lost(cut, announcer, span=Span(5, 7), now_ns=now_ns)) for now_ns in (4, 5, 6, 7)] == [
        False,
        True,
        True,
        False,
    ]


def test_only_frames_for_those_who_lose_them_are_said(announcer, said):
    assert lost(CutNodes({1, 2}), announcer, destination=2) == {1, 2}
    assert lost(CutNodes({1, 2}), announcer, destination=3) == {1, 2}
    assert [(event.rule, event.kind, event.event, event.node) for event in said] == [(3, "test", "strikes", [2])]


def test_the_first_rule_that_strikes_names_the_outcome(announcer):
    cut = FrameFault("outage", CutNodes({1}), announcer)
    wrong = FrameFault("corrupted", Corruption(KeyedUniforms(Streams(1), "c"), 1.0), announcer)
    faults = FrameFaults([cut, wrong])
    assert [faults.verdict(0, node, frame(), 1) for node in (1, 2)] == ["outage", "corrupted"]
    assert FrameFaults([cut]).verdict(0, 2, frame(), 1) is None


@given(st.permutations(range(12)))
def test_neither_order_nor_company_of_questions_matters(order):
    """Each (frame, listener) has its own luck: asked one by one or together, in any order."""

    def rules():
        silent = Announcer(Clock(), Recorder(lambda: 0, []), 0, "test")
        streams = Streams(1)
        bursts = Bursts(streams, "b", Means(0.01, 0.01), (0.1, 0.8))
        corruption = Corruption(KeyedUniforms(streams, "c"), 0.2)
        return FrameFaults([FrameFault("lost", bursts, silent), FrameFault("corrupted", corruption, silent)])

    occasions = [(source, time_ns) for time_ns in range(0, 40 * MS, 10 * MS) for source in (0, 6, 7)]
    together = rules()
    codes = {
        (source, time_ns, node): code
        for source, time_ns in occasions
        for node, code in zip(
            NODES.tolist(), together.verdicts(source, NODES, frame(source), time_ns).tolist(), strict=True
        )
    }
    alone = rules()
    for source, time_ns in sorted((occasions[place] for place in order), key=lambda occasion: occasion[1]):
        for node in NODES[::-1].tolist():
            code = alone.verdicts(source, np.array([node]), frame(source), time_ns)[0]
            assert code == codes[source, time_ns, node]


def test_corruption_takes_its_share(announcer):
    corruption = Corruption(KeyedUniforms(Streams(1), "c"), 0.1, {1, 2, 3})
    struck = np.array([corruption.struck(0, NODES, time_ns) for time_ns in range(4000)]).mean(axis=0)
    assert (abs(struck[:3] - 0.1) < 4 * math.sqrt(0.09 / 4000)).all()
    assert (struck[3:] == 0).all()
    assert undetected(0.5, 0.0) == 0.0
    assert 0.3 * 0.9 + (1 - 0.3 * 0.9) * undetected(0.3, 0.1) == pytest.approx(0.3)
    assert undetected(1.0, 0.0) == 0.0


def test_bursts_lose_at_the_rate_of_their_states():
    """Losses are those of the states: 20 % of the time bad with 0.9, else 0.1, so 26 %, over 200 links at one instant."""
    bursts = Bursts(Streams(1), "b", Means(4.0, 1.0), (0.1, 0.9), {(a, b) for a in range(80) for b in range(1, 6)})
    struck = [bursts.struck(source, NODES, 10 * MS) for source in range(160)]
    assert abs(np.mean(struck[:80]) - 0.26) < 4 * math.sqrt(0.26 * 0.74 / 400)
    assert not np.any(struck[80:])


# --- packets --------------------------------------------------------------------------------------------------------


def through(change, announcer, span=Span(0, None), node=1):  # noqa: B008
    return PacketFaults(node, [PacketFault(change, announcer, span, "test")], lambda: 7)


def test_packets_come_twice_late_or_wrong(announcer, said):
    uniforms = KeyedUniforms(Streams(1), "p")
    assert through(Repeated(uniforms, 1.0, 0.0), announcer)(b"abc", 2) == [(0, b"abc"), (0, b"abc")]
    ((delay_ns, data),) = through(Late(uniforms, 1.0, 0.5), announcer)(b"abc", 2)
    assert (delay_ns > 0, data) == (True, b"abc")
    ((_, wrong),) = through(Garbled(uniforms, 1.0), announcer)(bytes(50), 2)
    assert len(wrong) == 50
    assert 1 <= sum(byte.bit_count() for byte in wrong) <= 8
    assert len(said) == 3
    assert through(Late(uniforms, 1.0, 0.5), announcer, Span(8, None))(b"abc", 2) == [(0, b"abc")]
    assert through(Late(uniforms, 0.0, 0.5), announcer)(b"abc", 2) == [(0, b"abc")]


def test_packet_rules_apply_one_after_the_other(announcer):
    uniforms = KeyedUniforms(Streams(1), "p")
    rules = [PacketFault(Repeated(uniforms, 1.0, 0.1), announcer, Span(0, None), "")] * 2
    copies = PacketFaults(1, rules, lambda: 7)(b"abc", 2)
    assert len(copies) == 4
    assert copies[0] == (0, b"abc")


# --- sensors --------------------------------------------------------------------------------------------------------


class World:
    """A sensor whose readings are two positions that move a metre a reading, at times that are set."""

    def __init__(self, change, announcer, span):
        self.now_ns = 0
        self.count = 0
        self.view = faulty(4, self.observe, [SensorFault(change, announcer, span)], lambda: self.now_ns)

    def observe(self):
        self.count += 1
        return np.array([[self.count, 0.0], [self.count, 5.0]])

    def at(self, now_ns):
        self.now_ns = now_ns
        return self.view()


def test_bias_and_drift(announcer, said):
    world = World(Biased(2.0, 1.0, HOUR_NS), announcer, Span(HOUR_NS, 4 * HOUR_NS))
    assert world.at(0)[0, 0] == 1.0
    assert world.at(HOUR_NS)[0, 0] == 4.0
    assert world.at(3 * HOUR_NS)[1].tolist() == [3.0 + 2.0 + 2.0, 5.0 + 4.0]
    assert world.at(4 * HOUR_NS)[0, 0] == 4.0
    assert [event.node for event in said] == [[4], [4]]


def test_stuck_repeats_the_last_reading_from_before(announcer):
    world = World(Stuck(), announcer, Span(10, 20))
    assert [world.at(now_ns)[0, 0] for now_ns in (0, 5, 10, 15, 19, 20)] == [1, 2, 2, 2, 2, 6]
    world = World(Stuck(), announcer, Span(0, None))
    assert [world.at(now_ns)[0, 0] for now_ns in (0, 5)] == [1, 1]


def test_what_a_node_does_to_a_stuck_reading_does_not_show_in_the_next(announcer):
    world = World(Stuck(), announcer, Span(0, None))
    world.at(0)[:] = 99.0
    assert world.at(1)[0, 0] == 1.0


def test_noise_and_death(announcer):
    world = World(Noisy(Streams(1), "n", 0.5), announcer, Span(0, None))
    off = np.array([world.at(time_ns)[1, 1] - 5.0 for time_ns in range(400)])
    assert abs(off.std() - 0.5) < 4 * 0.5 / math.sqrt(800)
    assert world.at(7)[1, 1] == world.at(7)[1, 1]
    assert World(Dead(), announcer, Span(0, None)).at(0).shape == (0, 2)
    assert faulty(1, world.observe, [], lambda: 0) == world.observe
