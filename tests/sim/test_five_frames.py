"""An exchange of five frames over CSMA-CA, every instant and every microjoule written out by hand.

Node 0 sends 39 bytes to node 1 over a link of 0 dB SNR; who hears what is given. The first data frame is lost to noise,
the second arrives but its acknowledgement is lost, the third arrives again and its acknowledgement is heard:

    data (lost)   data   acknowledgement (lost)   data   acknowledgement

IEEE 802.15.4-2006 at 2.4 GHz: symbol 16 us, unit back-off 320 us, assessment 128 us, turnaround 192 us, byte 32 us, wait for
an acknowledgement 864 us. CC2420 at 3.0 V: 18.8 mA or 56.4 mW listening, receiving and switching, 17.4 mA or 52.2 mW sending
at 0 dBm, so a microsecond costs 56.4 or 52.2 nJ.
"""

import numpy as np
import pytest
from sim_rig import MS, NOISE_DBM, US, Draws, Rig, outcomes_of

LOST, HEARD = 1.0 - 1e-12, 0.0
DATA_US = (6 + 11 + 39) * 32
ACK_US = (6 + 5) * 32
RX_NJ, TX_NJ = 56.4, 52.2


class Luck:
    """The uniform number of each reception in turn."""

    def __init__(self, *numbers):
        self.numbers = numbers

    def random(self, count):
        return np.resize(np.array(self.numbers), count)


@pytest.fixture(scope="module")
def finished():
    luck = {0: Luck(LOST, HEARD), 1: Luck(LOST, HEARD, HEARD)}
    rig = Rig({(0, 1): NOISE_DBM, (1, 0): NOISE_DBM}, luck=luck.get, full=True)
    # sequence number 128, then back-offs of 2, 5 and 7 of 8 unit periods
    rig.add_macs({0: Draws(0.5, 0.25, 0.625, 0.875)})
    fate = rig.submit(0, 0, 1, bytes(39), "belief")
    return rig.run(20 * MS), fate


def test_every_instant(finished):
    rig, fate = finished
    assert (DATA_US, ACK_US) == (1792, 352)
    spans = [(frame.source, frame.is_ack, frame.t_start_ns / US, frame.t_end_ns / US) for frame in rig.frames]
    assert spans == [
        # 2 x 320 back-off, 128 assessment, 192 turnaround = 960
        (0, 0, 960, 2752),
        # nothing for 864 -> 3616; 5 x 320 + 128 + 192 = 1920 -> 5536
        (0, 0, 5536, 7328),
        # 192 turnaround
        (1, 1, 7520, 7872),
        # lost: 7328 + 864 = 8192; 7 x 320 + 128 + 192 = 2560 -> 10752
        (0, 0, 10752, 12544),
        (1, 1, 12736, 13088),
    ]
    assert [outcomes_of(frame) for frame in rig.frames] == [
        {1: "weak"},
        {1: "received"},
        {0: "weak"},
        {1: "received"},
        {0: "received"},
    ]
    assert [frame.attempt for frame in rig.frames] == [0, 1, 0, 2, 0]
    # the message is handed up once, at the end of the second data frame; the third is a repeat
    assert rig.delivered == [(7328 * US, 1, 0, bytes(39))]
    ((done_ns, delivery),) = fate
    assert (done_ns, delivery.acknowledged, delivery.attempts) == (13_088 * US, True, 3)


LISTEN, RECEIVE, TRANSMIT, SWITCH = 2, 3, 4, 5


def test_every_radio_state(finished):
    """The two acknowledgements begin as node 0 is ready again: whether it is seen to listen first is not decided."""
    rig, _ = finished
    undecided = {(7520, LISTEN), (12_736, LISTEN)}
    assert [state for state in rig.states(0) if state not in undecided] == [
        (0, LISTEN),
        (768, SWITCH),
        (960, TRANSMIT),
        (2752, SWITCH),
        (2944, LISTEN),
        (5344, SWITCH),
        (5536, TRANSMIT),
        (7328, SWITCH),
        (7520, RECEIVE),
        (7872, LISTEN),
        (10_560, SWITCH),
        (10_752, TRANSMIT),
        (12_544, SWITCH),
        (12_736, RECEIVE),
        (13_088, LISTEN),
    ]
    assert rig.states(1) == [
        (0, LISTEN),
        (960, RECEIVE),
        (2752, LISTEN),
        (5536, RECEIVE),
        (7328, LISTEN),
        (7328, SWITCH),
        (7520, TRANSMIT),
        (7872, SWITCH),
        (8064, LISTEN),
        (10_752, RECEIVE),
        (12_544, LISTEN),
        (12_544, SWITCH),
        (12_736, TRANSMIT),
        (13_088, SWITCH),
        (13_280, LISTEN),
    ]


def in_uj(time_us, nj_per_us):
    return pytest.approx(time_us * nj_per_us * 1e-3, rel=1e-12)


def test_every_microjoule_of_the_sender(finished):
    rig, _ = finished
    # listening: 768 before the first turnaround, 2944 to 5344, 7872 to 10560, 13088 to the end at 20000
    assert 768 + 2400 + 2688 + 6912 == 12_768
    assert rig.stations[0].ledger_uj() == {
        ("listen", ""): (pytest.approx(720.1152, rel=1e-12), 12_768),
        ("switch", "belief"): (pytest.approx(64.9728, rel=1e-12), 6 * 192),
        ("transmit", "belief"): (pytest.approx(93.5424, rel=1e-12), 1792),
        ("retransmit", "belief"): (pytest.approx(187.0848, rel=1e-12), 2 * 1792),
        ("ack_receive", "belief"): (pytest.approx(39.7056, rel=1e-12), 2 * 352),
    }
    # 720.1152 + 64.9728 + 93.5424 + 187.0848 + 39.7056
    assert rig.stations[0].battery.used_j * 1e6 == pytest.approx(1105.4208, rel=1e-12)
    assert rig.stations[0].battery.used_j * 1e6 == in_uj(1.0, RX_NJ * (20_000 - 5376) + TX_NJ * 5376)


def test_every_microjoule_of_the_receiver(finished):
    rig, _ = finished
    # listening: 960; 2752 to 5536; 8064 to 10752; 13280 to 20000. What was lost was received all the same
    assert 960 + 2784 + 2688 + 6720 == 13_152
    assert rig.stations[1].ledger_uj() == {
        ("listen", ""): (pytest.approx(741.7728, rel=1e-12), 13_152),
        ("receive", "belief"): (pytest.approx(303.2064, rel=1e-12), 3 * 1792),
        ("switch", "belief"): (pytest.approx(43.3152, rel=1e-12), 4 * 192),
        ("ack_transmit", "belief"): (pytest.approx(36.7488, rel=1e-12), 2 * 352),
    }
    # 741.7728 + 303.2064 + 43.3152 + 36.7488
    assert rig.stations[1].battery.used_j * 1e6 == pytest.approx(1125.0432, rel=1e-12)
