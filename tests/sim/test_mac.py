"""CSMA-CA with acknowledgements: what its jobs come to."""

from dataclasses import replace

import pytest
from sim_rig import MS, NOISE_DBM, US, Draws, Rig, airtime_ns, mesh, outcomes_of, sinr_medium, sorted_frames

from netsim.api import BROADCAST
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.mac.ideal import IdealMac
from netsim.sim.mac.link import LinkJob

NEARLY_ONE = 1.0 - 1e-9


class Deafening:
    """A medium whose channel is never clear."""

    def __init__(self, medium):
        self.join, self.begin, self.stopped_listening = medium.join, medium.begin, medium.stopped_listening
        self.listening, self.settle = medium.listening, medium.settle

    def is_busy(self, node, *how):
        return True


def starts_us(rig, source):
    return [frame.t_start_ns / US for frame in sorted_frames(rig.frames) if frame.source == source]


def test_a_lost_acknowledgement_costs_a_retry_but_delivers_once():
    """Node 0 does not hear node 1: it sends four times, and what it sends arrives once."""
    rig = Rig({(0, 1): -60.0, (1, 2): -60.0}).add_macs()
    fate = rig.submit(0, 0, 1)
    rig.run()
    assert len(starts_us(rig, 0)) == len(starts_us(rig, 1)) == 4
    assert [(node, source) for _, node, source, _ in rig.delivered] == [(1, 0)]
    assert [(delivery.acknowledged, delivery.reason, delivery.attempts) for _, delivery in fate] == [
        (False, "no_ack", 4)
    ]


def test_a_repeat_is_known_however_late_it_comes():
    """Back-offs of up to 255 periods, five times each: the last retry comes more than a second after the first frame."""
    slow = Draws(0.0, *[NEARLY_ONE] * 200)
    rig = Rig({(0, 1): -60.0, (1, 2): -60.0}).add_macs({0: slow}, min_be=8, max_be=8, max_retries=30)
    rig.submit(0, 0, 1)
    rig.run(4000 * MS)
    spread_us = starts_us(rig, 0)
    assert spread_us[-1] - spread_us[0] > 1e6
    assert len(rig.delivered) == 1


def test_a_sequence_number_that_has_come_round_is_not_a_repeat():
    """255 broadcasts lie between two frames of equal number to one neighbour, and little time."""
    rig = Rig(mesh(2)).add_macs(min_be=0, queue_frames=300)
    first = rig.submit(0, 0, 1, b"first")
    for _ in range(255):
        rig.submit(1, 0, BROADCAST, b"")
    second = rig.submit(2, 0, 1, b"second")
    rig.run(1000 * MS)
    assert second[0][0] - first[0][0] < 1000 * MS
    assert [packet for _, _, _, packet in rig.delivered if packet] == [b"first", b"second"]


def test_equal_packets_with_different_numbers_are_both_delivered():
    rig = Rig(mesh(2)).add_macs()
    for _ in range(2):
        rig.submit(0, 0, 1, b"same")
    rig.run()
    assert [packet for _, _, _, packet in rig.delivered] == [b"same", b"same"]


def test_a_busy_channel_is_given_up_after_five_assessments():
    """Exponents 3, 4, 5, 5, 5 with half of their periods: 4 + 8 + 16 + 16 + 16, and five assessments of 128 us."""
    rig = Rig(mesh(2), medium=lambda *wiring: Deafening(sinr_medium(*wiring))).add_macs({0: Draws(0.0, 0.5)})
    fate = rig.submit(1 * MS, 0, 1)
    rig.run()
    ((done_ns, delivery),) = fate
    assert done_ns == 1 * MS + (60 * 320 + 5 * 128) * US
    assert (delivery.acknowledged, delivery.reason, delivery.attempts) == (False, "channel_busy", 0)
    assert rig.frames == []


def test_a_full_queue_refuses():
    rig = Rig(mesh(2)).add_macs(queue_frames=2)
    fates = [rig.submit(0, 0, 1) for _ in range(5)]
    rig.run()
    # one is being sent, two wait
    assert [delivery.reason for ((_, delivery),) in fates] == ["", "", "", "queue_full", "queue_full"]
    assert [done_ns for ((done_ns, _),) in fates][3:] == [0, 0]


def test_broadcasts_are_sent_once_and_not_acknowledged():
    rig = Rig(mesh(3)).add_macs()
    fate = rig.submit(0, 0, BROADCAST)
    rig.run()
    assert len(rig.frames) == 1
    assert sorted(node for _, node, _, _ in rig.delivered) == [1, 2]
    assert [(time_ns, delivery.acknowledged, delivery.attempts) for time_ns, delivery in fate] == [
        (320 * US + airtime_ns(50), True, 1)
    ]


def test_without_acknowledgement_a_lost_frame_is_lost():
    rig = Rig({(0, 1): NOISE_DBM - 3.0}, luck=NEARLY_ONE).add_macs(acknowledge=False)
    fate = rig.submit(0, 0, 1)
    rig.run()
    assert rig.outcomes() == [{1: "weak"}]
    assert rig.delivered == []
    assert fate[0][1].acknowledged


@pytest.mark.parametrize("destination", [1, BROADCAST])
def test_the_radio_sleeps_after_the_last_job_and_wakes_for_the_next(destination):
    rig = Rig(mesh(2)).add_macs()
    rig.submit(0, 0, destination)
    rig.at(0, rig.stations[0].mac.sleep)
    fate = rig.submit(50 * MS, 0, destination)
    rig.run()
    assert rig.stations[0].radio.state == "sleep"
    assert fate[0][1].acknowledged
    booked = rig.stations[0].ledger_uj()
    assert booked["sleep", ""][1] > 85_000
    assert booked["wake", ""] == (pytest.approx(0.86 * 1.278 + 0.192 * 56.4), 1052)


def test_the_radio_sleeps_after_an_acknowledgement_it_owed():
    rig = Rig(mesh(2)).add_macs()
    rig.submit(0, 0, 1)
    rig.at(320 * US + airtime_ns(50) + 100 * US, rig.stations[1].mac.sleep)
    rig.run()
    assert rig.stations[1].radio.state == "sleep"
    assert len(starts_us(rig, 1)) == 1


def ideal(delay_ns=0, loss=0.0):
    def make(clock, paths, log):
        lossy = {source: [replace(link, prr=1.0 - loss) for link in links] for source, links in paths.items()}
        return IdealMedium(clock, lossy, delay_ns, log)

    return make


@pytest.mark.parametrize("gap_us", [0, 100, 192, 500, 1500, 1792, 1900, 2100])
def test_nodes_that_speak_across_each_other_over_the_ideal_medium_do_not_hang(gap_us):
    """It delivers to a node that is itself sending, which cannot acknowledge just then: the sender tries again."""
    rig = Rig(mesh(2), medium=ideal()).add_macs({node: Draws(0.0, 0.0, 0.3 + 0.4 * node) for node in range(2)})
    fates = [rig.submit(0, 0, 1), rig.submit(gap_us * US, 1, 0)]
    rig.run(1000 * MS)
    assert [[delivery.acknowledged for _, delivery in fate] for fate in fates] == [[True], [True]]
    assert sorted((node, source) for _, node, source, _ in rig.delivered) == [(0, 1), (1, 0)]


def test_the_ideal_mac_sends_one_after_the_other_and_sleeps():
    rig = Rig(mesh(2), medium=ideal(delay_ns=5 * US))
    mac = IdealMac(rig.stations[0].radio, lambda packet, source: None)
    IdealMac(rig.stations[1].radio, lambda packet, source: rig.delivered.append((rig.clock.now_ns, packet)))
    done = []
    for packet in (b"a", b"b"):
        mac.submit(LinkJob(1, packet, "k", 1, lambda delivery: done.append((rig.clock.now_ns, delivery.acknowledged))))
    mac.sleep()
    rig.run()
    cycle_ns = 192 * US + airtime_ns(12)
    assert done == [(cycle_ns, True), (2 * cycle_ns, True)]
    assert rig.delivered == [(cycle_ns + 5 * US, b"a"), (2 * cycle_ns + 5 * US, b"b")]
    assert rig.stations[0].radio.state == "sleep"
    assert mac.pending == 0


def test_the_ideal_medium_loses_its_share():
    rig = Rig(mesh(2), medium=ideal(loss=0.25), luck=0.2)
    rig.on_air(1 * MS, 0)
    rig.on_air(1 * MS, 1)
    assert rig.run().outcomes() == [{1: "lost"}, {0: "lost"}]
    rig = Rig(mesh(2), medium=ideal(loss=0.25), luck=0.25)
    rig.on_air(1 * MS, 0)
    assert rig.run().outcomes() == [{1: "received"}]


# --- the blind window of clear channel assessment ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gap_us", "collides"),
    [(0, True), (1, True), (191, True), (192, True), (193, False), (320, False)],
)
def test_two_senders_collide_within_the_turnaround_and_not_outside_it(gap_us, collides):
    """Node 0's frame is on the air 192 us after its assessment has ended: until then nobody can know.

    An assessment that ends up to 191 us later looks at an empty channel. One that ends 192 us later ends at the instant at
    which the frame begins: its eight symbols lie before it, so it is blind too. One that ends 193 us later has seen a
    microsecond of it. Node 1 is 10 dB stronger at the listener, so that where both are on the air node 0 is lost.
    """
    rig = Rig(mesh(3) | {(1, 2): -50.0}, luck=0.5)
    rig.add_macs({0: Draws(0.0), 1: Draws(0.0, 0.0, 0.99)})
    rig.submit(0, 0, BROADCAST)
    rig.submit(gap_us * US, 1, BROADCAST)
    rig.run(20 * MS)
    first, second = (outcomes[2] for outcomes in rig.outcomes())
    assert (first in ("collided", "busy")) is collides
    assert (first, second) == ("received", "received") if not collides else second in ("busy", "received")
    starts = [frame.t_start_ns / US for frame in sorted_frames(rig.frames)]
    assert (starts[1] - starts[0] == gap_us) is collides


# --- settings ---------------------------------------------------------------------------------------------------------


def test_other_times_can_be_set():
    """Unit back-off 10 symbols, assessment 4, rest 0; half of 8 periods, twice."""
    rig = Rig(mesh(2)).add_macs({0: Draws(0.0, 0.5)}, unit_backoff_symbols=10, cca_symbols=4, lifs_symbols=0)
    for _ in range(2):
        rig.submit(0, 0, BROADCAST)
    rig.run()
    cycle_us = 4 * 160 + 64 + 192
    assert starts_us(rig, 0) == [cycle_us, cycle_us + 1792 + cycle_us]


def test_the_wait_for_an_acknowledgement_can_be_set():
    """INET's 560 us, 35 symbols."""
    rig = Rig({(0, 1): -60.0}).add_macs(ack_wait_symbols=35, max_retries=1)
    rig.submit(0, 0, 1)
    rig.run()
    first, second = starts_us(rig, 0)
    assert second - first == 1792 + 640 + 128 + 192  # the spacing is longer than the wait
    assert first == 320


@pytest.mark.parametrize(
    ("mode", "power_dbm", "busy"),
    [
        ("energy", -60.0, True),
        ("energy", -90.0, False),
        ("carrier", -90.0, True),
        ("either", -90.0, True),
        ("either", -101.0, False),
    ],
)
def test_what_makes_a_channel_busy_can_be_chosen(mode, power_dbm, busy):
    """The CC2420's threshold is -77 dBm; a frame of -101 dBm is not caught."""
    rig = Rig({(0, 1): power_dbm, (1, 0): power_dbm})
    rig.add_macs(cca_mode=mode)
    rig.on_air(1 * MS, 0, psdu_byte=127)
    fate = rig.submit(2 * MS, 1, BROADCAST)
    rig.run()
    assert (fate[0][1].reason == "channel_busy") is busy  # five assessments within 0.7 ms


def test_energy_without_a_carrier_is_no_carrier():
    """The listener wakes within the frame: it hears energy, but has caught no preamble."""
    for mode, busy in (("carrier", False), ("energy", True), ("either", True)):
        rig = Rig(mesh(2))
        rig.stations[1].radio.sleep()
        rig.on_air(1 * MS, 0, psdu_byte=127)
        rig.at(1 * MS, rig.stations[1].radio.wake)
        rig.run(3 * MS)
        assert rig.medium.is_busy(1, None, mode) is busy


def test_somebody_elses_acknowledgement_of_the_same_number_is_taken_for_ones_own():
    """It has no address on the air. Node 0's frame to the absent node 9 is "acknowledged" by what node 3 sends to node 2.

    Nodes 2 and 3 do not hear node 0, which hears node 3 only.
    """
    links = {(0, 9): -120.0, (2, 3): -60.0, (3, 2): -60.0, (3, 0): -60.0}
    for number, believes in ((0.0, True), (0.25, False)):
        rig = Rig(links).add_macs({0: Draws(number, 0.0), 2: Draws(0.0)}, max_retries=0)
        fate = rig.submit(0, 0, 9)
        rig.submit(300 * US, 2, 3)
        rig.run()
        assert fate[0][1].acknowledged is believes
    ack = next(frame for frame in rig.frames if frame.is_ack)
    assert outcomes_of(ack) == {0: "overheard", 2: "received"}
