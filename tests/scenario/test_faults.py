"""The section `faults` of a scenario: what it refuses, and what its rules do to whole runs."""

from collections import Counter

import pytest

from netsim.errors import ScenarioError
from netsim.metrics.collect import metrics_of
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.trace.events import (
    EVENT_TYPES,
    OUTCOMES,
    Association,
    Fault,
    Frame,
    Log,
    MessageDelivered,
    MessageDropped,
    NodeLife,
    TruthOrigins,
)

S = 1_000_000_000
MS = 1_000_000
SINR = "{type: log-distance, shadowing_sd_db: 0}"
TRAFFIC = "{type: neighbour-traffic, period_s: 0.2, rounds: 40}"
SIX = """
kind: scenario
schema_version: 1
name: six
duration_s: {duration_s}
nodes:
  - name: west
    placement: {{type: grid, rows: 3, columns: 1, spacing_m: 10, origin_m: [10, 10]}}
  - name: east
    placement: {{type: grid, rows: 3, columns: 1, spacing_m: 10, origin_m: [20, 10]}}
    {east}
medium: {medium}
algorithm: {algorithm}
faults:
{faults}
"""


def six(folder, *faults, medium=SINR, algorithm=TRAFFIC, duration_s=20, east="", more=""):
    path = folder / "six.yaml"
    rules = "\n".join(f"  - {rule}" for rule in faults)
    text = SIX.format(faults=rules, medium=medium, algorithm=algorithm, duration_s=duration_s, east=east)
    path.write_text((text if faults else text.replace("faults:\n", "")) + more)
    return load(path)


class Events:
    """Every event of a run."""

    def __init__(self, loaded):
        self.all = []
        built = build(loaded, [self])
        self.simulation = built.simulation
        self.simulation.run()
        self.simulation.conclude()

    def handlers(self):
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.all.append((time_ns, event)))

    def of(self, event_type):
        return [(time_ns, event) for time_ns, event in self.all if isinstance(event, event_type)]

    def outcomes(self):
        """(time in ns, sender, listener, outcome) of every frame at every listener."""
        for _, frame in self.of(Frame):
            for node, code in zip(frame.rx_node, frame.rx_outcome, strict=True):
                yield frame.t_end_ns, frame.source, node, OUTCOMES[code]


# --- what is refused ------------------------------------------------------------------------------------------------


def findings(folder, *faults, **settings):
    with pytest.raises(ScenarioError) as caught:
        build(six(folder, *faults, **settings))
    return [str(finding) for finding in caught.value.findings]


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ("{type: crash, nodes: [0, 17], at_s: 1}", ["faults[0].nodes[1]", "17", "ids are 0 to 5"]),
        ("{type: crash, nodes: [eats], at_s: 1}", ["faults[0].nodes[0]", "'eats'", "did you mean `east`?"]),
        ("{type: crash, nodes: [0]}", ["faults[0]", "either at_s or rate_per_h"]),
        ("{type: crash, nodes: [0], at_s: 1, rate_per_h: 2}", ["faults[0]", "either at_s or rate_per_h"]),
        ("{type: outage, links: [[0, 9]]}", ["faults[0].links[0][1]", "9"]),
        ("{type: outage}", ["faults[0]", "links or nodes"]),
        ("{type: outage, nodes: [0], from_s: 2, to_s: 2}", ["faults[0]", "from_s below to_s"]),
        ("{type: outage, nodes: [0], mean_up_s: 2}", ["faults[0]", "mean_up_s and mean_down_s together"]),
        ("{type: partition, groups: [[west], [0, 5]]}", ["faults[0].groups[1]", "node 0 in two"]),
        ("{type: jammer, position_m: [0, 0], power_dbm: 0, on_s: 1}", ["faults[0]", "on_s and off_s together"]),
        ("{type: gilbert-elliott, mean_good_s: 1, mean_bad_s: 1, loss_bad: 2}", ["faults[0].loss_bad"]),
        ("{type: meteor}", ["faults[0].type", "meteor", "crash"]),
    ],
)
def test_what_does_not_fit_is_a_finding_at_its_place(tmp_path, rule, words):
    (finding,) = findings(tmp_path, rule)
    assert "six.yaml:15" in finding
    assert [word for word in words if word not in finding] == []


def test_sensor_rules_need_sensors(tmp_path):
    (finding,) = findings(tmp_path, "{type: sensor-dead, nodes: [east, 0]}", east="sensor: null")
    assert "nodes that have a sensor, got nodes 3, 4, 5 without one" in finding


@pytest.mark.parametrize(
    ("medium", "more", "remedy"),
    [
        ("{type: ideal}", "", "set `medium: {type: log-distance}`"),
        ("{type: log-distance, reception: prr}", "", "`reception: sinr` in `medium`: `prr` takes interference away"),
        (SINR, "fidelity: ideal\n", "`fidelity: sinr` or a higher rung: `ideal` takes interference away"),
    ],
)
def test_a_jammer_needs_a_medium_with_interference(tmp_path, medium, more, remedy):
    (finding,) = findings(tmp_path, "{type: jammer, position_m: [0, 0], power_dbm: 0}", medium=medium, more=more)
    assert "faults[0]" in finding
    assert "interfere" in finding
    assert remedy in finding


def test_a_jammer_needs_a_medium_with_path_loss(tmp_path):
    lines = [f"gain {a} {b} -60" for a in range(6) for b in range(6) if a != b]
    (tmp_path / "gains.txt").write_text("\n".join(lines))
    medium = "{type: trace, file: gains.txt, format: tossim}"
    (finding,) = findings(tmp_path, "{type: jammer, position_m: [0, 0], power_dbm: 0}", medium=medium)
    assert "got trace; set `medium: {type: log-distance}`" in finding


# --- what rules do --------------------------------------------------------------------------------------------------


def test_without_rules_and_with_rules_that_never_strike_a_run_is_the_same(tmp_path):
    quiet = "{type: outage, nodes: [0], from_s: 100}"
    plain, ruled = (Events(six(tmp_path, *rules)) for rules in ((), (quiet,)))
    assert repr([entry for entry in ruled.all if not isinstance(entry[1], Fault | Log)]) == repr(plain.all)


def test_crashes_by_name_group_and_time(tmp_path):
    rules = ["{type: crash, nodes: [n01, east], at_s: 2, reboot_after_s: 1}", "{type: crash, nodes: [0], at_s: 3}"]
    run = Events(six(tmp_path, *rules))
    lives = [(time_ns, event.node, event.event) for time_ns, event in run.of(NodeLife) if event.event[-3:] == "ted"]
    crashes = [(time_ns, event.node) for time_ns, event in run.of(NodeLife) if event.event == "crashed"]
    assert crashes == [(2 * S, 1), (2 * S, 3), (2 * S, 4), (2 * S, 5), (3 * S, 0)]
    assert [life for life in lives if life[2] == "rebooted"] == [(3 * S, node, "rebooted") for node in (1, 3, 4, 5)]
    said = [event.message for _, event in run.of(Log) if event.name.startswith("faults")]
    assert said[0] == "crash strikes: node 1 is down for 1 s"
    assert said[-1] == "crash strikes: node 0 is down for good"
    figures = metrics_of(run.all)
    assert (figures["crashes"], figures["reboots"], figures["nodes_crashed"], figures["nodes_finished"]) == (5, 4, 1, 5)
    assert figures["crashed_time_s"] == pytest.approx(4 * 1 + figures["simulated_s"] - 3)
    assert figures["fault_strikes_by_rule"] == {"0 crash": 4, "1 crash": 1}


@pytest.mark.parametrize(
    ("rule", "crashes"),
    [
        ("{type: role-crash, role: leader, at_s: 3.2}", [(3 * S + S // 5, 2)]),
        ("{type: role-crash, role: leader, at_s: 2.7, reboot_after_s: 1}", [(3 * S + 1, 2)]),  # nobody leads at 2.7 s
        ("{type: role-crash, role: jester, at_s: 3.2}", []),
    ],
)
def test_whoever_holds_a_role_crashes(tmp_path, rule, crashes):
    run = Events(six(tmp_path, rule, algorithm='{type: "fault_algorithms:Turns"}'))
    assert [(time_ns, event.node) for time_ns, event in run.of(NodeLife) if event.event == "crashed"] == crashes
    assert [event.node for _, event in run.of(Fault) if event.event == "strikes"] == [[node] for _, node in crashes]


def test_the_instant_of_a_role_crash_is_drawn_anew_in_every_repetition(tmp_path):
    rule = "{type: role-crash, role: leader, at_s: 0.1, spread_s: 0.8}"
    times = set()
    for repetition in range(4):
        more = f"repetition: {repetition}\n"
        run = Events(six(tmp_path, rule, algorithm='{type: "fault_algorithms:Turns"}', more=more))
        ((time_ns, node),) = [(time_ns, event.node) for time_ns, event in run.of(NodeLife) if event.event == "crashed"]
        assert node == 0
        assert 0.1 * S <= time_ns < 0.9 * S
        times.add(time_ns)
    assert len(times) == 4


def test_crashes_at_a_rate_are_poisson_and_each_node_has_its_own(tmp_path):
    """Six nodes up for 2000 s less their down-time: crashes at 36 an hour each, 1 s down, within four sd."""
    algorithm = "{type: neighbour-traffic, period_s: 500, rounds: 5}"
    rule = "{type: crash, rate_per_h: 36, reboot_after_s: 1, reboot: exponential}"
    run = Events(six(tmp_path, rule, algorithm=algorithm, duration_s=2000))
    counts = Counter(event.node for _, event in run.of(NodeLife) if event.event == "crashed")
    up_s = 6 * 2000 - metrics_of(run.all)["crashed_time_s"]
    expected = up_s * 36 / 3600
    assert abs(sum(counts.values()) - expected) < 4 * expected**0.5
    times = [time_ns for time_ns, event in run.of(NodeLife) if event.event == "crashed"]
    assert len(set(times)) == len(times)


def test_an_outage_cuts_what_it_says_while_it_says(tmp_path):
    links = "{type: outage, links: [[0, 3]], both_directions: false, from_s: 1, to_s: 3}"
    run = Events(six(tmp_path, links, "{type: outage, nodes: [n05], from_s: 4, to_s: 6}"))
    struck = Counter()
    for time_ns, source, node, outcome in run.outcomes():
        is_cut = ((source, node) == (0, 3) and S <= time_ns < 3 * S) or (
            5 in (source, node) and 4 * S <= time_ns < 6 * S
        )
        assert outcome != "outage" or is_cut
        assert not (is_cut and outcome in ("received", "overheard"))
        struck[source, node] += outcome == "outage"
    assert struck[0, 3] > 5
    assert struck[1, 5] > 0
    story = [(time_ns, event.event, event.rule, event.node) for time_ns, event in run.of(Fault)]
    assert [entry for entry in story if entry[1] != "strikes"] == [
        (1 * S, "begins", 0, [0, 3]),
        (3 * S, "ends", 0, [0, 3]),
        (4 * S, "begins", 1, [5]),
        (6 * S, "ends", 1, [5]),
    ]


def test_an_outage_that_comes_and_goes_says_so_and_strikes_only_then(tmp_path):
    run = Events(six(tmp_path, "{type: outage, nodes: [0], mean_up_s: 0.5, mean_down_s: 0.5, to_s: 6}"))
    changes = [(time_ns, event.event) for time_ns, event in run.of(Fault) if event.event != "strikes"]
    assert len(changes) > 6
    assert [event for _, event in changes] == (["begins", "ends"] * len(changes))[: len(changes)]
    strikes = [time_ns for time_ns, event in run.of(Fault) if event.event == "strikes"]
    on = [(a, b) for (a, what), (b, _) in zip(changes, [*changes[1:], (20 * S, "")], strict=True) if what == "begins"]
    assert len(strikes) > 5
    assert all(any(begin <= time_ns < end for begin, end in on) for time_ns in strikes)
    assert max(strikes) < 6 * S


def test_a_jammer_jams_while_it_is_on_and_only_near_it(tmp_path):
    rule = "{type: jammer, position_m: [10, 20], power_dbm: 0, from_s: 2, to_s: 6, on_s: 1, off_s: 1}"
    run = Events(six(tmp_path, rule))
    jammed = [time_ns for time_ns, _, _, outcome in run.outcomes() if outcome == "jammed"]
    changes = [(time_ns, event.event) for time_ns, event in run.of(Fault)]
    assert changes == [(2 * S, "begins"), (3 * S, "ends"), (4 * S, "begins"), (5 * S, "ends")]
    busy = [time_ns for time_ns, event in run.of(MessageDropped) if event.reason == "channel_busy"]
    assert len(jammed) + len(busy) > 5
    assert all(2 * S <= time_ns <= 3 * S + 9 * MS or 4 * S <= time_ns <= 5 * S + 9 * MS for time_ns in jammed)
    delivered = Counter(time_ns // S for time_ns, _ in run.of(MessageDelivered))
    assert delivered[2] + delivered[4] < 0.5 * (delivered[1] + delivered[3])
    weak = Events(six(tmp_path, rule.replace("power_dbm: 0", "power_dbm: -90")))
    assert not [outcome for *_, outcome in weak.outcomes() if outcome == "jammed"]


def test_bursts_and_corruption_show_in_the_outcomes(tmp_path):
    bursts = "{type: gilbert-elliott, mean_good_s: 1, mean_bad_s: 1}"
    run = Events(six(tmp_path, bursts, "{type: corruption, share: 0.2, nodes: [east]}"))
    outcomes = Counter((outcome, node > 2) for _, _, node, outcome in run.outcomes())
    total = sum(
        outcomes[outcome, east] for outcome in ("lost", "received", "overheard", "corrupted") for east in (0, 1)
    )
    assert 0.35 < (outcomes["lost", False] + outcomes["lost", True]) / total < 0.65
    assert outcomes["corrupted", True] > 20
    assert outcomes["corrupted", False] == 0


LONG = "{type: neighbour-traffic, period_s: 0.4, rounds: 20, payload_byte: 300}"


@pytest.mark.parametrize("medium", [SINR, "{type: ideal}"])
def test_packets_that_come_twice_or_late_are_messages_that_come_once(tmp_path, medium):
    late = "{type: delay, share: 0.5, mean_s: 0.05}"
    twice = "{type: duplication, share: 0.5, mean_delay_s: 0.01}"
    run = Events(six(tmp_path, late, twice, medium=medium, algorithm=LONG))
    counts = Counter((event.message_id, event.node) for _, event in run.of(MessageDelivered))
    assert set(counts.values()) == {1}
    struck = Counter(event.kind for _, event in run.of(Fault) if event.event == "strikes")
    assert min(struck["delay"], struck["duplication"]) > 100


def test_wrong_bytes_that_no_checksum_tells_of_are_survived(tmp_path):
    """Half of all packets reach the network layer with wrong bits, in headers too."""
    run = Events(six(tmp_path, "{type: corruption, share: 0.5, undetected_share: 1}", algorithm=LONG))
    assert [event for _, event in run.of(NodeLife) if event.event == "failed"] == []
    assert len([event for _, event in run.of(Fault) if event.event == "strikes"]) > 100
    assert [outcome for *_, outcome in run.outcomes() if outcome == "corrupted"] == []
    assert Counter(event.reason for _, event in run.of(MessageDropped))["malformed"] > 5


# --- algorithms under faults ----------------------------------------------------------------------------------------

CHEN = "{type: csmp, rounds: 5, round_s: 1, setup_s: 1}"
PROBLEM = """
problem: {type: association, detection_radius_m: 12, targets: {type: uniform, count: 5}}
field: {width_m: 30, height_m: 40}
"""


def chen(folder, *faults):
    return six(folder, *faults, algorithm=CHEN, more=PROBLEM)


@pytest.mark.parametrize(
    "rules",
    [
        ["{type: partition, groups: [[west], [east]]}"],
        ["{type: partition, groups: [[west], [east]], from_s: 1.2, to_s: 2}"],
        ["{type: crash, nodes: [1], at_s: 3.6}", "{type: crash, nodes: [4], at_s: 1.6, reboot_after_s: 0.7}"],
        ["{type: sensor-dead, nodes: [0]}", "{type: sensor-bias, nodes: [3], bias: 1}"],
        ["{type: sensor-stuck, nodes: [2]}", "{type: sensor-noise, nodes: [4], sd: 2}"],
        ["{type: gilbert-elliott, mean_good_s: 0.3, mean_bad_s: 0.3}"],
    ],
)
def test_message_passing_ends_with_a_stated_result(tmp_path, rules):
    run = Events(chen(tmp_path, *rules))
    figures = metrics_of(run.all)
    assert figures["nodes_failed"] == 0
    assert figures["nodes_finished"] + figures["nodes_crashed"] == 6
    assert 0.0 <= figures["association_error"] <= 1.0
    assert {event.node for _, event in run.of(Association)} == set(range(6))


def test_faulty_sensors_leave_the_truth_alone(tmp_path):
    def truth(run):
        return repr([event for _, event in run.of(TruthOrigins)])

    plain, biased = (Events(chen(tmp_path, *rules)) for rules in ((), ["{type: sensor-bias, nodes: [west], bias: 3}"]))
    assert truth(plain) == truth(biased)
    assert repr(plain.of(Association)) != repr(biased.of(Association))


def test_an_election_on_a_partitioned_network_has_a_leader_in_every_part(tmp_path):
    """An algorithm of one's own: the highest number heard of leads, and whoever hears of none higher leads alone."""
    algorithm = '{type: "fault_algorithms:Leader"}'
    run = Events(six(tmp_path, "{type: partition, groups: [[west], [east]]}", algorithm=algorithm))
    leaders = {event.name: event.message for _, event in run.of(Log) if event.name.startswith("node")}
    assert leaders == {f"node {node}": f"leader {2 if node < 3 else 5}" for node in range(6)}
    whole = Events(six(tmp_path, algorithm=algorithm))
    assert {event.message for _, event in whole.of(Log)} == {"leader 5"}
