"""Pure ALOHA: when it sends, what it does about losses, and the textbook's throughput."""

import math

import numpy as np
import pytest
from scipy.stats import binom
from sim_rig import MS, NOISE_DBM, US, Draws, Rig, airtime_ns, mesh, sorted_frames

from netsim.api import BROADCAST
from netsim.sim.mac.aloha import AlohaMac, AlohaParameters

NEARLY_ONE = 1.0 - 1e-9
ACK_WAIT_US = 864


def aloha(rig, draws=None, **parameters):
    settings = AlohaParameters(**parameters)
    return rig.add(
        lambda station, uniform, deliver: AlohaMac(rig.clock, station.radio, uniform, settings, deliver), draws
    )


def starts_us(rig, source):
    return [frame.t_start_ns / US for frame in sorted_frames(rig.frames) if frame.source == source]


def test_it_sends_at_once_whatever_is_on_the_air():
    rig = aloha(Rig(mesh(3)))
    rig.submit(1 * MS, 0, BROADCAST)
    rig.submit(2 * MS, 1, BROADCAST)
    rig.run()
    assert starts_us(rig, 0) == [1000 + 192]
    assert starts_us(rig, 1) == [2000 + 192]
    assert rig.outcomes() == [{1: "half_duplex", 2: "received"}, {0: "half_duplex", 2: "busy"}]


def test_a_lost_frame_is_gone_without_acknowledgement():
    rig = aloha(Rig({(0, 1): NOISE_DBM - 3.0}, luck=NEARLY_ONE))
    fate = rig.submit(0, 0, 1)
    rig.run()
    assert rig.outcomes() == [{1: "weak"}]
    ((done_ns, delivery),) = fate
    assert done_ns == 192 * US + airtime_ns(50)
    assert (delivery.acknowledged, delivery.attempts) == (True, 1)


def test_retries_wait_in_windows_that_double():
    """Half of 200, 400 and 800 ms, after the wait for the acknowledgement that node 0 does not hear."""
    rig = aloha(Rig({(0, 1): -60.0}), {0: Draws(0.0, 0.5)}, acknowledge=True)
    fate = rig.submit(0, 0, 1)
    rig.run(2000 * MS)
    cycle_us = 192 + 1792 + ACK_WAIT_US
    assert starts_us(rig, 0) == [
        192 + number * cycle_us + 1000 * waited for number, waited in enumerate((0, 100, 300, 700))
    ]
    ((done_ns, delivery),) = fate
    assert (delivery.acknowledged, delivery.reason, delivery.attempts) == (False, "no_ack", 4)
    assert done_ns == (192 + 3 * cycle_us + 700_000 + 1792 + ACK_WAIT_US) * US
    assert len(rig.delivered) == 1


def test_an_acknowledgement_ends_the_exchange():
    rig = aloha(Rig(mesh(2)), acknowledge=True)
    fate = rig.submit(0, 0, 1)
    rig.run()
    assert [(frame.source, frame.is_ack) for frame in rig.frames] == [(0, 0), (1, 1)]
    assert fate[0][0] == (192 + 1792 + 192 + 352) * US
    assert fate[0][1].acknowledged


def test_the_first_frame_waits_its_random_delay():
    rig = aloha(Rig(mesh(2)), {0: Draws(0.0, 0.25, 0.75)}, initial_delay_s=0.04)
    rig.submit(0, 0, BROADCAST)
    rig.submit(0, 0, BROADCAST)
    rig.run()
    first_us = 10_000 + 192
    assert starts_us(rig, 0) == [first_us, first_us + 1792 + 30_000 + 192]


def test_a_duty_cycle_of_one_percent_is_kept():
    """99 airtimes of silence after each frame of 1792 us, and at least the turnaround."""
    rig = aloha(Rig(mesh(2)), duty_cycle=0.01)
    for _ in range(5):
        rig.submit(0, 0, BROADCAST)
    rig.run(1000 * MS)
    assert starts_us(rig, 0) == [192 + number * (100 * 1792 + 192) for number in range(5)]
    assert 5 * 1792 / (starts_us(rig, 0)[-1] + 100 * 1792) <= 0.01


def test_acknowledgements_use_up_the_air_too():
    """Node 1 answers at once, 352 us, and then has to be silent for 99 times that."""
    rig = aloha(Rig(mesh(2)), acknowledge=True, duty_cycle=0.01)
    rig.submit(0, 0, 1)
    rig.submit(3 * MS, 1, 0)
    rig.run(100 * MS)
    ack_end_us = 192 + 1792 + 192 + 352
    assert starts_us(rig, 1) == [ack_end_us - 352, ack_end_us + 99 * 352 + 192]


def test_a_frame_due_while_an_acknowledgement_goes_out_follows_it():
    rig = aloha(Rig(mesh(2)), acknowledge=True)
    rig.submit(0, 0, 1)
    fate = rig.submit((192 + 1792 + 100) * US, 1, 0)
    rig.run()
    ack_end_us = 192 + 1792 + 192 + 352
    assert starts_us(rig, 1) == [ack_end_us - 352, ack_end_us + 192 + 192]
    assert fate[0][1].acknowledged


@pytest.mark.parametrize("load", [0.1, 0.5])
def test_a_share_of_exp_minus_2g_meets_no_other_frame(load):
    """Frames of one length begin at the points of a Poisson process, each from a node of its own.

    Counted from the starts in the log: a frame is alone if no other begins within an airtime of it. The count of the
    lonely is not quite binomial (neighbours share their gap): its variance is at most twice as large.
    """
    count, air_ns = 1500, airtime_ns(50)
    times = np.cumsum(np.random.default_rng(3).exponential(air_ns / load, count)).astype(int)
    sources = 40
    rig = aloha(Rig({(source, 99): -60.0 for source in range(sources)}, luck=NEARLY_ONE))
    for number, time_ns in enumerate(times.tolist()):
        rig.submit(time_ns, number % sources, BROADCAST)
    rig.run(int(times[-1]) + 100 * MS)
    starts = np.array([frame.t_start_ns for frame in sorted_frames(rig.frames)])
    assert (starts == times + 192 * US).all()
    gaps = np.diff(starts, prepend=-(10**12), append=10**15)
    alone = (gaps[:-1] >= air_ns) & (gaps[1:] >= air_ns)
    received = np.array([outcome[99] == "received" for outcome in rig.outcomes()])
    assert received[alone].all()
    # a frame met at its start is never received: the receiver is locked on the other
    assert not received[gaps[:-1] < air_ns][: count - 1].all()
    low, high = binom.interval(0.9999, count, math.exp(-2 * load))
    assert low <= alone.sum() <= high
