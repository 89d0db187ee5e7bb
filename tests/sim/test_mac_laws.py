"""What holds of every MAC whatever is asked of it: one fate a job, energy that closes, a radio that does as it can."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sim_rig import MS, Rig

from netsim.api import BROADCAST
from netsim.rng import Streams
from netsim.sim.air import Uniforms
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.mac.aloha import AlohaMac, AlohaParameters
from netsim.sim.mac.csma import CsmaMac, CsmaParameters
from netsim.sim.mac.ideal import IdealMac
from netsim.sim.mac.lpl import LplMac
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.slots import slot_plans
from netsim.sim.mac.tdma import TdmaMac, TdmaParameters
from netsim.trace.events import RADIO_STATES, Frame, RadioState

NODES = 4
HORIZON_MS = 120_000
FOLLOWS = {
    "off": {"listen"},
    "listen": {"receive", "switch", "sleep", "idle", "listen"},
    # of preambles that begin at one instant the strongest is caught, whichever is met first
    "receive": {"listen", "receive", "switch", "sleep", "idle"},
    # to transmit, to listen, or straight on into the next turnaround
    "switch": {"transmit", "listen", "receive", "switch", "sleep", "idle"},
    "transmit": {"switch", "transmit"},
    "sleep": {"switch"},
    "idle": {"switch", "sleep"},
}
"""What state can come after what; dead can after any."""


def ideal(rig, draws):
    return lambda station, _, deliver: IdealMac(station.radio, deliver)


def csma(rig, draws, **parameters):
    given = CsmaParameters(**parameters)

    def make(station, _, deliver):
        node = station.radio.node
        return CsmaMac(rig.clock, station.radio, rig.assess(node), draws(node), given, deliver)

    return make


def aloha(rig, draws, **parameters):
    given = AlohaParameters(**parameters)
    return lambda station, _, deliver: AlohaMac(rig.clock, station.radio, draws(station.radio.node), given, deliver)


def tdma(rig, draws, **parameters):
    plans = slot_plans({node: [link.destination for link in links] for node, links in rig.paths.items()})
    given = TdmaParameters(**parameters)
    return lambda station, _, deliver: TdmaMac(
        rig.clock, station.radio, 0, given, plans[station.radio.node], deliver, sense(rig, station)
    )


def sense(rig, station):
    """Over the ideal medium nothing can be sensed."""
    return None if isinstance(rig.medium, IdealMedium) else rig.assess(station.radio.node)


def lpl(rig, draws, **parameters):
    given = LplParameters(**parameters)

    def make(station, _, deliver):
        node = station.radio.node
        return LplMac(rig.clock, station.radio, rig.assess(node), draws(node), given, deliver)

    return make


MACS = {
    "ideal": (ideal, {}),
    "csma": (csma, {}),
    "csma without": (csma, {"acknowledge": False, "queue_frames": 1}),
    "aloha": (aloha, {}),
    "aloha answered": (aloha, {"acknowledge": True, "initial_delay_s": 0.01}),
    "aloha limited": (aloha, {"acknowledge": True, "duty_cycle": 0.1}),
    "tdma": (tdma, {}),
    "tdma awake": (tdma, {"listen": "always", "acknowledge": False}),
    "x-mac": (lpl, {}),
    "x-mac fast": (lpl, {"wake_interval_ms": 20, "acknowledge": False, "queue_frames": 1}),
    "b-mac": (lpl, {"variant": "b-mac", "wake_interval_ms": 50}),
}

jobs = st.lists(
    st.tuples(
        st.integers(0, 400_000),  # time in us
        st.integers(0, NODES - 1),
        st.sampled_from([*range(NODES), BROADCAST]),
        st.integers(0, 116),
    ),
    max_size=12,
)
links = st.lists(st.floats(-104.0, -50.0), min_size=NODES * (NODES - 1), max_size=NODES * (NODES - 1))
naps = st.lists(st.tuples(st.integers(0, 500_000), st.integers(0, NODES - 1), st.booleans()), max_size=4)


def pairs(powers_dbm):
    ordered = [(a, b) for a in range(NODES) for b in range(NODES) if a != b]
    return dict(zip(ordered, powers_dbm, strict=True))


def built(name, powers_dbm, seed, capacity_j=None, medium=None):
    streams = Streams(seed)
    rig = Rig(
        pairs(powers_dbm),
        luck=lambda node: streams.generator(f"luck/{node}"),
        capacity_j=capacity_j,
        full=True,
        medium=medium,
    )
    make, parameters = MACS[name]
    return rig.add(make(rig, lambda node: Uniforms(streams.generator(f"draws/{node}")).next, **parameters))


def played(rig, wanted, rests):
    fates = []
    for time_us, source, destination, size in wanted:
        if source != destination:
            fates.append(rig.submit(time_us * 1000, source, destination, bytes([time_us % 256]) * size))
    for time_us, node, sleeps in rests:
        mac = rig.stations[node].mac
        rig.at(time_us * 1000, mac.sleep if sleeps else mac.wake)
    return fates


def run_out(rig, fates):
    """Run until every job has its fate and the last acknowledgements are over, at most to the horizon."""
    for until_ms in range(600, HORIZON_MS, 200):
        rig.run(until_ms * MS)
        if all(fates):
            break
    rig.run(rig.clock.now_ns + 50 * MS)


def check_radios(rig):
    for node in rig.stations:
        states = ["off", *[RADIO_STATES[event.state] for _, event in rig.log.of(RadioState) if event.node == node]]
        for before, after in pairwise(states):
            assert after == "dead" or before == "dead" == after or after in FOLLOWS[before], (node, before, after)
        frames = sorted((event for _, event in rig.log.of(Frame) if event.source == node), key=lambda f: f.t_start_ns)
        assert all(one.t_end_ns <= other.t_start_ns for one, other in pairwise(frames))


def check_energy(rig):
    for node, station in rig.stations.items():
        station.meter.settle()
        station.radio.settle()
        station.battery.check_closure(station.account, node)
        assert sum(entry.time_ns for entry in station.account.entries.values()) == rig.clock.now_ns
        assert all(entry.time_ns >= 0 for entry in station.account.entries.values())


@pytest.mark.parametrize("name", MACS)
@given(wanted=jobs, powers_dbm=links, rests=naps, seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_every_job_has_one_fate_and_energy_closes(name, wanted, powers_dbm, rests, seed):
    rig = built(name, powers_dbm, seed)
    fates = played(rig, wanted, rests)
    run_out(rig, fates)
    assert all(len(fate) == 1 for fate in fates)
    assert all(station.mac.pending == 0 for station in rig.stations.values())
    for ((_, delivery),) in fates:
        assert delivery.acknowledged is (delivery.reason == "")
        assert delivery.reason in ("", "no_ack", "channel_busy", "queue_full")
        assert delivery.attempts <= 4
    check_radios(rig)
    check_energy(rig)


@pytest.mark.parametrize("name", MACS)
@given(wanted=jobs, powers_dbm=links, seed=st.integers(0, 1000), lives_us=st.lists(st.integers(1, 400_000), min_size=4))
@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_death_stops_a_mac_whatever_it_does(name, wanted, powers_dbm, seed, lives_us):
    capacity_j = {node: lives_us[node] * 56.4e-9 for node in range(NODES - 1)}
    rig = built(name, powers_dbm, seed, capacity_j)
    fates = played(rig, wanted, [])
    rig.run(700 * MS)
    assert all(len(fate) <= 1 for fate in fates)
    for node in range(NODES - 1):
        if rig.stations[node].battery.is_empty:
            assert rig.stations[node].radio.state == "dead"
            assert rig.states_after_death(node) == []
    check_radios(rig)
    check_energy(rig)


@pytest.mark.parametrize("name", [name for name in MACS if "mac" not in name])
@given(wanted=jobs, seed=st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_over_the_ideal_medium_everything_that_is_addressed_to_an_awake_node_arrives(name, wanted, seed):
    """A job that its sender counts as done was delivered to whom it was addressed."""
    rig = built(name, [-60.0] * 12, seed, medium=lambda clock, paths, log: IdealMedium(clock, paths, 0, log))
    fates = played(rig, wanted, [])
    run_out(rig, fates)
    assert all(len(fate) == 1 for fate in fates)
    asked = Counter()
    for (_, source, destination, _), ((_, delivery),) in zip(
        [job for job in wanted if job[1] != job[2]], fates, strict=True
    ):
        if delivery.acknowledged:
            asked.update(
                [(source, node) for node in range(NODES) if node != source and destination in (node, BROADCAST)]
            )
    arrived = Counter((source, node) for _, node, source, _ in rig.delivered)
    assert all(arrived[pair] >= count for pair, count in asked.items())


@pytest.mark.parametrize("name", MACS)
def test_equal_draws_give_equal_runs(name):
    powers_dbm = np.random.default_rng(5).uniform(-95, -55, 12).tolist()
    logs = []
    for _ in range(2):
        rig = built(name, powers_dbm, 7)
        played(rig, [(1000 * number, number % 4, (number + 1) % 4, 20 + number) for number in range(8)], [])
        rig.run(3000 * MS)
        logs.append([(time_ns, repr(event)) for time_ns, event in rig.log.events])
    assert logs[0] == logs[1]
