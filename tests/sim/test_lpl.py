"""Low-power listening: what an idle node draws, and exchanges timed by hand (CC2420: 56.4, 1.278, 0.06 mW at 3 V)."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sim_rig import MS, US, Draws, Rig, airtime_ns, mesh, outcomes_of, sorted_frames

from netsim.api import BROADCAST
from netsim.sim.mac.lpl import LplMac
from netsim.sim.mac.lpl_timing import LplParameters, lpl_timing

WAKE_US = 860 + 192  # the oscillator starts, then the synthesiser locks
WAKE_UJ = 860e-3 * 1.278 + 192e-3 * 56.4  # at the idle draw, then the switching draw: 1.09908 + 10.8288
RELOCK_US = 192  # from idle back to listening: the synthesiser alone


def late(*backoffs):
    """Draws of a node whose first check comes after 123.75 ms."""
    return Draws(0.0, 0.99, *(backoffs or [0.0]))


def lpl(rig, draws=None, nodes=None, **parameters):
    """Draws of a node: sequence number, first check as a share of 125 ms, back-offs."""
    settings = LplParameters(**parameters)
    return rig.add(
        lambda station, uniform, deliver: LplMac(
            rig.clock, station.radio, rig.assess(station.radio.node), uniform, settings, deliver
        ),
        draws,
        nodes,
    )


def times_us(rig, node):
    """Time of each heading in the ledger; message kinds left out."""
    booked = {}
    for (state, _), (_, time_us) in rig.stations[node].ledger_uj().items():
        booked[state] = booked.get(state, 0) + time_us
    return {state: time_us for state, time_us in booked.items() if time_us}


def starts_us(rig, source, strobes):
    frames = [frame for frame in sorted_frames(rig.frames) if frame.source == source and not frame.is_ack]
    return [frame.t_start_ns / US for frame in frames if bool(frame.is_strobe) is strobes]


# --- an idle node ---------------------------------------------------------------------------------------------------


def test_an_idle_node_to_the_microjoule():
    """A check: start-up 1052 us, three samples of 128 us, between them 180 us idle and 192 us back to listening."""
    rig = lpl(Rig(mesh(2), full=True))
    rig.run(10 * 125 * MS)
    check_us = WAKE_US + 2 * 500 + 128
    assert check_us == 2180
    assert times_us(rig, 0) == {
        "wake": 10 * (WAKE_US + 2 * RELOCK_US),
        "listen": 10 * 3 * 128,
        "idle": 10 * 2 * 180,
        "sleep": 10 * (125_000 - check_us),
    }
    # 11.92788 start-up, 21.6576 samples, 0.46008 idle, 21.6576 back to listening, 7.3692 asleep (122,820 us)
    assert rig.stations[0].battery.used_j * 1e6 == pytest.approx(10 * 63.07236, rel=1e-12)
    first = [entry for entry in rig.states(0) if 0 < entry[0] < 125_000]
    assert first == [(1052, 2), (1180, 7), (1360, 5), (1552, 2), (1680, 7), (1860, 5), (2052, 2), (2180, 1)]


@pytest.mark.parametrize("interval_ms", [50, 125, 500])
def test_an_idle_nodes_mean_draw_by_interval(interval_ms):
    rig = lpl(Rig(mesh(2)), wake_interval_ms=interval_ms)
    rig.run(20 * interval_ms * MS)
    check_uj, check_us = WAKE_UJ + 2 * 21.6576 + 0.46008, 2180
    expected_uj = check_uj + 0.06e-3 * (interval_ms * 1000 - check_us)
    assert rig.stations[1].battery.used_j * 1e6 == pytest.approx(20 * expected_uj, rel=1e-12)


def test_samples_without_time_to_idle_between_them_listen_on():
    rig = lpl(Rig(mesh(2)), samples=2, sample_spacing_ms=0.3)
    rig.run(125 * MS)
    assert times_us(rig, 0) == {"wake": WAKE_US, "listen": 428, "sleep": 125_000 - WAKE_US - 428}


# --- X-MAC ----------------------------------------------------------------------------------------------------------


def x_mac(nodes=2, destination=1, **parameters):
    """Node 0 sends 39 bytes at 1 ms; all others check from 10 ms on."""
    listeners = {node: Draws(0.0, 0.08) for node in range(1, nodes)}
    rig = lpl(Rig(mesh(nodes)), {0: late(), **listeners}, **parameters)
    fate = rig.submit(1 * MS, 0, destination, bytes(39), "belief")
    return rig.run(100 * MS), fate


FIRST_STROBE_US = 1000 + WAKE_US + 864 + 192 + 128 + 192  # start-up, clear for a gap and a sample, turnaround
CYCLE_US = 544 + 864 + 192  # strobe of 11 bytes, gap, turnaround


def test_an_x_mac_exchange_every_instant():
    """Samples at 11.052 (in a gap) and 11.552 ms (strobe 5 is on the air); strobe 6 is heard whole and answered."""
    rig, fate = x_mac()
    assert FIRST_STROBE_US == 3428
    assert starts_us(rig, 0, strobes=True) == [FIRST_STROBE_US + number * CYCLE_US for number in range(7)]
    heard_us = FIRST_STROBE_US + 6 * CYCLE_US + 544
    assert heard_us == 13_572
    early, late = [frame for frame in rig.frames if frame.is_ack]
    assert (early.t_start_ns / US, early.t_end_ns / US) == (heard_us + 192, heard_us + 544)
    assert starts_us(rig, 0, strobes=False) == [heard_us + 544 + 192]
    assert late.t_end_ns == 16_644 * US
    assert rig.delivered == [(16_100 * US, 1, 0, bytes(39))]
    ((done_ns, delivery),) = fate
    assert (done_ns, delivery.acknowledged, delivery.attempts) == (16_644 * US, True, 1)


def test_an_x_mac_exchange_every_microjoule():
    rig, _ = x_mac()
    sender = rig.stations[0].ledger_uj()
    assert {key: time_us for key, (_, time_us) in sender.items() if time_us} == {
        ("wake", ""): WAKE_US,
        ("listen", ""): 1184 + 6 * (864 - 192),
        ("switch", "belief"): 192 + 6 * 2 * 192 + 3 * 192,
        ("strobe_transmit", "belief"): 7 * 544,
        ("ack_receive", "belief"): 2 * 352,
        ("transmit", "belief"): 1792,
        ("sleep", ""): 100_000 - 15_644,
    }
    assert rig.stations[0].battery.used_j * 1e6 == pytest.approx(
        WAKE_UJ + 5216e-3 * 56.4 + 3072e-3 * 56.4 + 704e-3 * 56.4 + (3808 + 1792) * 1e-3 * 52.2 + 84_356e-3 * 0.06,
        rel=1e-12,
    )
    receiver = rig.stations[1].ledger_uj()
    # it sleeps 12.5 ms after the data came
    assert {key: time_us for key, (_, time_us) in receiver.items() if time_us} == {
        ("wake", ""): WAKE_US + RELOCK_US,
        ("idle", ""): 180,
        ("listen", ""): 128 + (13_028 - 11_552) + (28_600 - 16_836),
        ("strobe_receive", "belief"): 544,
        ("switch", "belief"): 4 * 192,
        ("ack_transmit", "belief"): 2 * 352,
        ("receive", "belief"): 1792,
        ("sleep", ""): 100_000 - 18_600,
    }


def test_whoever_hears_that_the_strobe_is_for_another_sleeps_on():
    rig, _ = x_mac(nodes=3)
    assert times_us(rig, 2) == {
        "wake": WAKE_US + RELOCK_US,
        "idle": 180,
        "listen": 128 + (13_028 - 11_552),
        "overhear": 544,
        "sleep": 100_000 - 3572,
    }


def test_a_receiver_that_is_still_awake_answers_the_first_strobe():
    rig = lpl(Rig(mesh(2)), {0: late(), 1: Draws(0.0, 0.08)})
    fates = [rig.submit(time_ns, 0, 1) for time_ns in (1 * MS, 20 * MS)]
    rig.run(100 * MS)
    assert all(delivery.acknowledged for ((_, delivery),) in fates)
    assert len(starts_us(rig, 0, strobes=True)) == 7 + 1


def test_an_x_mac_broadcast_strobes_a_whole_interval_and_reaches_every_phase():
    phases = {node: Draws(0.0, node / 8) for node in range(1, 8)}
    rig = lpl(Rig(mesh(8)), {0: late(), **phases})
    fate = rig.submit(1 * MS, 0, BROADCAST)
    rig.run(300 * MS)
    timing = lpl_timing(LplParameters(), rig.device)
    strobes = starts_us(rig, 0, strobes=True)
    assert len(strobes) == -(-timing.train_ns // (CYCLE_US * US)) == 80
    assert starts_us(rig, 0, strobes=False) == [FIRST_STROBE_US + 80 * CYCLE_US]
    assert sorted(node for _, node, _, _ in rig.delivered) == list(range(1, 8))
    assert fate[0][1].attempts == 1


@pytest.mark.parametrize("phase", [number / 40 for number in range(40)])
def test_a_train_wakes_its_receiver_whatever_its_phase(phase):
    """One train is enough: of three samples over more than a gap one meets a strobe."""
    for variant in ("x-mac", "b-mac"):
        rig = lpl(Rig(mesh(2)), {0: late(), 1: Draws(0.0, phase)}, variant=variant)
        fate = rig.submit(1 * MS, 0, 1)
        rig.run(300 * MS)
        assert [(delivery.acknowledged, delivery.attempts) for _, delivery in fate] == [(True, 1)]
        assert len(rig.delivered) == 1


def test_nobody_answers():
    """Four trains; before each retry a random wait, here half of 1, 2 and 4 intervals."""
    rig = lpl(Rig({(0, 1): -60.0}), {0: late(0.0, 0.5)}, nodes=[0])
    fate = rig.submit(1 * MS, 0, 1)
    rig.run(2000 * MS)
    ((_, delivery),) = fate
    assert (delivery.reason, delivery.attempts) == ("no_ack", 4)
    strobes = starts_us(rig, 0, strobes=True)
    assert len(strobes) == 4 * 80
    # each train ends with a gap; then half of the window, start-up, clear channel, turnaround
    pauses = [strobes[80 * number] - strobes[80 * number - 1] for number in (1, 2, 3)]
    assert pauses == [544 + 864 + intervals * 62_500 + WAKE_US + 1184 + 192 for intervals in (1, 2, 4)]
    assert {frame.attempt for frame in rig.frames} == {0, 1, 2, 3}
    assert starts_us(rig, 0, strobes=False) == []


def test_a_busy_channel_is_given_up():
    rig = lpl(Rig(mesh(2)), {0: late()}, nodes=[0], max_backoffs=2)
    for number in range(100):
        rig.on_air(number * 4 * MS + 1 * MS, 1, psdu_byte=100)
    fate = rig.submit(2 * MS, 0, 1)
    rig.run(500 * MS)
    ((_, delivery),) = fate
    assert (delivery.reason, delivery.attempts) == ("channel_busy", 0)


# --- B-MAC ----------------------------------------------------------------------------------------------------------


def test_a_b_mac_exchange_every_instant():
    """Wake-up frames of 127 bytes, 4256 us, back to back for at least 130.384 ms from the assessment: 31 of them."""
    listeners = {1: Draws(0.0, 0.08), 2: Draws(0.0, 0.08)}
    rig = lpl(Rig(mesh(3)), {0: late(), **listeners}, variant="b-mac")
    fate = rig.submit(1 * MS, 0, 1)
    rig.run(200 * MS)
    first_us = 1000 + WAKE_US + 128 + 192
    assert starts_us(rig, 0, strobes=True) == [first_us + number * 4256 for number in range(31)]
    data_us = first_us + 31 * 4256
    assert starts_us(rig, 0, strobes=False) == [data_us]
    assert fate[0][0] == (data_us + 1792 + 192 + 352) * US
    # node 1 notices it with the sample that ends at 11.180 ms and hears frames 3 to 30
    receiver = times_us(rig, 1)
    assert receiver["strobe_receive"] == 28 * 4256
    assert receiver["receive"] == 1792
    # node 2 is kept awake by the preamble, which has no address, and listens for 12.5 ms after it
    bystander = times_us(rig, 2)
    assert bystander["strobe_receive"] == 28 * 4256
    assert bystander["overhear"] == 1792 + 352
    asleep_us = (
        data_us + 2 * 12_500
    )  # what came 12.5 ms after the last strobe was still within the time of an assessment
    assert bystander["listen"] + bystander["strobe_receive"] + bystander["overhear"] in (
        pytest.approx(data_us + 12_500 - 11_052 + 128, abs=3 * 128),
        pytest.approx(asleep_us - 11_052, abs=3 * 128),
    )


def test_b_mac_frames_follow_each_other_without_a_gap():
    rig = lpl(Rig(mesh(2)), {0: late(), 1: Draws(0.0, 0.5)}, variant="b-mac")
    rig.submit(1 * MS, 0, 1)
    rig.run(200 * MS)
    train = [frame for frame in sorted_frames(rig.frames) if frame.source == 0]
    assert all(before.t_end_ns == after.t_start_ns for before, after in pairwise(train))
    assert {frame.size_byte for frame in train} == {127, 50}
    assert all(outcomes_of(frame)[1] in ("asleep", "received") for frame in train)
    assert train[0].t_end_ns - train[0].t_start_ns == airtime_ns(127)


# --- common ---------------------------------------------------------------------------------------------------------


def test_energy_without_a_frame_wakes_in_vain():
    """A signal too weak to be decoded but above the threshold: 12.5 ms of listening, again while it lasts."""
    rig = Rig({(0, 1): -60.0, (1, 0): -60.0})
    lpl(rig, {1: Draws(0.0, 0.08)}, nodes=[1])
    rig.on_air(10 * MS, 0, destination=9, psdu_byte=127)  # its start is missed
    rig.run(100 * MS)
    assert times_us(rig, 1) == {"wake": WAKE_US, "listen": 128 + 12_500, "sleep": 100_000 - WAKE_US - 128 - 12_500}


def test_radio_sleep_ends_the_sampling_and_wake_resumes_it():
    rig = lpl(Rig(mesh(2)), {0: Draws(0.0, 0.5), 1: Draws(0.0, 0.08)})
    rig.at(1 * MS, rig.stations[1].mac.sleep)
    missed = rig.submit(2 * MS, 0, 1)
    rig.run(1000 * MS)
    assert missed[0][1].reason == "no_ack"
    assert times_us(rig, 1) == {"sleep": 1_000_000}
    rig.stations[1].mac.wake()
    rig.run(1200 * MS)
    assert times_us(rig, 1)["wake"] > 0


def test_a_sleeping_node_still_sends():
    rig = lpl(Rig(mesh(2)), {0: Draws(0.0, 0.5), 1: Draws(0.0, 0.08)})
    rig.at(0, rig.stations[0].mac.sleep)
    fate = rig.submit(20 * MS, 0, 1)
    rig.run(400 * MS)
    assert fate[0][1].acknowledged
    assert rig.stations[0].radio.state == "sleep"


@pytest.mark.parametrize("variant", ["x-mac", "b-mac"])
def test_crossing_senders_both_get_through(variant):
    draws = {
        node: Draws(0.0, 0.1 * node, *[(0.37 * node + 0.61 * number) % 1 for number in range(40)]) for node in (0, 1)
    }
    rig = lpl(Rig(mesh(2)), draws, variant=variant)
    fates = [rig.submit(1 * MS, node, 1 - node) for node in (0, 1) for _ in range(3)]
    rig.run(8000 * MS)
    assert all(fate[0][1].acknowledged for fate in fates)
    assert sorted(node for _, node, _, _ in rig.delivered) == [0, 0, 0, 1, 1, 1]


def test_a_queue_is_bounded():
    rig = lpl(Rig(mesh(2)), queue_frames=1)
    fates = [rig.submit(0, 0, 1) for _ in range(4)]
    rig.run(2000 * MS)
    assert [delivery.reason for ((_, delivery),) in fates] == ["", "", "queue_full", "queue_full"]


# --- sleep and wake at any moment -------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    sleep_us=st.integers(0, 126_500),
    awake_after_us=st.integers(1, 260_000),
    variant=st.sampled_from(["x-mac", "b-mac"]),
)
def test_a_node_put_to_sleep_at_any_moment_samples_again_once_it_is_woken(sleep_us, awake_after_us, variant):
    rig = lpl(Rig(mesh(2)), variant=variant)
    mac = rig.stations[1].mac
    rig.at(sleep_us * US, mac.sleep)
    rig.at((sleep_us + awake_after_us) * US, mac.wake)
    fate = rig.submit(600 * MS, 0, 1)
    rig.run(2000 * MS)
    ((_, delivery),) = fate
    assert delivery.acknowledged
    assert rig.stations[1].radio.state in ("sleep", "idle", "switch", "listen")


def test_a_job_that_is_given_up_tells_how_often_it_was_on_the_air():
    """Nobody answers: the node goes down in its third attempt."""
    rig = Rig({(0, 1): -60.0}).add_macs({0: Draws(0.0)})
    fate = rig.submit(0, 0, 1)
    third_us = [320 + number * (192 + 1792 + 864 + 128) for number in range(4)][2]
    rig.at((third_us + 500) * US, lambda: rig.stations[0].mac.give_up("crashed"))
    rig.run(20 * MS)
    ((_, delivery),) = fate
    assert (delivery.acknowledged, delivery.reason, delivery.attempts) == (False, "crashed", 2)
