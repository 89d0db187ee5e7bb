"""What must hold of every run, on scenarios that differ in medium, MAC, batteries and what the nodes do."""

import math
from collections import Counter, defaultdict

import pytest
from scenarios_for_tests import ROOT, run, small

from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.testing import run_algorithm
from netsim.trace.events import (
    BROADCAST,
    OUTCOMES,
    AlgorithmRecord,
    EnergyLedger,
    Frame,
    LinkTable,
    Log,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeEnergy,
    NodeLife,
    RadioState,
)

TOGETHER = '{type: "sim_algorithms:Together"}'
SCENARIOS = {
    "quickstart": lambda folder: load(ROOT / "scenarios" / "quickstart.yaml"),
    "crowded": lambda folder: small(folder, algorithm=TOGETHER),
    "dying": lambda folder: small(folder, algorithm=TOGETHER, battery="{type: capacity, energy_j: 0.0225}"),
    "sparse": lambda folder: small(folder, spacing_m=28, battery="{type: device, device: coin_cell}"),
    "ideal": lambda folder: small(
        folder,
        algorithm=TOGETHER,
        medium="{type: ideal, delay_s: 0.0001, loss_probability: 0.2}",
        mac="{type: ideal}",
        network="{type: one-hop}",
    ),
    "aloha": lambda folder: small(folder, algorithm=TOGETHER, mac="{type: aloha, acknowledge: true, duty_cycle: 0.2}"),
    "tdma": lambda folder: small(folder, algorithm=TOGETHER, mac="{type: tdma}"),
    "tdma-dying": lambda folder: small(
        folder, algorithm=TOGETHER, mac="{type: tdma}", battery="{type: capacity, energy_j: 0.0225}"
    ),
    "x-mac": lambda folder: small(folder, algorithm=TOGETHER, mac="{type: lpl, wake_interval_ms: 20}"),
    "x-mac-dying": lambda folder: small(
        folder, algorithm=TOGETHER, mac="{type: lpl}", battery="{type: capacity, energy_j: 0.0225}"
    ),
    "b-mac": lambda folder: small(folder, algorithm=TOGETHER, mac="{type: lpl, variant: b-mac, wake_interval_ms: 20}"),
    "constrained": lambda folder: small(
        folder,
        algorithm=TOGETHER,
        battery="{type: capacity, energy_j: 0.02}",
        more="    clock: {drift_sd_ppm: 300, offset_sd_s: 0.001}\n"
        "    budget: {allowance_j: 0.003, per: 0.1, policy: sleep}\n"
        "    duty_cycle: {period_s: 0.07, on_s: 0.05}\n",
    ),
    "discovering": lambda folder: small(
        folder,
        algorithm=TOGETHER,
        battery="{type: capacity, energy_j: 0.0225}",
        network="{type: shortest-path, update_s: 0.1, discovery: {type: beacons, period_s: 0.02}}",
    ),
    "ideal-csma": lambda folder: small(folder, algorithm=TOGETHER, medium="{type: ideal, delay_s: 0}"),
}


@pytest.fixture(scope="module", params=SCENARIOS)
def finished(request, tmp_path_factory):
    """(events, simulation) of a scenario that has run to its end."""
    return run(SCENARIOS[request.param](tmp_path_factory.mktemp("run")))


def of(events, event_type):
    return [(time_ns, event) for time_ns, event in events if isinstance(event, event_type)]


def test_log_times_are_whole_and_never_decrease(finished):
    times = [time_ns for time_ns, _ in finished[0]]
    assert all(type(time_ns) is int for time_ns in times)
    assert times == sorted(times)
    assert finished[1].now_ns >= times[-1]


def test_frames_last_their_airtime_and_are_recorded_at_their_end(finished):
    events, _ = finished
    deaths = {event.node: time_ns for time_ns, event in of(events, NodeLife) if event.event == "died"}
    frames = of(events, Frame)
    assert frames
    for _, frame in frames:
        whole_ns = (6 + frame.size_byte) * 32_000
        lasted_ns = frame.t_end_ns - frame.t_start_ns
        assert lasted_ns == whole_ns or (lasted_ns < whole_ns and deaths[frame.source] == frame.t_end_ns)
    ids = [frame.frame_id for _, frame in frames]
    assert len(set(ids)) == len(ids)


def test_every_frame_has_one_outcome_at_every_audible_node(finished):
    """Audible is what the medium can decode: at least every neighbour, and the same nodes each time."""
    events, _ = finished
    ((_, table),) = of(events, LinkTable)
    neighbours = defaultdict(set)
    for source, destination in zip(table.source, table.destination, strict=True):
        neighbours[source].add(destination)
    audible = {}
    for _, frame in of(events, Frame):
        assert len(frame.rx_node) == len(set(frame.rx_node)) == len(frame.rx_outcome)
        assert audible.setdefault(frame.source, set(frame.rx_node)) == set(frame.rx_node)
        assert neighbours[frame.source] <= set(frame.rx_node)
        assert frame.source not in frame.rx_node
        for node, code in zip(frame.rx_node, frame.rx_outcome, strict=True):
            mine = frame.destination in (node, BROADCAST)
            assert OUTCOMES[code] not in (("overheard",) if mine else ("received",))


def test_messages_are_delivered_at_most_once_and_only_after_they_were_sent(finished):
    events, _ = finished
    sent = {event.message_id: (time_ns, event) for time_ns, event in of(events, MessageSent)}
    delivered = of(events, MessageDelivered)
    assert delivered
    assert max(Counter((event.message_id, event.node) for _, event in delivered).values()) == 1
    for time_ns, event in delivered:
        sent_ns, origin = sent[event.message_id]
        assert origin.destination in (event.node, BROADCAST)
        assert (event.source, event.kind, event.size_byte) == (origin.source, origin.kind, origin.size_byte)
        assert event.latency_ns == time_ns - sent_ns > 0
    for time_ns, origin in sent.values():
        assert all(cause in sent and sent[cause][0] < time_ns for cause in origin.causes)


def test_a_delivery_follows_a_frame_of_that_message_received_there(finished):
    events, _ = finished
    received = set()
    for _, event in events:
        if isinstance(event, Frame) and not event.is_ack:
            received |= {
                (event.message_id, node)
                for node, code in zip(event.rx_node, event.rx_outcome, strict=True)
                if OUTCOMES[code] == "received"
            }
        elif isinstance(event, MessageDelivered):
            assert (event.message_id, event.node) in received


def acting_node(event):
    """Who does something in an event; None where nobody does."""
    if isinstance(event, Frame | MessageSent):
        return event.source
    acts = isinstance(event, RadioState | NodeLife | MessageDelivered | MessageDropped | AlgorithmRecord)
    return event.node if acts else None


def test_the_dead_do_nothing(finished):
    events, simulation = finished
    dead = {}
    for time_ns, event in events:
        node = acting_node(event)
        if node in dead:
            # at the instant of its death its radio goes off and its frame is cut short; a whole frame ends with it
            assert time_ns == dead[node]
            assert isinstance(event, RadioState | Frame)
        if isinstance(event, NodeLife) and event.event == "died":
            dead[node] = time_ns
    for node in dead:
        assert simulation.nodes[node].parts.radio.state == "dead"
        assert simulation.nodes[node].parts.battery.is_empty


def test_energies_close_and_no_time_is_missing(finished):
    events, simulation = finished
    ((end_ns, ledger),) = of(events, EnergyLedger)
    rows = list(zip(ledger.node, ledger.device, ledger.state, ledger.kind, ledger.energy_j, ledger.time_s, strict=True))
    _, energy = of(events, NodeEnergy)[-1]
    for node, consumed_j, left_j in zip(energy.node, energy.consumed_j, energy.left_j, strict=True):
        booked_j = math.fsum(row[4] for row in rows if row[0] == node)
        assert booked_j == pytest.approx(consumed_j, rel=1e-9)
        capacity_j = simulation.nodes[node].parts.battery.capacity_j
        assert left_j == pytest.approx(capacity_j - consumed_j, rel=1e-9, abs=1e-12)
        # a node dies in the nanosecond in which it runs dry: what it draws beyond is less than that
        assert consumed_j <= capacity_j + 100e-3 * 1e-9
    for node, member in simulation.nodes.items():
        booked_ns = Counter()
        for (device, _, _), entry in member.parts.account.entries.items():
            booked_ns[device] += entry.time_ns
        assert set(booked_ns.values()) == {end_ns}, node
        assert {"radio", "cpu"} <= set(booked_ns)


def test_transmit_time_in_the_ledger_is_the_airtime_of_the_frames(finished):
    events, simulation = finished
    airtime_ns = Counter()
    for _, frame in of(events, Frame):
        airtime_ns[frame.source] += frame.t_end_ns - frame.t_start_ns
    for node, member in simulation.nodes.items():
        booked_ns = sum(
            entry.time_ns
            for (_, state, _), entry in member.parts.account.entries.items()
            if state in ("transmit", "retransmit", "ack_transmit", "strobe_transmit")
        )
        assert booked_ns == airtime_ns[node]


# --- death in a whole node ------------------------------------------------------------------------------------------


def test_a_node_dies_at_the_nanosecond_computed_by_hand_and_the_run_goes_on(tmp_path):
    """The receiver draws 56.4 mW, the sleeping CPU 1.5 uA at 3 V, 4.5 uW: nobody speaks, so 1 mJ lasts 17.729082 ms."""
    loaded = small(
        tmp_path,
        battery="{type: capacity, energy_j: 0.001}",
        more="  - {name: spare, battery: {type: mains}, placement: {type: grid, rows: 1, columns: 1, spacing_m: 1}}",
        algorithm="{type: neighbour-traffic, period_s: 5, rounds: 1}",
        duration_s=4,
    )
    events, simulation = run(loaded)
    deaths = {event.node: time_ns for time_ns, event in of(events, NodeLife) if event.event == "died"}
    # 1e9 pJ over 56.4045 mW is 17,729,081.899... ns
    silent = {node: time_ns for node, time_ns in deaths.items() if node not in {e.source for _, e in of(events, Frame)}}
    assert len(silent) >= 7
    assert set(silent.values()) == {17_729_082}
    assert 9 not in deaths
    assert simulation.now_ns == 4_000_000_000


class Clinging:
    """Whatever happens, it has a last word."""

    def run(self, node):
        try:
            yield from node.compute(10_000_000)
        finally:
            node.broadcast("last word", b"")
            node.log("done")


def test_clearing_up_happens_before_death():
    run = run_algorithm(Clinging, battery_j=1e-6, duration_s=1.0)
    order = [type(event).__name__ for _, event in run.events if isinstance(event, MessageSent | NodeLife | Log)]
    assert order == ["NodeLife", "NodeLife", *["MessageSent", "Log", "NodeLife"] * 2]
    assert {time_ns for time_ns, event in run.of(NodeLife) if event.event == "died"} == {1_000_000}


def refuse(node, waits):
    """Refuses to be ended: it waits, or raises, while it is cleared up."""
    try:
        yield from node.compute(10_000_000)
    finally:
        if waits:
            yield from node.pause(5)
        raise KeyError("mine")


class Stubborn:
    """Node 0 itself or a task beside it refuses to be ended; node 1 dies later."""

    def __init__(self, how):
        self.waits, self.beside = how

    def run(self, node):
        if node.id == 1:
            yield from node.pause(1_000_000)
        if self.beside:
            node.spawn(refuse(node, self.waits))
            yield from node.compute(10_000_000)
        else:
            yield from refuse(node, self.waits)


@pytest.mark.parametrize("how", [(waits, beside) for waits in (False, True) for beside in (False, True)])
def test_an_algorithm_that_fails_while_it_is_ended_does_not_stop_the_run(how):
    run = run_algorithm(Stubborn, parameters=how, battery_j=1e-6, duration_s=1.0)
    assert [(time_ns, event.node, event.event) for time_ns, event in run.of(NodeLife)][2:] == [
        (1_000_000, 0, "failed"),
        (1_000_000, 0, "died"),
        (2_000_000, 1, "failed"),
        (2_000_000, 1, "died"),
    ]
    assert run.unfinished == ()


def test_two_simulations_share_nothing(tmp_path):
    """Stepping one does not move the other, and their results do not depend on each other."""
    alone = run(small(tmp_path))[0]
    loaded = small(tmp_path)
    built = [build(loaded).simulation for _ in range(2)]
    built[0].run()
    assert built[1].now_ns == 0
    assert repr(run(loaded)[0]) == repr(alone)
