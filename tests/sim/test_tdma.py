"""TDMA: who has which slot, what happens in it to the microsecond, who sleeps, and what drifting clocks do."""

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sim_rig import MS, US, Rig, mesh, outcomes_of, sorted_frames

from netsim.api import BROADCAST
from netsim.errors import ScenarioError
from netsim.sim.mac.slots import SlotPlan, slot_plans
from netsim.sim.mac.tdma import TdmaMac, TdmaParameters

WAKE_US = 860 + 192  # the oscillator starts, then the synthesiser locks
LEAD_US = 1000 + 192  # guard, turnaround
EXCHANGE_US = 1792 + 192 + 352


class Skewed:
    """A clock that is ahead by so much at time 0 and gains so many parts per million."""

    def __init__(self, clock, ahead_ns=0, ppm=0):
        self.clock, self.ahead_ns, self.ppm = clock, ahead_ns, ppm

    def shown_at(self, now_ns):
        return now_ns + now_ns * self.ppm // 10**6 + self.ahead_ns

    def local_ns(self):
        return self.shown_at(self.clock.now_ns)

    def delay_until(self, local_ns):
        delay_ns = max(0, (local_ns - self.local_ns()) * 10**6 // (10**6 + self.ppm) - 2)
        while self.shown_at(self.clock.now_ns + delay_ns) < local_ns:
            delay_ns += 1
        return delay_ns


def tdma(rig, local=None, frame_slots=None, sensed=True, **parameters):
    settings = TdmaParameters(frame_slots=frame_slots, **parameters)
    neighbours = {node: [] for node in rig.stations}
    for node, links in rig.paths.items():
        neighbours[node] = [link.destination for link in links]
    plans = slot_plans(neighbours, frame_slots)
    return rig.add(
        lambda station, uniform, deliver: TdmaMac(
            rig.clock,
            station.radio,
            0,
            settings,
            plans[station.radio.node],
            deliver,
            rig.assess(station.radio.node) if sensed else None,
            (local or {}).get(station.radio.node),
        )
    )


def starts_us(rig, source):
    return [frame.t_start_ns / US for frame in sorted_frames(rig.frames) if frame.source == source]


# --- slots ----------------------------------------------------------------------------------------------------------


def test_a_chain_needs_three_slots_and_uses_them_again():
    chain = {node: [node + 1] if node < 6 else [] for node in range(7)}
    plans = slot_plans(chain)
    assert {plan.frame_slots for plan in plans.values()} == {3}
    own = [plans[node].own for node in range(7)]
    assert all(len({a, b, c}) == 3 for a, b, c in zip(own, own[1:], own[2:], strict=False))
    assert [sorted(plans[node].heard) for node in range(1, 6)] == [
        sorted({0, 1, 2} - {own[node]}) for node in range(1, 6)
    ]


@given(st.integers(0, 2**32 - 1), st.integers(1, 25), st.floats(0.0, 0.5))
@settings(max_examples=60, deadline=None)
def test_nobody_within_two_hops_has_the_same_slot(seed, count, density):
    graph = nx.gnp_random_graph(count, density, seed=seed, directed=True)
    plans = slot_plans({node: list(graph[node]) for node in graph})
    near = nx.power(graph.to_undirected(), 2)
    assert all(plans[a].own != plans[b].own for a, b in near.edges)
    assert plans == slot_plans({node: list(graph[node])[::-1] for node in reversed(list(graph))})
    most = max(dict(near.degree).values(), default=0)
    assert all(plan.frame_slots <= most + 1 for plan in plans.values())
    for node, plan in plans.items():
        assert plan.heard == {plans[other].own for other in graph.to_undirected()[node]}
        assert plan.own not in plan.heard


def test_slots_repeat():
    plan = SlotPlan(own=1, frame_slots=4, heard=frozenset({0, 2, 3}))
    assert [plan.next_own(index) for index in range(6)] == [1, 1, 5, 5, 5, 5]
    assert [plan.next_heard(index) for index in range(6)] == [0, 2, 2, 3, 4, 6]
    assert SlotPlan(0, 1, frozenset()).next_heard(3) is None


def test_too_few_slots_are_refused():
    with pytest.raises(ScenarioError, match=r"at least 3 slots.* got 2"):
        slot_plans({0: [1, 2], 1: [2], 2: []}, 2)


# --- one exchange ---------------------------------------------------------------------------------------------------


def test_an_exchange_in_the_senders_slot_every_instant():
    """Three nodes, slots 0, 1, 2 of 10 ms; node 1 sends to node 2."""
    rig = tdma(Rig(mesh(3), full=True))
    fate = rig.submit(0, 1, 2)
    rig.run(60 * MS)
    data, ack = rig.frames
    assert (data.t_start_ns / US, data.t_end_ns / US) == (10_000 + LEAD_US, 10_000 + LEAD_US + 1792)
    assert (ack.t_start_ns / US, ack.t_end_ns / US) == (10_000 + LEAD_US + 1984, 10_000 + LEAD_US + EXCHANGE_US)
    ((done_ns, delivery),) = fate
    assert (done_ns, delivery.acknowledged, delivery.attempts) == (ack.t_end_ns, True, 1)
    # node 1 hears slots 0 and 2 and looks for 2.32 ms into them; it is on in its own for the exchange
    listen, sleep, switch, transmit = 2, 1, 5, 4
    by_state = [entry for entry in rig.states(1) if entry[1] in (sleep, transmit) or entry[1] == listen]
    assert by_state == [
        (0, listen),
        (2320, sleep),
        (10_000, listen),
        (11_192, transmit),
        # the acknowledgement begins when the receiver is ready again
        *[entry for entry in by_state if entry[0] == 13_176],
        (13_528, listen),
        (13_528, sleep),
        (20_000, listen),
        (22_320, sleep),
        (30_000, listen),
        (32_320, sleep),
        (50_000, listen),
        (52_320, sleep),
    ]
    assert switch in {state for _, state in rig.states(1)}


def test_an_idle_node_pays_for_the_slots_of_its_neighbours():
    """Two nodes, two slots: of every 20 ms it listens for two guard times, a turnaround and an assessment, 2.32 ms.

    CC2420 at 3 V: 56.4 mW listening, 0.06 asleep; waking draws 1.278 mW for 860 us, then 56.4 for 192 us. Where nothing
    can be sensed it listens for all 10 ms of a slot.
    """
    for sensed, listen_us in ((True, 2320), (False, 10_000)):
        rig = tdma(Rig(mesh(2)), sensed=sensed)
        rig.run(2000 * MS)
        # node 0 hears slot 1: wakes at 8.948, 28.948, ..., listens from 10, 30, ...
        booked = rig.stations[0].ledger_uj()
        assert {state: time_us for (state, _), (_, time_us) in booked.items()} == {
            "wake": 100 * WAKE_US,
            "listen": 100 * listen_us,
            "sleep": 100 * (20_000 - WAKE_US - listen_us),
        }
        assert rig.stations[0].battery.used_j * 1e6 == pytest.approx(
            100 * (860e-3 * 1.278 + (192 + listen_us) * 1e-3 * 56.4 + (18_948 - listen_us) * 1e-3 * 0.06), rel=1e-12
        )


def test_always_listening_costs_what_listening_costs():
    rig = tdma(Rig(mesh(2)), listen="always")
    rig.run(100 * MS)
    assert rig.stations[0].ledger_uj() == {("listen", ""): (pytest.approx(5640.0), 100_000)}


def test_one_frame_a_slot_and_retries_a_frame_later():
    rig = tdma(Rig({(0, 1): -60.0}))
    fates = [rig.submit(0, 0, 1, b"a"), rig.submit(0, 0, BROADCAST, b"b")]
    rig.run(500 * MS)
    assert starts_us(rig, 0) == [20_000 * number + LEAD_US for number in range(1, 6)]
    assert [delivery.reason for ((_, delivery),) in fates] == ["no_ack", ""]
    assert [packet for _, _, _, packet in rig.delivered] == [b"a", b"b"]


def test_a_queue_is_bounded():
    rig = tdma(Rig(mesh(2)), queue_frames=2)
    fates = [rig.submit(0, 0, 1) for _ in range(5)]
    rig.run(500 * MS)
    assert [delivery.reason for ((_, delivery),) in fates] == ["", "", "", "queue_full", "queue_full"]


def test_a_node_that_was_told_to_sleep_misses_its_neighbours_but_sends():
    rig = tdma(Rig(mesh(2)))
    rig.at(0, rig.stations[0].mac.sleep)
    missed = rig.submit(1 * MS, 1, 0, b"x")
    fate = rig.submit(100 * MS, 0, 1, b"y")
    rig.at(400 * MS, rig.stations[0].mac.wake)
    heard = rig.submit(420 * MS, 1, 0, b"z")
    rig.run(600 * MS)
    assert missed[0][1].reason == "no_ack"
    assert fate[0][1].acknowledged
    assert heard[0][1].acknowledged
    assert [packet for _, _, _, packet in rig.delivered] == [b"y", b"z"]


def test_saturated_neighbours_do_not_collide():
    """Six nodes in a ring of which each hears two on either side, all with full queues: every frame is acknowledged."""
    ring = {(a, (a + step) % 6): -60.0 for a in range(6) for step in (1, 2, 4, 5)}
    rig = tdma(Rig(ring), slot_ms=7.0)
    fates = [rig.submit(0, node, (node + 1) % 6, bytes(116)) for node in range(6) for _ in range(10)]
    rig.run(2000 * MS)
    assert all(delivery.acknowledged and delivery.attempts == 1 for ((_, delivery),) in fates)
    assert {name for frame in rig.frames for name in outcomes_of(frame).values()} <= {"received", "overheard", "asleep"}


# --- clocks ---------------------------------------------------------------------------------------------------------


def skewed(late_ms, **parameters):
    """Nodes 0 and 1 send full frames to node 2 in slots of the least length; 0 is late and 1 is early by so much."""
    rig = Rig(mesh(3) | {(1, 2): -50.0}, luck=0.5)
    late_ns = round(late_ms * MS)
    local = {0: Skewed(rig.clock, -late_ns), 1: Skewed(rig.clock, late_ns)}
    tdma(rig, local, slot_ms=6.992, **parameters)
    fates = [rig.submit(30 * MS, node, 2, bytes(116)) for node in (0, 1)]
    rig.run(1000 * MS)
    return rig, fates


@pytest.mark.parametrize("late_ms", [-1.0, -0.5, 0.0, 0.5, 1.0])
def test_clocks_within_the_guard_time_do_no_harm(late_ms):
    _, fates = skewed(late_ms)
    assert [(delivery.acknowledged, delivery.attempts) for ((_, delivery),) in fates] == [(True, 1), (True, 1)]


@pytest.mark.parametrize(("late_ms", "attempts"), [(1.0, 1), (1.001, 2)])
def test_beyond_the_guard_time_a_listener_is_not_back_in_time(late_ms, attempts):
    """Node 2 is back from its acknowledgement to 0 at 6.184 + d of slot 0; the frame of 1 begins at 8.184 - d."""
    rig, fates = skewed(late_ms)
    assert [fate[0][1].attempts >= attempts for fate in fates] == [True, True] if attempts == 1 else [False, True]
    second = next(frame for frame in sorted_frames(rig.frames) if frame.source == 1)
    assert outcomes_of(second)[2] == ("received" if attempts == 1 else "half_duplex")


def test_further_beyond_it_listeners_have_left():
    """By 2.32 ms they have heard nothing of a frame that begins at 1.192 + 2."""
    rig, _ = skewed(2.0, max_retries=1)
    assert [outcome[2] for outcome in rig.outcomes(0)] == ["asleep", "asleep"]


def test_frames_meet_on_the_air_if_listeners_stay():
    """The frame to 0 ends at 5.448 + d of slot 0, that of 1 begins at 8.184 - d: they meet from d = 1.368 on."""
    rig, _ = skewed(2.0, max_retries=1, listen="always")
    first, second = sorted_frames([frame for frame in rig.frames if not frame.is_ack])[:2]
    assert (first.source, second.source) == (0, 1)
    assert first.t_start_ns < second.t_start_ns < first.t_end_ns
    assert outcomes_of(first)[2] == "collided"


def test_drift_leads_out_of_the_guard_time():
    """Plus and minus 50 ppm make 1 ms each after 20 s: until then every exchange succeeds at once.

    After it those fail in which slot 1 follows slot 0; in the others slot 2 lies between them.
    """
    rig = Rig(mesh(3), luck=0.5)
    local = {0: Skewed(rig.clock, ppm=-50), 1: Skewed(rig.clock, ppm=50)}
    tdma(rig, local, slot_ms=6.992, max_retries=0)
    fates = [[rig.submit(second * 1000 * MS, node, 2, bytes(116)) for node in (0, 1)] for second in range(30)]
    rig.run(32_000 * MS)
    lost = [second for second, pair in enumerate(fates) if not all(fate[0][1].acknowledged for fate in pair)]
    assert min(lost) == 20
    assert len(lost) > 5


def test_a_clock_that_is_set_back_or_forward_finds_its_slot_again():
    rig = Rig(mesh(2))
    clock = Skewed(rig.clock)
    tdma(rig, {0: clock})
    for at_ms, ahead_ms in ((205, 3000), (405, -2000), (605, 0)):
        rig.at(at_ms * MS, lambda ahead_ms=ahead_ms: setattr(clock, "ahead_ns", ahead_ms * MS))
    fates = [rig.submit((100 + 200 * number) * MS, 0, 1) for number in range(5)]
    back = rig.submit(910 * MS, 1, 0)
    rig.run(1500 * MS)
    assert all(fate[0][1].acknowledged for fate in [*fates, back])
