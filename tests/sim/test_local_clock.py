"""A node's clock: exact mappings, drift as drawn, and who is woken when somebody sets it."""

import json
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios_for_tests import Shuffled, run, small
from test_order import by_instant

from netsim.errors import AlgorithmError
from netsim.metrics.collect import metrics_of
from netsim.rng import Streams
from netsim.sim.clock import Clock
from netsim.sim.local_clock import ClockParameters, Line, LocalClock, drawn_clock
from netsim.testing import run_algorithm
from netsim.trace.events import AlgorithmRecord, Frame, Log, NodeClocks

S = 10**9
PPM = 10**6
LINES = st.builds(
    Line, st.integers(-(10**15), 10**15), st.integers(-(10**15), 10**15), st.integers(-(10**6), 10**6), st.just(10**9)
)
READINGS = st.integers(-(10**18), 10**18)


@settings(deadline=None)
@given(LINES, READINGS)
def test_a_line_is_the_exact_rational_rounded_down(line, reading):
    exact = line.shown + (reading - line.since) * (1 + Fraction(line.excess, line.parts))
    assert line.at(reading) == exact.__floor__()


@settings(deadline=None)
@given(LINES, READINGS)
def test_first_is_the_first(line, shown):
    first = line.first(shown)
    assert line.at(first) >= shown > line.at(first - 1)


@settings(deadline=None)
@given(LINES, READINGS, st.integers(0, 10**12))
def test_a_line_never_decreases(line, reading, further):
    assert line.at(reading) <= line.at(reading + further)


@settings(deadline=None)
@given(st.integers(-(10**10), 10**10), st.integers(-300 * PPM, 300 * PPM), READINGS)
def test_there_and_back(offset_ns, drift_ppt, true_ns):
    clock = LocalClock(Clock(), offset_ns, drift_ppt)
    back_ns = clock.true_ns(clock.at(true_ns))
    assert back_ns <= true_ns
    assert clock.at(back_ns) == clock.at(true_ns)
    there_ns = clock.at(clock.true_ns(true_ns))
    assert there_ns >= true_ns > clock.at(clock.true_ns(true_ns) - 1)


def test_a_perfect_clock_shows_true_time():
    true = Clock()
    local = drawn_clock(true, None, Streams(1).generator("node/1/clock"))
    true.environment.run(until=12345)
    assert (local.now_ns, local.counter_ns, local.true_ns(77), local.delay_of(5), local.drifts) == (
        12345,
        12345,
        77,
        5,
        False,
    )


def test_drift_by_hand():
    """30 ppm for a day are 2.592 s."""
    local = LocalClock(Clock(), 500, 30 * PPM)
    assert local.at(86_400 * S) == 86_400 * S + 2_592_000_000 + 500
    assert local.true_ns(86_400 * S + 2_592_000_000 + 500) == 86_400 * S


def test_draws_scale_with_the_spread():
    """Common random numbers: another spread is another scale of the same draws."""

    def drift(sd_ppm):
        generator = Streams(3).generator("node/7/clock")
        return drawn_clock(Clock(), ClockParameters(drift_sd_ppm=sd_ppm), generator).at(10**12) - 10**12

    assert drift(60.0) == pytest.approx(2 * drift(30.0), abs=2)
    assert drift(0.0) == 0


class Waiter:
    """Notes when it was woken."""

    def __init__(self, clock, local, local_ns):
        self.clock, self.woken_ns = clock, None
        clock.process(self.body(local, local_ns))

    def body(self, local, local_ns):
        yield from local.wait_until(local_ns)
        self.woken_ns = self.clock.now_ns


ADJUSTMENTS = st.lists(
    st.tuples(st.integers(1, 800), st.integers(-1000, 1000), st.integers(-(10**6), 10**6)), max_size=6
)


@settings(max_examples=150, deadline=None)
@given(st.integers(-1000, 1000), st.integers(-300 * PPM, 300 * PPM), ADJUSTMENTS, st.integers(1, 4000))
def test_a_waiter_is_woken_at_the_first_instant_at_which_the_clock_shows_its_time(
    offset_ns, drift_ppt, changes, goal_ns
):
    """Against a clock that is looked at every nanosecond."""
    true = Clock()
    local = LocalClock(true, offset_ns, drift_ppt)
    local.drifts = True
    if offset_ns == 0 and drift_ppt == 0:
        local.adjust(0, 0)
    waiter = Waiter(true, local, goal_ns)
    first_ns = None
    pending = list(changes)
    at_ns = pending[0][0] if pending else -1
    while true.now_ns < 20_000 and waiter.woken_ns is None:
        if true.now_ns == at_ns:
            _, step_ns, rate_ppb = pending.pop(0)
            local.adjust(step_ns, rate_ppb)
            at_ns += pending[0][0] if pending else -(10**9)
        if first_ns is None and local.now_ns >= goal_ns:
            first_ns = true.now_ns
        true.environment.run(until=true.now_ns + 1)
    assert waiter.woken_ns == first_ns


DRIFTING = "    clock: {drift_sd_ppm: 30, offset_sd_s: 0.001}"


class Sleeper:
    """Pauses, waits and sleeps by its own clock, and notes what it shows."""

    def run(self, node):
        notes = [node.now_ns]
        yield from node.pause(10 * S)
        notes.append(node.now_ns)
        yield from node.pause_until(15 * S)
        notes.append(node.now_ns)
        yield from node.receive(timeout_ns=2 * S)
        notes.append(node.now_ns)
        node.record(AlgorithmRecord(node.id, "notes", str(notes)))


@pytest.fixture(scope="module")
def drifted(tmp_path_factory):
    loaded = small(tmp_path_factory.mktemp("drift"), more=DRIFTING, algorithm='{type: "test_local_clock:Sleeper"}')
    return loaded, *run(loaded)


def test_a_node_times_everything_by_its_own_clock(drifted):
    _, events, simulation = drifted
    records = [(time_ns, event) for time_ns, event in events if isinstance(event, AlgorithmRecord)]
    assert len(records) == 9
    for time_ns, event in records:
        local = simulation.nodes[event.node].parts.clock
        begin_ns, paused_ns, waited_ns, timed_out_ns = json.loads(event.fields_json)
        assert begin_ns == local.at(0) != 0
        expected = [begin_ns + 10 * S, 15 * S, 17 * S]
        assert [paused_ns, waited_ns, timed_out_ns] == pytest.approx(expected, abs=2)
        assert all(shown >= due for shown, due in zip([paused_ns, waited_ns], expected[:2], strict=True))
        assert local.at(time_ns) == timed_out_ns  # the trace keeps true time


def test_without_synchronisation_the_error_grows_exactly_as_drawn(drifted):
    """At every sample each clock is ahead by its offset and drift times the time, to the nanosecond."""
    _, events, _ = drifted
    samples = [(time_ns, event) for time_ns, event in events if isinstance(event, NodeClocks)]
    assert len(samples) > 15
    for time_ns, event in samples:
        for node, ahead_s in zip(event.node, event.ahead_s, strict=True):
            drift, offset = Streams(1).generator(f"node/{node}/clock").standard_normal(2).tolist()
            expected_ns = round(offset * 0.001 * S) + time_ns * round(drift * 30 * PPM) // 10**12
            assert ahead_s == expected_ns / S


def test_clock_errors_are_measured(drifted):
    _, events, _ = drifted
    figures = metrics_of(events)
    ahead = [ahead_s for _, event in events if isinstance(event, NodeClocks) for ahead_s in event.ahead_s]
    assert figures["clock_error_max_s"] == max(map(abs, ahead))
    assert figures["clock_error_rms_s"] == pytest.approx((sum(a * a for a in ahead) / len(ahead)) ** 0.5)


def test_perfect_clocks_leave_no_trace(tmp_path):
    events, _ = run(small(tmp_path))
    assert not [event for _, event in events if isinstance(event, NodeClocks)]
    assert "clock_error_max_s" not in metrics_of(events)


@pytest.mark.parametrize("seed", [1, 2])
def test_drifting_runs_do_not_depend_on_the_order_within_an_instant(drifted, seed):
    loaded, events, _ = drifted
    assert by_instant(run(loaded, Shuffled(seed))[0]) == by_instant(events)


class Setter:
    """Sets its clock and looks at it."""

    def run(self, node):
        node.adjust_clock(5 * S)
        node.log(f"{node.now_ns} {node.counter_ns}")
        yield from node.pause(S)
        node.adjust_clock(0, 1000)
        yield from node.pause(S)
        node.log(f"{node.now_ns} {node.counter_ns}")
        yield from node.pause_until(6 * S)
        node.adjust_clock(0, 2_000_000)


def test_the_clock_can_be_set_and_the_counter_cannot():
    result = run_algorithm(Setter(), 1)
    lines = [event.message for _, event in result.of(Log)]
    assert lines == [f"{5 * S} 0", f"{7 * S} {2 * S - 999}"]  # ceil(10^9 / (1 + 10^-6)) ns
    with pytest.raises(AlgorithmError, match="at most 1000000 ppb"):
        result.require_success()


class Stamper:
    """Node 0 sends stamps, the others note stamp, frame start and reception."""

    def run(self, node):
        if node.id == 0:
            yield from node.pause(S)
            node.broadcast_stamped("stamp", bytes(8))
            return
        message = yield from node.receive(timeout_ns=3 * S)
        if message is not None:
            stamp_ns = int.from_bytes(message.payload, "little", signed=True)
            note = f"[{stamp_ns}, {message.frame_began_ns}, {message.received_ns}]"
            node.record(AlgorithmRecord(node.id, "stamp", note))


def test_stamps_are_written_and_taken_as_the_frame_begins(tmp_path):
    more = "    clock: {drift_sd_ppm: 30, offset_sd_s: 0.001, stamp_sd_s: 0}"
    loaded = small(tmp_path, more=more, algorithm='{type: "test_local_clock:Stamper"}')
    events, simulation = run(loaded)
    (frame,) = [event for _, event in events if isinstance(event, Frame)]
    notes = [(time_ns, event) for time_ns, event in events if isinstance(event, AlgorithmRecord)]
    assert len(notes) > 1
    for time_ns, event in notes:
        local = simulation.nodes[event.node].parts.clock
        stamp_ns, began_ns, received_ns = json.loads(event.fields_json)
        assert stamp_ns == simulation.nodes[0].parts.clock.at(frame.t_start_ns)
        assert began_ns == local.counter_at(frame.t_start_ns)
        assert received_ns == local.at(frame.t_end_ns)
        assert time_ns == frame.t_end_ns


def test_a_stamp_must_fit_one_frame():
    class Long:
        def run(self, node):
            node.broadcast_stamped("stamp", bytes(33))
            yield from node.pause(1)

    with pytest.raises(AlgorithmError, match="8 to 32 bytes, got 33"):
        run_algorithm(Long(), 2).require_success()
