"""A unicast exchange over CSMA-CA, every instant and every microjoule written out by hand (IEEE 802.15.4-2006, CC2420)."""

import pytest
from sim_rig import MS, US, Draws, Rig, mesh

# 3.0 V times 18.8 mA receiving or switching, 17.4 mA sending at 0 dBm
RX_MW, TX_MW = 56.4, 52.2


def exchange():
    """Node 0 sends a packet of 39 bytes to node 1: sequence 128, back-off 0.5 x 8 = 4 unit periods."""
    rig = Rig(mesh(2), full=True).add_macs({0: Draws(0.5, 0.5)})
    fate = rig.submit(0, 0, 1, bytes(39), "belief")
    return rig.run(10 * MS), fate


def test_every_instant():
    rig, fate = exchange()
    # 4 x 320 us back-off, 128 us assessment -> 1408; 192 us turnaround -> 1600; (6 + 50) x 32 us = 1792 -> 3392
    # 192 us turnaround -> 3584; acknowledgement (6 + 5) x 32 us = 352 -> 3936
    data, ack = rig.frames
    assert (data.t_start_ns, data.t_end_ns, data.size_byte) == (1600 * US, 3392 * US, 50)
    assert (ack.t_start_ns, ack.t_end_ns, ack.size_byte) == (3584 * US, 3936 * US, 5)
    assert (data.is_ack, ack.is_ack, ack.kind, ack.source, ack.destination) == (0, 1, "belief", 1, 0)
    assert rig.delivered == [(3392 * US, 1, 0, bytes(39))]
    ((done_ns, delivery),) = fate
    assert (done_ns, delivery.acknowledged, delivery.attempts) == (3936 * US, True, 1)


def test_every_radio_state():
    rig, _ = exchange()
    listen, receive, transmit, switch = 2, 3, 4, 5
    # the acknowledgement begins at the instant the receiver is ready again, 3584 us: whether it is seen to listen first
    # depends on which of the two is handled first
    assert [state for state in rig.states(0) if state != (3584, listen)] == [
        (0, listen),
        (1408, switch),
        (1600, transmit),
        (3392, switch),
        (3584, receive),
        (3936, listen),
    ]
    assert rig.states(1) == [
        (0, listen),
        (1600, receive),
        (3392, listen),
        (3392, switch),
        (3584, transmit),
        (3936, switch),
        (4128, listen),
    ]


def test_every_microjoule_of_the_sender():
    rig, _ = exchange()
    expected_us = {
        ("listen", ""): 1408 + (10_000 - 3936),
        ("switch", "belief"): 192 + 192,
        ("transmit", "belief"): 1792,
        ("ack_receive", "belief"): 352,
    }
    booked = rig.stations[0].ledger_uj()
    assert {key: time_us for key, (_, time_us) in booked.items()} == expected_us
    assert booked == {
        ("listen", ""): (pytest.approx(421.4208, rel=1e-12), 7472),
        ("switch", "belief"): (pytest.approx(21.6576, rel=1e-12), 384),
        ("transmit", "belief"): (pytest.approx(93.5424, rel=1e-12), 1792),
        ("ack_receive", "belief"): (pytest.approx(19.8528, rel=1e-12), 352),
    }
    assert rig.stations[0].battery.used_j == pytest.approx((8208 * RX_MW + 1792 * TX_MW) * 1e-9, rel=1e-12)


def test_every_microjoule_of_the_receiver():
    rig, _ = exchange()
    assert rig.stations[1].ledger_uj() == {
        ("listen", ""): (pytest.approx(0.0564 * 7472, rel=1e-12), 1600 + 10_000 - 4128),
        ("receive", "belief"): (pytest.approx(101.0688, rel=1e-12), 1792),
        ("switch", "belief"): (pytest.approx(21.6576, rel=1e-12), 384),
        ("ack_transmit", "belief"): (pytest.approx(18.3744, rel=1e-12), 352),
    }
    assert rig.stations[1].battery.used_j == pytest.approx((9648 * RX_MW + 352 * TX_MW) * 1e-9, rel=1e-12)


def test_a_bystander_pays_for_overhearing():
    rig = Rig(mesh(3)).add_macs({0: Draws(0.5, 0.5)})
    rig.submit(0, 0, 1, bytes(39), "belief")
    rig.run(10 * MS)
    assert {key: time_us for key, (_, time_us) in rig.stations[2].ledger_uj().items()} == {
        ("listen", ""): 10_000 - 1792 - 352,
        ("overhear", "belief"): 1792 + 352,
    }


def test_frames_are_spaced_after_the_one_before_but_not_after_a_rest():
    """LIFS is 40 symbols, 640 us, after the acknowledgement of a frame of more than 18 bytes; later it has passed."""
    rig = Rig(mesh(2)).add_macs({0: Draws(0.0)})
    for time_ns in (0, 0, 20 * MS):
        rig.submit(time_ns, 0, 1, bytes(39))
    rig.run()
    starts_us = [frame.t_start_ns / US for frame in rig.frames if not frame.is_ack]
    first_us = 128 + 192
    ack_end_us = first_us + 1792 + 192 + 352
    assert starts_us == [first_us, ack_end_us + 640 + 128 + 192, 20_000 + 128 + 192]


def test_a_retry_waits_for_the_acknowledgement_and_backs_off_anew():
    """macAckWaitDuration is 54 symbols, 864 us; the spacing (640 us) has passed by then."""
    rig = Rig({(0, 1): -60.0}).add_macs({0: Draws(0.0, 0.0, 0.25, 0.5, 0.75)})
    fate = rig.submit(0, 0, 1, bytes(39))
    rig.run()
    starts_us = [frame.t_start_ns / US for frame in rig.frames if frame.source == 0]
    cycle_us = 192 + 1792 + 864 + 128
    assert starts_us == [320 + number * cycle_us + backoffs * 320 for number, backoffs in enumerate((0, 2, 6, 12))]
    ((done_ns, delivery),) = fate
    assert done_ns == starts_us[-1] * US + (1792 + 864) * US
    assert (delivery.reason, delivery.attempts) == ("no_ack", 4)
    assert [frame.attempt for frame in rig.frames if frame.source == 0] == [0, 1, 2, 3]
