"""What a medium does beyond a constant world: capture, jammers, noise that varies, fading, measured ratios, faults."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim_rig import MS, NOISE_DBM, US, Rig, airtime_ns, mesh, sinr_medium

from netsim.models.device_tables import load_radio
from netsim.models.reception import frame_success_probability
from netsim.sim.air import Link
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.medium import SinrMedium
from netsim.trace.events import OUTCOME_CODE
from netsim.units import dbm_to_mw

STRONG, WEAK = -60.0, -70.0


class Capturing(Rig):
    """A rig whose receivers leave a frame for a later one of at least 5 dB."""

    def __init__(self, *args, threshold_db=5.0, **more):
        self.threshold_db = threshold_db
        super().__init__(*args, **more)

    def _station(self, node, recorder, capacity_j, full):
        self.device = replace(self.device, capture_sinr_db=self.threshold_db)
        return super()._station(node, recorder, capacity_j, full)


@pytest.mark.parametrize("full", [False, True])
def test_a_later_and_stronger_frame_takes_the_receiver(full):
    rig = Capturing({(0, 1): WEAK, (2, 1): STRONG}, full=full)
    rig.on_air(1 * MS, 0)
    rig.on_air(2 * MS, 2)
    assert rig.run().outcomes() == [{1: "captured"}, {1: "received"}]


def test_the_time_before_the_capture_is_booked_with_the_frame_that_was_left():
    booked = []
    for full in (False, True):
        rig = Capturing({(0, 1): WEAK, (2, 1): STRONG}, full=full)
        rig.on_air(1 * MS, 0, kind="left")
        rig.on_air(2 * MS, 2, kind="taken")
        booked.append({key: time_us for key, (_, time_us) in rig.run(10 * MS).stations[1].ledger_uj().items()})
    assert booked[0] == booked[1]
    whole_us = airtime_ns(50) / US
    assert booked[0] == {
        ("receive", "left"): 1000,
        ("receive", "taken"): whole_us,
        ("listen", ""): 10_000 - 1000 - whole_us,
    }


@pytest.mark.parametrize(
    ("later_dbm", "outcome"), [(STRONG - 6.0, "busy"), (STRONG + 4.0, "busy"), (-54.0, "received")]
)
def test_below_the_threshold_the_first_keeps_the_receiver(later_dbm, outcome):
    rig = Capturing({(0, 1): STRONG, (2, 1): later_dbm})
    rig.on_air(1 * MS, 0)
    rig.on_air(2 * MS, 2)
    assert rig.run().outcomes(source=2) == [{1: outcome}]


@pytest.mark.parametrize("order", [(2, 3), (3, 2)])
def test_of_simultaneous_capturers_the_strongest_wins_in_any_order(order):
    rig = Capturing({(0, 1): WEAK, (2, 1): -60.0, (3, 1): -58.0}, threshold_db=0.5)
    rig.on_air(1 * MS, 0)
    for source in order:
        rig.on_air(2 * MS, source)
    rig.run()
    assert [rig.outcomes(source=source) for source in (0, 2, 3)] == [
        [{1: "captured"}],
        [{1: "busy"}],
        [{1: "received"}],  # 2 dB above the other
    ]


def test_a_capturer_is_lost_if_its_receiver_falls_asleep():
    rig = Capturing({(0, 1): WEAK, (2, 1): STRONG})
    rig.on_air(1 * MS, 0)
    rig.on_air(2 * MS, 2)
    rig.at(2 * MS + 300 * US, rig.stations[1].radio.sleep)
    assert rig.run().outcomes() == [{1: "captured"}, {1: "asleep"}]


class Lora(Rig):
    """A rig of LoRa radios."""

    def _station(self, node, recorder, capacity_j, full):
        self.device = load_radio("sx1276", Path())
        return super()._station(node, recorder, capacity_j, full)


@pytest.mark.parametrize("strong_first", [True, False])
@pytest.mark.parametrize("above_db", [7.0, 5.0])
def test_of_two_lora_frames_that_overlap_the_stronger_survives_by_6_db(above_db, strong_first):
    """LoRaSim: whichever began first; nearer to each other both are lost."""
    rig = Lora({(0, 1): -60.0, (2, 1): -60.0 - above_db})
    first, second = (0, 2) if strong_first else (2, 0)
    rig.on_air(1 * MS, first)
    rig.on_air(20 * MS, second)
    rig.run(500 * MS)
    strong, weak = (rig.outcomes(source=source)[0][1] for source in (0, 2))
    if above_db > 6.0:
        assert strong == "received"
        assert weak == ("busy" if strong_first else "captured")
    else:
        assert {strong, weak} == {"collided", "busy"}


def jammed(rig, from_ns, to_ns, power_dbm, node=1):
    tokens = []
    rig.at(from_ns, lambda: tokens.append(rig.medium.jam({node: dbm_to_mw(power_dbm)})))
    if to_ns is not None:
        rig.at(to_ns, lambda: rig.medium.unjam(tokens[0]))
    return rig


@pytest.mark.parametrize(
    ("from_ns", "to_ns", "outcome"),
    [
        (0, 1 * MS, "received"),  # over at the very start of the frame
        (0, None, "jammed"),  # its preamble is not caught
        (2 * MS, None, "jammed"),  # some of its bits are lost
        (1 * MS + airtime_ns(50), None, "received"),  # begins when it is over
    ],
)
def test_a_jammer_takes_what_it_overlaps(from_ns, to_ns, outcome):
    rig = jammed(Rig(mesh(2), luck=0.5), from_ns, to_ns, -50.0)
    rig.on_air(1 * MS, 0)
    assert rig.run().outcomes() == [{1: outcome}]


def test_a_frame_that_is_too_weak_anyway_is_not_called_jammed():
    rig = jammed(Rig({(0, 1): NOISE_DBM - 4.0}, luck=1.0 - 1e-9), 0, None, -50.0)
    rig.on_air(1 * MS, 0)
    assert rig.run().outcomes() == [{1: "weak"}]


def test_a_jammer_is_heard_by_channel_assessment_until_it_has_been_silent_for_as_long():
    rig = jammed(Rig(mesh(2)), 1 * MS, 2 * MS, -60.0)
    busy = []
    for time_us in (1000, 1001, 1999, 2127, 2128):
        rig.at(time_us * US, lambda time_us=time_us: busy.append((time_us, rig.medium.is_busy(1))))
    rig.run()
    assert busy == [(1000, False), (1001, True), (1999, True), (2127, True), (2128, False)]
    assert not rig.medium.is_busy(1, mode="carrier")


class Steps:
    """Noise that is `loud_dbm` in odd milliseconds."""

    def __init__(self, size, loud_dbm, quiet_dbm=NOISE_DBM, step_ns=MS):
        self.step_ns = step_ns
        self._powers = [np.full(size, dbm_to_mw(power_dbm)) for power_dbm in (quiet_dbm, loud_dbm)]

    @property
    def typical_mw(self):
        return self._powers[0]

    def power_mw(self, step):
        return self._powers[step % 2]


def varying(loud_dbm):
    return lambda clock, paths, log: SinrMedium(clock, paths, Steps(len(paths), loud_dbm), log)


@given(start_us=st.integers(0, 3000), luck=st.floats(0.0, 1.0, exclude_max=True))
def test_each_stretch_of_noise_counts_with_its_own_bits(start_us, luck):
    """The chance is the product over the milliseconds; the preamble's five bytes do not count."""
    loud_dbm, signal_dbm, psdu_byte = NOISE_DBM + 3.0, NOISE_DBM + 1.0, 60
    start_ns = MS + start_us * US
    begin_us, end_us = start_ns / US + 5 * 32, (start_ns + airtime_ns(psdu_byte)) / US
    chance = 1.0
    for step in range(0, 9):
        overlap_us = max(0.0, min(end_us, (step + 1) * 1000) - max(begin_us, step * 1000))
        noise_dbm = loud_dbm if step % 2 else NOISE_DBM
        chance *= frame_success_probability(10 ** ((signal_dbm - noise_dbm) / 10), 1) ** (overlap_us / 4)
    rig = Rig({(0, 1): signal_dbm}, luck=luck, medium=varying(loud_dbm))
    rig.on_air(start_ns, 0, psdu_byte=psdu_byte)
    (outcome,) = rig.run().outcomes()
    if not math.isclose(luck, chance, rel_tol=1e-3):
        assert outcome == {1: "received" if luck < chance else "weak"}


def test_noise_that_varies_decides_who_can_decode_at_all():
    rig = Rig({(0, 1): NOISE_DBM - 2.0}, medium=varying(NOISE_DBM + 20.0))
    rig.on_air(2 * MS, 0, psdu_byte=12)  # quiet
    rig.on_air(5 * MS, 0, psdu_byte=12)  # loud: below the lock SINR, so not audible
    assert rig.run().outcomes() == [{1: "received"}, {}]


def test_fading_is_drawn_once_a_frame():
    gains = iter([1.0, 1e-6, 1.0])
    medium = lambda clock, paths, log: sinr_medium(  # noqa: E731
        clock, paths, log, fading=lambda source, size: np.full(size, next(gains))
    )
    rig = Rig({(0, 1): -60.0}, medium=medium)
    for number in range(3):
        rig.on_air((1 + 5 * number) * MS, 0)
    assert rig.run().outcomes() == [{1: "received"}, {}, {1: "received"}]
    assert [frame.rx_rssi_dbm for frame in rig.frames] == [[pytest.approx(-60.0)], [], [pytest.approx(-60.0)]]


class Measured:
    """Ratios that a trace says, by time."""

    def __init__(self, ratio_of):
        self.ratio_of = ratio_of

    def ratios(self, source, now_ns):
        return np.array([self.ratio_of(now_ns)])


@pytest.mark.parametrize(("luck", "outcomes"), [(0.29, ["received", "received"]), (0.31, ["weak", "received"])])
def test_measured_ratios_replace_errors_by_noise(luck, outcomes):
    delivery = Measured(lambda now_ns: 0.3 if now_ns < 5 * MS else 0.9)
    rig = Rig({(0, 1): -80.0}, luck=luck, medium=lambda *wiring: sinr_medium(*wiring, delivery=delivery))
    rig.on_air(1 * MS, 0)
    rig.on_air(6 * MS, 0)
    assert [outcome[1] for outcome in rig.run().outcomes()] == outcomes


def test_interference_comes_on_top_of_measured_ratios():
    rig = Rig(
        {(0, 1): -80.0, (2, 1): -75.0},
        luck=0.01,
        medium=lambda *wiring: sinr_medium(*wiring, delivery=Measured(lambda now_ns: 1.0)),
    )
    rig.on_air(1 * MS, 0)
    rig.on_air(2 * MS, 2)
    assert rig.run().outcomes() == [{1: "collided"}, {1: "busy"}]


class Cut:
    """Whatever node 2 should decode is cut."""

    def verdicts(self, source, listeners, frame, now_ns):
        return np.where(listeners == 2, OUTCOME_CODE["outage"], -1)


@pytest.mark.parametrize("medium", [None, lambda clock, paths, log: IdealMedium(clock, paths, 0, log)])
def test_fault_rules_take_what_would_have_been_decoded(medium):
    rig = Rig(mesh(3), medium=medium)
    rig.medium.faults = Cut()
    rig.on_air(1 * MS, 0)
    assert rig.run().outcomes() == [{1: "received", 2: "outage"}]
    assert [(node, source) for _, node, source in rig.received] == [(1, 0)]


@pytest.mark.parametrize("medium", [None, lambda clock, paths, log: IdealMedium(clock, paths, 0, log)])
def test_links_can_change_while_a_frame_is_on_the_air(medium):
    rig = Rig({(0, 1): -60.0, (0, 2): -60.0, (1, 0): -60.0, (2, 0): -60.0}, medium=medium)
    rig.on_air(1 * MS, 0)
    rig.at(2 * MS, lambda: rig.medium.replace_links(0, [Link(2, dbm_to_mw(-65.0), True)]))
    rig.on_air(6 * MS, 0)
    assert rig.run().outcomes() == [{1: "received", 2: "received"}, {2: "received"}]
    assert rig.frames[1].rx_rssi_dbm == [pytest.approx(-65.0)]
    if isinstance(rig.medium, SinrMedium):
        assert not rig.medium.is_busy(1)
        assert not rig.medium.is_busy(2)


def test_the_success_of_a_link_is_binomial_without_interference_too():
    links = {0: [Link(1, dbm_to_mw(-60.0), True, 0.7)], 1: []}
    rig = Rig(
        {(0, 1): -60.0, (1, 0): -60.0},
        luck=lambda node: np.random.default_rng(5),
        medium=lambda clock, paths, log: IdealMedium(clock, links, 0, log),
    )
    count = 2000
    for number in range(count):
        rig.on_air((1 + 3 * number) * MS, 0)
    rig.run(3 * (count + 2) * MS)
    received = sum(outcome == {1: "received"} for outcome in rig.outcomes())
    assert abs(received - 0.7 * count) < 2.58 * math.sqrt(count * 0.7 * 0.3)
