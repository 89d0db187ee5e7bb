"""The shared air: who hears what, and why not."""

import math

import numpy as np
import pytest
from scipy.stats import binom
from sim_rig import MS, NOISE_DBM, US, Draws, Rig, airtime_ns, mesh, outcomes_of, sorted_frames

from netsim.models.reception import frame_success_probability, oqpsk_bit_error_rate
from netsim.rng import Streams
from netsim.units import dbm_to_mw, mw_to_dbm

AIR_NS = airtime_ns(50)
PREAMBLE_NS = 5 * 32 * US  # four bytes of preamble, one of start-of-frame delimiter
BITS_PER_NS = 250e3 / 1e9


def snr(power_dbm, *interferers_dbm):
    """Linear signal to interference and noise ratio."""
    return dbm_to_mw(power_dbm) / (dbm_to_mw(NOISE_DBM) + sum(map(dbm_to_mw, interferers_dbm)))


# --- what can happen to a frame -------------------------------------------------------------------------------------


def test_a_frame_is_received_overheard_and_by_the_far_not_heard_at_all():
    rig = Rig({(0, 1): -60.0, (0, 2): -60.0, (0, 3): -101.0})
    rig.on_air(1 * MS, 0, destination=1)
    rig.run()
    assert rig.outcomes() == [{1: "received", 2: "overheard"}]
    (frame,) = rig.frames
    assert frame.rx_rssi_dbm == pytest.approx([-60.0, -60.0])
    assert frame.rx_sinr_db == pytest.approx([35.0, 35.0])
    assert rig.received == [(1 * MS + AIR_NS, 1, 0)]  # the address filter of the radio keeps the other out


def test_hidden_terminals_collide_at_the_node_between():
    rig = Rig({(0, 1): -60.0, (1, 0): -60.0, (2, 1): -55.0, (1, 2): -55.0}, luck=0.5)
    rig.on_air(1 * MS, 0)
    rig.on_air(1 * MS + 300 * US, 2)
    rig.run()
    assert rig.outcomes() == [{1: "collided"}, {1: "busy"}]
    assert rig.received == []


def test_hidden_terminals_do_not_hear_each_other_assess():
    rig = Rig({(0, 1): -60.0, (1, 0): -60.0, (2, 1): -60.0, (1, 2): -60.0}).add_macs({0: Draws(0.0), 2: Draws(0.0)})
    rig.submit(0, 0, 1)
    rig.submit(1 * MS, 2, 1)
    rig.run(2 * MS)
    assert [rig.medium.is_busy(node) for node in (0, 1, 2)] == [False, True, False]
    rig.run(10 * MS)
    assert [frame.t_start_ns / US for frame in sorted_frames(rig.frames)][:2] == [320, 1320]
    assert rig.outcomes(2)[0] == {1: "busy"}


def test_a_weak_frame_is_lost_to_noise_and_a_strong_one_to_interference():
    weak = Rig({(0, 1): NOISE_DBM - 3.0}, luck=0.999)
    weak.on_air(1 * MS, 0)
    assert weak.run().outcomes() == [{1: "weak"}]
    # the same weak frame under interference would have been lost anyway
    both = Rig({(0, 1): NOISE_DBM - 3.0, (2, 1): NOISE_DBM - 4.0}, luck=0.999)
    both.on_air(1 * MS, 0)
    both.on_air(2 * MS, 2)
    assert both.run().outcomes() == [{1: "weak"}, {1: "busy"}]


def test_a_preamble_under_interference_is_not_caught():
    """The listener sleeps through the first frame's start, so that nothing holds its receiver."""

    def rig(strong_dbm, late_dbm):
        rig = Rig({(0, 1): strong_dbm, (2, 1): late_dbm}, luck=0.5)
        rig.stations[1].radio.sleep()
        rig.at(0, rig.stations[1].radio.wake)
        rig.on_air(500 * US, 0)
        rig.on_air(1200 * US, 2)
        return rig.run()

    # without the first frame the second would have had more than an even chance: 15 dB against -10 dB
    assert rig(-70.0, -80.0).outcomes(2) == [{1: "collided"}]
    # at -3 dB it would not: it is noise that loses it
    assert rig(-70.0, NOISE_DBM - 3.0).outcomes(2) == [{1: "weak"}]
    # above the lock ratio it is caught
    assert rig(-80.0, -70.0).outcomes(2) == [{1: "received"}]


def test_a_receiver_is_locked_until_the_end_even_by_a_weaker_frame():
    rig = Rig({(0, 1): -80.0, (2, 1): -60.0})
    rig.on_air(1 * MS, 0)
    rig.on_air(1 * MS + AIR_NS - 1, 2)
    rig.run()
    assert rig.outcomes() == [{1: "received"}, {1: "busy"}]


def test_a_transmitter_is_deaf():
    rig = Rig(mesh(2))
    rig.on_air(1 * MS, 0)
    rig.on_air(1 * MS + 500 * US, 1)
    rig.run()
    # node 1 turns away from what it was receiving in order to send; node 0 is sending when that begins
    assert rig.outcomes() == [{1: "half_duplex"}, {0: "half_duplex"}]


@pytest.mark.parametrize(
    ("start_us", "outcome"),
    [(-1, "half_duplex"), (0, "received"), (1, "received")],
)
def test_after_sending_a_radio_hears_what_begins_when_its_turnaround_is_over(start_us, outcome):
    rig = Rig(mesh(2))
    rig.on_air(1 * MS, 0)
    rig.on_air(1 * MS + AIR_NS + (192 + start_us) * US, 1)
    rig.run()
    assert rig.outcomes(1) == [{0: outcome}]


@pytest.mark.parametrize(("start_us", "outcome"), [(1051, "asleep"), (1052, "received")])
def test_a_sleeping_radio_hears_nothing_until_it_has_woken(start_us, outcome):
    rig = Rig({(0, 1): -60.0})
    rig.at(1 * MS, rig.stations[1].radio.sleep)
    rig.on_air(2 * MS, 0)
    rig.at(10 * MS, rig.stations[1].radio.wake)
    rig.on_air(10 * MS + start_us * US, 0)
    rig.run()
    assert rig.outcomes() == [{1: "asleep"}, {1: outcome}]


def test_falling_asleep_ends_a_reception():
    rig = Rig({(0, 1): -60.0})
    rig.on_air(1 * MS, 0)
    rig.at(2 * MS, rig.stations[1].radio.sleep)
    assert rig.run().outcomes() == [{1: "asleep"}]


# --- death ----------------------------------------------------------------------------------------------------------


def dying(node, death_ns):
    """Capacity with which a listening node dies at a time."""
    return {node: 56.4 * death_ns * 1e-12}


def test_a_dead_listener_hears_nothing_from_its_last_nanosecond_on():
    for death_ns, outcome in ((1 * MS - 1, "dead"), (1 * MS, "dead"), (2 * MS, "dead"), (1 * MS + AIR_NS, "dead")):
        rig = Rig({(0, 1): -60.0}, capacity_j=dying(1, death_ns))
        rig.on_air(1 * MS, 0)
        assert rig.run().outcomes() == [{1: outcome}]
    rig = Rig({(0, 1): -60.0}, capacity_j=dying(1, 1 * MS + AIR_NS + 1))
    rig.on_air(1 * MS, 0)
    assert rig.run().outcomes() == [{1: "received"}]


def sender_dying_after(air_ns):
    """Two listeners, one of them busy; the sender's battery lasts so long into its frame."""
    capacity_j = (56.4 * 1 * MS + 52.2 * air_ns) * 1e-12
    rig = Rig({(0, 1): -60.0, (0, 2): -60.0, (3, 2): -60.0}, capacity_j={0: capacity_j})
    rig.on_air(1 * MS, 0)
    rig.on_air(900 * US, 3)
    return rig.run()


def test_a_sender_that_dies_half_way_is_heard_by_nobody():
    rig = sender_dying_after(300 * US)
    assert rig.outcomes(0) == [{1: "dead", 2: "dead"}]
    (cut,) = [frame for frame in rig.frames if frame.source == 0]
    assert (cut.t_start_ns, cut.t_end_ns) == (1 * MS, 1 * MS + 300 * US)
    assert [node for _, node, _ in rig.received] == [2]
    assert rig.stations[1].radio.state == "listen"
    assert rig.stations[0].battery.left_j == 0.0


def test_a_frame_that_was_sent_whole_counts_though_its_sender_dies_at_its_end():
    rig = sender_dying_after(AIR_NS)
    assert rig.outcomes(0) == [{1: "received", 2: "busy"}]
    assert rig.stations[0].radio.state == "dead"
    assert rig.states_after_death(0) == []


def test_a_dead_radio_draws_nothing():
    rig = Rig({(0, 1): -60.0}, capacity_j=dying(0, 5 * MS)).run()
    assert rig.stations[0].ledger_uj() == {("listen", ""): (pytest.approx(282.0), 5000), ("dead", ""): (0.0, 95_000)}


# --- interference, segment by segment -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start_ns", "psdu_byte"),
    [
        (400 * US, 20),  # within the frame: three stretches
        (1000 * US, 100),  # until after its end
        (100 * US, 20),  # from within the preamble
        (20 * US, 11),  # across the preamble's end
    ],
)
def test_success_is_the_product_over_stretches_of_constant_interference(start_ns, psdu_byte):
    """A frame at 3 dB over noise, an interferer for a part of it. The bits of the preamble do not count."""
    signal_dbm, other_dbm = NOISE_DBM + 3.0, NOISE_DBM - 1.0
    counted = (PREAMBLE_NS, AIR_NS)
    overlap_ns = max(0, min(counted[1], start_ns + airtime_ns(psdu_byte)) - max(counted[0], start_ns))
    clear_ns = counted[1] - counted[0] - overlap_ns
    probability = (1.0 - oqpsk_bit_error_rate(snr(signal_dbm))) ** (clear_ns * BITS_PER_NS) * (
        1.0 - oqpsk_bit_error_rate(snr(signal_dbm, other_dbm))
    ) ** (overlap_ns * BITS_PER_NS)
    assert 0.001 < probability < 0.999

    def outcome(luck):
        rig = Rig({(0, 1): signal_dbm, (2, 1): other_dbm}, luck=luck)
        rig.on_air(1 * MS, 0)
        rig.on_air(1 * MS + start_ns, 2, psdu_byte=psdu_byte)
        rig.run()
        return rig.outcomes(0)[0][1], min(sorted_frames(rig.frames)[0].rx_sinr_db)

    # the table of logarithms is exact to 1.5e-5
    error = 3e-5 * abs(math.log(probability))
    assert outcome(probability * (1.0 - error)) == ("received", pytest.approx(mw_to_dbm(snr(signal_dbm, other_dbm))))
    assert outcome(probability * (1.0 + error))[0] == "collided"


@pytest.mark.parametrize("snr_db", [-1.0, 0.0, 0.5, 1.0])
def test_the_share_of_frames_received_is_binomial(snr_db):
    frames, psdu_byte = 2000, 50
    rig = Rig(
        {(0, 1): NOISE_DBM + snr_db},
        luck=lambda node: Streams(7).generator(f"{snr_db}/{node}"),
    )
    for number in range(frames):
        rig.on_air((1 + 3 * number) * MS, 0, psdu_byte=psdu_byte)
    rig.run(3 * (frames + 1) * MS)
    expected = frame_success_probability(10.0 ** (snr_db / 10.0), 8 * (psdu_byte + 1))
    low, high = binom.interval(0.99, frames, expected)
    assert low <= len(rig.received) <= high
    assert 0.01 < expected < 0.999


# --- clear channel assessment ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap_us", [0, 1, 191, 192, 193, 500])
def test_who_assesses_within_the_turnaround_of_another_collides(gap_us):
    """The first frame is on the air 192 us after its sender's assessment; what begins at an instant is not yet seen."""
    rig = Rig(mesh(3)).add_macs({0: Draws(0.0), 1: Draws(0.0, 0.0, 0.99)})
    rig.submit(0, 0, 2)
    rig.submit(gap_us * US, 1, 2)
    rig.run(8 * MS)
    first, second = [frame.t_start_ns / US for frame in sorted_frames(rig.frames) if not frame.is_ack][:2]
    assert first == 320
    if gap_us <= 192:
        assert second == 320 + gap_us
    else:
        assert second > 320 + airtime_ns(50) / US


def test_energy_below_the_threshold_without_a_carrier_is_a_clear_channel():
    """Two signals of -81 dBm, together -78, are clear (threshold -77) to a radio locked on neither; three are not."""
    for count, busy in ((1, False), (2, False), (3, True)):
        rig = Rig({(source, 9): -81.0 for source in range(count)})
        rig.stations[9].radio.sleep()
        for source in range(count):
            rig.on_air(1 * MS, source)
        rig.run(2 * MS)
        assert rig.medium.is_busy(9) is busy


def test_energy_that_ended_within_the_assessment_counts():
    """The listener is locked on a weak frame; the strong one it could not lock on ended 100 us before."""
    rig = Rig({(0, 1): -100.0, (2, 1): -70.0})  # node 0 is too weak to be caught
    rig.stations[1].radio.sleep()
    rig.on_air(1 * MS, 2)
    rig.at(1 * MS + 100 * US, rig.stations[1].radio.wake)  # too late to catch it
    rig.run(1 * MS + AIR_NS + 100 * US)
    assert rig.medium.is_busy(1)
    rig.run(1 * MS + AIR_NS + 128 * US)
    assert not rig.medium.is_busy(1)


def test_a_carrier_below_the_threshold_is_busy():
    rig = Rig({(0, 1): -90.0})
    rig.on_air(1 * MS, 0)
    rig.run(2 * MS)
    assert rig.medium.is_busy(1)


CCA_NS = 128 * US


@pytest.mark.parametrize("power_dbm", [-60.0, -90.0])
@pytest.mark.parametrize(
    ("offset_ns", "busy"),
    [(0, False), (1, True), (AIR_NS, True), (AIR_NS + CCA_NS - 1, True), (AIR_NS + CCA_NS, False)],
)
def test_a_channel_is_busy_if_anything_was_on_it_within_eight_symbols(offset_ns, busy, power_dbm):
    """Both ways of handling what happens at one instant: asking before and after the medium."""
    for asks_first in (True, False):
        rig = Rig({(0, 1): power_dbm})
        seen = []

        def ask(rig=rig, seen=seen):
            seen.append(rig.medium.is_busy(1))

        if asks_first:
            rig.at(1 * MS + offset_ns, ask)
        rig.on_air(1 * MS, 0)
        if not asks_first:
            rig.at(1 * MS + offset_ns - 1, lambda rig=rig, ask=ask: rig.clock.call_after(1, lambda _: ask()))
        rig.run()
        assert seen == [busy]


# --- ties -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("later_first", [False, True])
def test_frames_that_meet_end_to_end_do_not_interfere(later_first):
    rig = Rig({(0, 1): -60.0, (2, 1): -60.0}, luck=0.999)
    starts = [(1 * MS, 0), (1 * MS + AIR_NS, 2)]
    for start_ns, source in reversed(starts) if later_first else starts:
        rig.on_air(start_ns, source)
    rig.run()
    assert rig.outcomes() == [{1: "received"}, {1: "received"}]
    assert all(sinr == pytest.approx(35.0) for frame in rig.frames for sinr in frame.rx_sinr_db)


@pytest.mark.parametrize("order", [(0, 2, 3), (0, 3, 2), (2, 0, 3), (2, 3, 0), (3, 0, 2), (3, 2, 0)])
@pytest.mark.parametrize("strongest_dbm", [-60.0, NOISE_DBM - 2.5, NOISE_DBM + 1.0])
def test_of_simultaneous_preambles_the_strongest_is_caught(order, strongest_dbm):
    rig = Rig(
        {(0, 1): strongest_dbm - 1.0, (2, 1): strongest_dbm, (3, 1): strongest_dbm - 0.5},
        luck=0.0,
    )
    for source in order:
        rig.on_air(1 * MS, source)
    rig.run()
    assert rig.outcomes() == [{1: "busy"}, {1: "received"}, {1: "busy"}]
    by_source = {frame.source: frame for frame in rig.frames}
    lowest = snr(strongest_dbm, strongest_dbm - 1.0, strongest_dbm - 0.5)
    assert by_source[2].rx_sinr_db == [pytest.approx(mw_to_dbm(lowest))]
    for loser, power_dbm in ((0, strongest_dbm - 1.0), (3, strongest_dbm - 0.5)):
        assert by_source[loser].rx_sinr_db == [pytest.approx(power_dbm - NOISE_DBM, abs=1e-6)]
    assert rig.stations[1].radio.state == "listen"


@pytest.mark.parametrize("order", [(0, 2), (2, 0)])
def test_of_equally_strong_preambles_that_of_the_lowest_node_is_caught(order):
    rig = Rig({(0, 1): -60.0, (2, 1): -60.0}, luck=0.0)
    for source in order:
        rig.on_air(1 * MS, source)
    assert rig.run().outcomes() == [{1: "received"}, {1: "busy"}]


def test_waking_at_the_very_start_of_a_frame_does_not_lose_what_waited_for_the_radio():
    """The radio is ready at 1052 us, when a frame begins; the MAC's own job must go on after it."""
    for wakes_first in (True, False):
        rig = Rig(mesh(2)).add_macs({1: Draws(0.9)})
        rig.stations[1].mac.sleep()
        if wakes_first:
            fate = rig.submit(0, 1, 0)
        rig.on_air(1052 * US, 0)
        if not wakes_first:
            fate = rig.submit(0, 1, 0)
        rig.run()
        assert [delivery.acknowledged for _, delivery in fate] == [True]
        assert rig.stations[1].radio.state == "sleep"


def test_the_air_is_left_empty():
    rig = Rig(mesh(4), luck=lambda node: np.random.default_rng(node))
    for number in range(40):
        rig.on_air((1 + 3 * number) * MS // 2, number % 4)
    rig.run(200 * MS)
    assert len(rig.frames) == 40
    assert not any(rig.medium.is_busy(node) for node in range(4))
    for frame in rig.frames:
        assert set(outcomes_of(frame)) == set(range(4)) - {frame.source}
