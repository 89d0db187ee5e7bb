"""Leaders and members on a bench: sensors in a row, a metre apart, whose targets stand still."""

from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest

from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.algorithms.joint_tracking import JointTracking
from netsim.kernels.energy_sensing import EnergyModel, amplitude_for
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge, TrackStart
from netsim.testing import DROP, ScriptedMedium, delay, duplicate, rule, run_algorithm
from netsim.trace.events import Estimate, Identity, Log, MessageSent, Role
from netsim.units import NS_PER_S

NODES, RANGE_M = 12, 3.0
TRUE = EnergyModel(amplitude_for(RANGE_M, 1.0), 1.0, 0.7)


def bench(targets_m, starts, *rules, duration_s=12.0, observe=None, blind=(), **settings):
    """A run with targets at places (x, 0), and tracks that nodes are told: (node, track, x)."""

    def knowledge(node):
        told = [TrackStart(track, (x_m, 0.0), 1.0, 1) for at, track, x_m in starts if at == node]
        return EnergyTrackingKnowledge(
            has_sensor=node not in blind,
            sensors_m={each: (float(each), 0.0) for each in range(NODES) if each not in blind},
            model=EnergyModel(TRUE.amplitude, 2.0, TRUE.saturation_m),
            sensing_range_m=RANGE_M,
            reading_s=1.0,
            max_speed_m_per_s=1.5,
            targets=2,
            starts=tuple(told),
        )

    def read(node):
        return TRUE.mean(np.array([[float(node), 0.0]]), np.array([(x_m, 0.0) for x_m in targets_m]).reshape(-1, 2))

    parameters = JointTrackingParameters(**({"migrate_m": 0.6, "separate_m": 3.0} | settings))
    return run_algorithm(
        JointTracking,
        NODES,
        knowledge=knowledge,
        observe=observe or read,
        medium=ScriptedMedium(rules),
        duration_s=duration_s,
        parameters=parameters,
    )


def leaders(run):
    """Of each track its leaders, with the times in s since when."""
    holders, found = defaultdict(set), defaultdict(list)
    for time_ns, event in run.of(Role):
        track = int(event.role.split()[1])
        (holders[track].add if event.holds else holders[track].discard)(event.node)
        found[track].append((time_ns / NS_PER_S, sorted(holders[track])))
    return found


def longest_with_two_s(run, track):
    turns = [*leaders(run)[track], (run.end_ns / NS_PER_S, [])]
    return max((b - a for (a, nodes), (b, _) in pairwise(turns) if len(nodes) > 1), default=0.0)


def logs(run, words):
    return [event.message for _, event in run.of(Log) if words in event.message]


def test_a_belief_moves_to_the_sensor_nearest_to_its_target():
    run = bench([4.2], [(2, 0, 3.5)])
    assert not run.failures
    assert leaders(run)[0][-1][1] == [4]
    assert longest_with_two_s(run, 0) < 0.01
    errors_m = [np.hypot(event.x_m - 4.2, event.y_m) for _, event in run.of(Estimate)]
    assert len(errors_m) == 11
    assert np.mean(errors_m) < 0.7


@pytest.mark.parametrize("lost", ["taken", "given"])
def test_what_is_lost_once_on_the_way_to_a_new_leader_is_repeated(lost):
    run = bench([4.2], [(2, 0, 3.5)], rule(DROP, kind=lost, counts={0}))
    assert leaders(run)[0][-1][1] == [4]
    assert longest_with_two_s(run, 0) < 0.3


def test_of_two_leaders_for_want_of_confirmation_one_gives_way_within_a_reading():
    run = bench([4.2], [(2, 0, 3.5)], rule(DROP, kind="taken", destination=2))
    assert logs(run, "does not confirm")
    assert len(leaders(run)[0][-1][1]) == 1
    assert longest_with_two_s(run, 0) < 1.2
    assert not run.failures


def test_who_has_taken_a_group_for_want_of_confirmation_is_told_at_once_that_its_giver_goes_on():
    """They need not hear each other's calls: both may follow other targets by then."""
    deaf = [rule(DROP, kind="call", source=a, destination=b) for a, b in ((2, 4), (4, 2))]
    run = bench([4.2], [(2, 0, 3.5)], rule(DROP, kind="taken", destination=2), *deaf)
    assert logs(run, "does not confirm")
    assert longest_with_two_s(run, 0) < 0.7, "three times 0.2 s"


def test_a_new_leader_that_cannot_be_reached_is_passed_over():
    run = bench([4.2], [(2, 0, 3.5)], rule(DROP, kind="given", destination=4))
    assert leaders(run)[0][-1][1] in ([3], [5])
    assert longest_with_two_s(run, 0) < 0.01


def test_nodes_without_a_sensor_take_no_part():
    run = bench([4.2], [(2, 0, 3.5)], blind=(0, 4, 5))
    assert not run.failures
    assert leaders(run)[0][-1][1] == [3]
    assert not {event.node for _, event in run.of(Role)} & {0, 4, 5}
    assert {0, 4, 5}.isdisjoint(run.unfinished), "their algorithm has ended"


def test_a_group_that_arrives_twice_is_led_once():
    run = bench([4.2], [(2, 0, 3.5)], rule(duplicate(0.05), kind="given"))
    twice = bench([4.2], [(2, 0, 3.5)], rule(duplicate(2.5), kind="given"))
    for each in (run, twice):
        roles = [event.node for _, event in each.of(Role) if event.holds]
        assert len(roles) == len(set(roles)), "each node takes the role once"
        assert leaders(each)[0][-1][1] == [4]


def test_calls_that_are_lost_leave_the_leader_alone_with_its_own_reading():
    run = bench([4.2], [(4, 0, 4.2)], rule(DROP, kind="call", until_s=1.5))
    assert [time_ns // NS_PER_S for time_ns, _ in run.of(Estimate)] == list(range(1, 12))
    assert not logs(run, "taking over")


def test_a_leader_that_is_not_heard_is_replaced_once_and_gives_way_when_it_is_heard_again():
    silent = [rule(DROP, kind=kind, source=4, from_s=2.5, until_s=6.5) for kind in ("call", "reading")]
    deaf = rule(DROP, destination=4, from_s=2.5, until_s=6.5)
    run = bench([4.2], [(4, 0, 4.2)], *silent, deaf)
    assert len(logs(run, "taking over")) == 1, "the claim keeps the others from it"
    assert logs(run, "giving way")
    assert len(leaders(run)[0][-1][1]) == 1
    assert leaders(run)[0][-1][0] < 7.2


def test_a_member_that_misses_calls_asks_their_leader_and_leaves_it_the_track():
    run = bench([4.2], [(4, 0, 4.2)], rule(DROP, kind="call", destination=5, from_s=2.5))
    sent = {(event.kind, event.source, event.destination) for _, event in run.of(MessageSent)}
    assert {("ask", 5, 4), ("latest", 4, 5)} <= sent
    assert not logs(run, "taking over")
    assert [node for _, nodes in leaders(run)[0] for node in nodes] == [4]


def test_a_former_leader_passes_questions_on_to_whom_it_gave_the_track():
    """Nobody but the new leader, node 4, hears its calls: the members ask node 2, which gave it the track."""
    run = bench([4.2], [(2, 0, 3.5)], rule(DROP, kind="call", source=4), duration_s=4.0)
    sent = [(event.kind, event.source, event.destination) for _, event in run.of(MessageSent)]
    assert ("ask", 2, 4) in sent
    assert {("latest", 4, node) for kind, node, to in sent if kind == "ask" and node not in (2, 4)} <= set(sent)
    assert not logs(run, "taking over")


def test_a_leader_that_nobody_hears_and_that_does_not_answer_is_taken_over_from():
    mute = [rule(DROP, source=4, kind=kind, from_s=2.5) for kind in ("call", "latest", "claim")]
    run = bench([4.2], [(4, 0, 4.2)], *mute)
    assert logs(run, "taking over")


@pytest.mark.parametrize("lost", [{"kind": "nothing"}, {"kind": "claim", "destination": 4}])
def test_a_false_claim_is_contradicted_by_the_leader_that_has_readings(lost):
    """By the claim or, where the leader did not hear that, by the first call."""
    deaf = [rule(DROP, kind=kind, destination=5, from_s=2.5, until_s=5.5) for kind in ("call", "latest")]
    run = bench([4.2], [(4, 0, 4.2)], *deaf, rule(DROP, **lost), migrate_m=9.0)
    assert len(logs(run, "taking over")) == 1
    assert logs(run, "giving way") == ["node 4 leads track 0 since, or a part: giving way"]
    assert leaders(run)[0][-1][1] == [4]
    assert {event.node for _, event in run.of(Estimate)} == {4}


def test_of_two_that_begin_the_same_track_the_lower_node_goes_on():
    """As many turns each: a tie, and both are told of it by the first calls."""
    run = bench([4.2], [(3, 0, 4.2), (5, 0, 4.2)], migrate_m=9.0)
    assert leaders(run)[0][-1][1] == [3]
    assert longest_with_two_s(run, 0) < 0.01


def test_a_leader_that_is_out_of_reach_of_the_better_one_is_told_by_it():
    """Node 4 is in the region of node 8's calls, but not the other way round."""
    run = bench([4.2], [(4, 0, 4.2), (8, 0, 7.0)], migrate_m=9.0)
    assert leaders(run)[0][-1][1] == [4]


def test_two_groups_that_collide_merge_and_one_node_leads_both_tracks():
    run = bench([4.0, 6.0], [(4, 0, 4.0), (6, 1, 6.0)])
    final = {track: turns[-1][1] for track, turns in leaders(run).items()}
    assert final[0] == final[1]
    assert len(final[0]) == 1
    last = {event.target: event.x_m for _, event in run.of(Estimate)}
    assert sorted(last.values()) == pytest.approx([4.0, 6.0], abs=1.0)


def test_a_group_that_is_given_amidst_a_reading_does_not_cost_the_hosts_group_that_reading():
    late = rule(delay(0.6), kind="given", until_s=2.0)
    run = bench([4.0, 6.0], [(4, 0, 4.0), (6, 1, 6.0)], late, give_s=0.9, migrate_m=9.0)
    assert min(time_s for time_s, nodes in leaders(run)[1] if nodes != [6]) > 2.0
    assert [t // NS_PER_S for t, event in run.of(Estimate) if event.target == 0] == list(range(1, 12))
    assert leaders(run)[0][-1][1] == leaders(run)[1][-1][1] == [4]


def test_a_member_of_two_groups_reads_its_sensor_once():
    """The calls of both arrive while the sensor is being read."""
    count = defaultdict(int)

    def counted(node):
        count[node] += 1
        return TRUE.mean(np.array([[float(node), 0.0]]), np.array([[4.0, 0.0], [6.0, 0.0]]))

    bench([], [(4, 0, 4.0), (6, 1, 6.0)], observe=counted, switch="never")
    assert count[5] == 11


def test_of_a_joint_group_of_two_leaders_none_loses_a_track_that_only_it_leads():
    """Track 1's leader never learns that its group was taken in and goes on with it; track 0 is led all the same."""
    run = bench([4.0, 6.0], [(4, 0, 4.0), (6, 1, 6.0)], rule(DROP, kind="taken", destination=6))
    final = {track: turns[-1][1] for track, turns in leaders(run).items()}
    assert all(len(nodes) == 1 for nodes in final.values())
    seen = {event.target for time_ns, event in run.of(Estimate) if time_ns > 10 * NS_PER_S}
    assert seen == {0, 1}


def test_who_takes_over_a_part_of_a_joint_group_does_not_know_who_is_who():
    """The joint leader, node 4, falls silent, members near each track take that over; and it hears of it later."""
    away = [rule(DROP, from_s=5.6, until_s=9.7, **end) for end in ({"source": 4}, {"destination": 4})]
    run = bench([2.0, 6.0], [(2, 0, 2.0), (6, 1, 6.0)], *away, separate_m=5.0, duration_s=16.0)
    assert len(logs(run, "taking over")) > 1
    told = [(t / NS_PER_S, e.node, e.track, e.probability) for t, e in run.of(Identity) if t > 8 * NS_PER_S]
    assert {track for time_s, node, track, _ in told if node != 4 and time_s < 9.7} == {0, 1}
    assert all(row == [0.5, 0.5] for time_s, node, _, row in told if node != 4 or time_s > 11.0)
    assert all(len(turns[-1][1]) == 1 for turns in leaders(run).values())


def test_a_track_whose_target_is_gone_ends_and_nobody_takes_it_over():
    run = bench([], [(4, 0, 4.2)])
    assert logs(run, "ending") == ["track 0: nobody has read a target for 3 readings: ending"]
    assert leaders(run)[0][-1][1] == []
    assert not logs(run, "taking over")


def test_a_target_that_goes_beside_another_ends_its_track_and_leaves_open_who_stays():
    reads = defaultdict(int)

    def read(node):
        reads[node] += 1
        there = [(4.0, 0.0), (6.0, 0.0)] if reads[node] <= 5 else [(4.0, 0.0)]
        return TRUE.mean(np.array([[float(node), 0.0]]), np.array(there))

    run = bench([], [(4, 0, 4.0), (6, 1, 6.0)], observe=read, duration_s=16.0)
    (told,) = logs(run, "ending")
    assert told.endswith("3 readings are explained better without it: ending")
    gone = int(told.split()[1].rstrip(":"))
    assert [len(leaders(run)[track][-1][1]) for track in (gone, 1 - gone)] == [0, 1]
    last = [event for _, event in run.of(Estimate)][-3:]
    assert {event.target for event in last} == {1 - gone}
    assert [event.x_m for event in last] == pytest.approx([4.0] * 3, abs=0.8)
    assert [event for _, event in run.of(Identity)][-1].probability == [0.5, 0.5]
    assert not logs(run, "taking over")


def test_a_member_that_misses_the_end_of_a_track_is_told_of_it_when_it_asks():
    run = bench([], [(4, 0, 4.2)], rule(DROP, kind="end", destination=5, until_s=4.0), watch_share=1.0)
    sent = [(event.kind, event.source, event.destination) for _, event in run.of(MessageSent)]
    assert ("ask", 5, 4) in sent
    assert ("end", 4, 5) in sent
    assert not logs(run, "taking over")


def test_readings_that_nothing_explains_begin_the_belief_anew_around_the_loudest_member():
    """A reading of infinity has no likelihood anywhere; the estimates come back once the sensor is well."""
    count = defaultdict(int)

    def broken(node):
        count[node] += 1
        if node == 5 and count[node] == 3:
            return np.array([np.inf])
        return TRUE.mean(np.array([[float(node), 0.0]]), np.array([[4.2, 0.0]]))

    run = bench([], [(4, 0, 4.2)], observe=broken)
    assert len(logs(run, "lost, no particle explains the readings")) == 1
    assert not run.failures
    _, last = run.of(Estimate)[-1]
    assert np.hypot(last.x_m - 4.2, last.y_m) < 1.5


def test_one_run_is_like_another():
    one, other = bench([4.2], [(2, 0, 3.5)]), bench([4.2], [(2, 0, 3.5)])
    assert one.events == other.events


@pytest.mark.parametrize("payload", ["float16", "float64"])
def test_the_width_of_numbers_on_the_air_changes_little(payload):
    run = bench([4.2], [(2, 0, 3.5)], payload=payload)
    errors_m = [np.hypot(event.x_m - 4.2, event.y_m) for _, event in run.of(Estimate)]
    assert np.mean(errors_m) < 0.7


DETECTED = {"begin": "detected", "quiet_sd": 3.0, "same_m": 1.5}


def test_the_loudest_sensor_that_reads_a_target_begins_its_track():
    run = bench([4.2], [], **DETECTED)
    (begun,) = logs(run, "beginning track")
    assert begun.endswith("beginning track 4")
    assert leaders(run)[4] == [(leaders(run)[4][0][0], [4])]
    assert leaders(run)[4][0][0] < 1.0, "after the first reading"


def test_where_there_is_no_target_no_track_begins():
    assert not bench([], [], **DETECTED).of(Role)


def test_claims_that_do_not_arrive_begin_doubles_and_the_earliest_track_survives():
    run = bench([4.2], [], rule(DROP, kind="claim"), **DETECTED)
    begun = sorted(int(told.split()[-1]) for told in logs(run, "beginning track"))
    assert len(begun) > 1
    alive = {track for track, turns in leaders(run).items() if turns[-1][1]}
    assert alive == {begun[0]}
    assert len(logs(run, "its target is that of track")) == len(begun) - 1, (
        "perhaps that of another double, which ends too"
    )
    late = {event.target for time_ns, event in run.of(Estimate) if time_ns > 6 * NS_PER_S}
    assert late == {begun[0]}


def test_targets_out_of_each_others_range_begin_tracks_of_their_own():
    run = bench([1.0, 9.0], [], **DETECTED)
    assert {track for track, turns in leaders(run).items() if turns[-1][1]} == {1, 9}


def test_identities_of_detected_tracks_are_open():
    run = bench([4.2], [], **DETECTED)
    assert all(event.probability == [0.5, 0.5] for _, event in run.of(Identity))
