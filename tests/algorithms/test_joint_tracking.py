"""Joint tracking on the shipped crossing: one merge, one split, and a track that outlives its leaders."""

import json

import numpy as np
import pytest
from joint_rig import JointRun

from netsim.trace.events import AlgorithmRecord, Estimate, Identity, MessageSent, Role
from netsim.units import NS_PER_S

CROSSING = "liu2004/crossing.yaml"
ONE_CROSSING = ["merge", "split"]
TAKEN_OVER_S = 4.0
"""Two silent readings, the delay of who takes over, the reading it begins with, its collection: 2 + 1 + 1, and less."""


@pytest.fixture(scope="module")
def crossing(scenarios):
    return JointRun(scenarios / CROSSING)


def test_one_crossing_merges_once_and_splits_once(crossing):
    assert not crossing.crashes()
    assert crossing.changes() == ONE_CROSSING
    assert [sorted(map(tuple, parts)) for parts in crossing.parts()] == [[(0,), (1,)], [(0,), (1,)]]


def test_every_track_is_estimated_at_every_reading_and_led_by_one(crossing):
    for track in (0, 1):
        assert crossing.estimated(track) == list(range(crossing.estimated(track)[-1] + 1))
        assert crossing.longest_s(track, 2) < 0.01
    assert not crossing.logs("taking over")
    assert crossing.figures()["track_losses"] == 0


def test_beliefs_go_from_a_leader_to_one_that_leads_next(crossing):
    """Whoever takes a track has been given it by a node that leads it until then; only the first leaders begin one."""
    holders, given = {}, {}
    for _, event in crossing.events:
        if isinstance(event, MessageSent) and event.kind == "given":
            assert any(event.source in nodes for nodes in holders.values())
            given[event.source] = event.destination
        elif isinstance(event, Role) and event.holds:
            if event.role in holders:
                assert any(given.get(node) == event.node for node in holders[event.role])
            holders.setdefault(event.role, set()).add(event.node)
        elif isinstance(event, Role):
            holders[event.role].discard(event.node)


def test_identities_are_certain_before_the_split_and_even_after_it(crossing):
    (split_s,) = [t / NS_PER_S for t, e in crossing.events if getattr(e, "kind", "") == "split"]
    for time_ns, event in crossing.of(Identity):
        certain = [1.0, 0.0] if event.track == 0 else [0.0, 1.0]
        # the split follows the estimates of its own reading
        assert event.probability == (certain if time_ns / NS_PER_S <= split_s else [0.5, 0.5])


def test_estimates_are_near_and_say_how_near(crossing):
    figures = crossing.figures()
    assert figures["position_error_mean_m"] < 15.0
    assert all(np.linalg.eigvalsh([[xx, xy], [xy, yy]]).min() > 0 for xx, xy, yy in spreads(crossing))


def spreads(run):
    return [event.covariance_m2 for _, event in run.of(Estimate)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.parametrize(
    ("switch", "separate_m"),
    [*(("latched", each) for each in (60, 100, 140, 180)), *(("distance", each) for each in (120, 140, 180))],
)
def test_one_crossing_switches_twice(scenarios, switch, separate_m, seed):
    """With `distance` and a small R_separate single beliefs that draw each other in make groups join again: not here."""
    settings = [f"seed={seed}", f"algorithm.switch={switch}", f"algorithm.separate_m={separate_m}"]
    assert JointRun(scenarios / CROSSING, *settings).changes() == ONE_CROSSING


@pytest.mark.slow
@pytest.mark.parametrize("phase_s", [0.0, 0.01, 0.25, 0.505, 0.53, 0.7])
@pytest.mark.parametrize("step", [10, 20])
def test_a_leader_that_dies_at_any_moment_is_taken_over_from(scenarios, crossing, step, phase_s):
    """Two leaders at once last from a claim that crosses another one until the next call: less than a reading and a half."""
    at_s = step + phase_s
    leader = crossing.leader_at(at_s - 1e-6, 0)
    fault = f"faults=[{{type: crash, nodes: [{leader}], at_s: {at_s}}}]"
    run = JointRun(scenarios / CROSSING, fault)
    assert len(run.crashes()) == 1
    for track in (0, 1):
        steps = run.estimated(track)
        assert steps[-1] >= 40, "it is followed to the end"
        assert max(np.diff(steps)) <= TAKEN_OVER_S
        assert run.longest_s(track, 2) < 1.5
    assert run.figures()["track_losses"] == 0


@pytest.mark.slow
def test_leaders_that_die_again_and_again(scenarios):
    rules = ", ".join(
        f"{{type: role-crash, role: leader {track}, at_s: {at_s}}}"
        for track, at_s in [(0, 6.3), (1, 9.1), (0, 19), (1, 32.6)]
    )
    run = JointRun(scenarios / CROSSING, f"faults=[{rules}]")
    assert len(run.crashes()) == 4
    for track in (0, 1):
        assert run.estimated(track)[-1] >= 40
        assert max(np.diff(run.estimated(track))) <= TAKEN_OVER_S


@pytest.mark.slow
def test_a_first_leader_that_comes_up_again_does_not_begin_its_track_anew(scenarios, crossing):
    first = crossing.leader_at(0.1, 0)
    run = JointRun(scenarios / CROSSING, f"faults=[{{type: crash, nodes: [{first}], at_s: 0.2, reboot_after_s: 6}}]")
    assert run.logs("was to begin at reading 0, which is over")
    assert not run.crashes()[1:]


@pytest.mark.slow
@pytest.mark.parametrize(
    "losses",
    [
        ["medium={type: log-distance, shadowing_sd_db: 2}"],
        ["faults=[{type: gilbert-elliott, mean_good_s: 1, mean_bad_s: 0.3, loss_bad: 1.0}]"],
    ],
    ids=["frames that collide and fade", "links that are down for a quarter of the time"],
)
def test_calls_readings_and_beliefs_that_are_lost(scenarios, losses):
    run = JointRun(scenarios / CROSSING, "mac={type: csma}", *losses)
    assert run.figures()["track_losses"] == 0
    for track in (0, 1):
        assert run.estimated(track)[-1] >= 40
        assert run.longest_s(track, 2) < 1.5


@pytest.mark.slow
def test_sensors_that_may_not_read_see_no_targets_and_their_tracks_end(scenarios):
    budget = "nodes.0.budget={allowance_j: 0.0000001, per: 10, policy: refuse}"
    run = JointRun(scenarios / CROSSING, budget, "duration_s=15")
    assert not run.crashes()
    assert run.figures()["nodes_failed"] == 0
    assert not [event for _, event in run.of(MessageSent) if event.kind == "reading"]
    assert all(turns[-1][1] == frozenset() for turns in run.leaders().values())


@pytest.mark.slow
def test_one_is_always_joint(scenarios):
    run = JointRun(scenarios / CROSSING, "algorithm.switch=always", "problem.first_leader=one")
    assert run.changes() == ["merge"]
    assert run.longest_s(0, 2) < 0.01
    assert run.estimated(0) == run.estimated(1)
    first_merge_ns = next(t for t, e in run.events if getattr(e, "kind", "") == "merge")
    assert first_merge_ns < NS_PER_S, "in the first reading"


@pytest.mark.slow
def test_a_target_that_enters_later_begins_a_track_then(scenarios):
    run = JointRun(scenarios / CROSSING, "problem.targets.1.track.enters_s=5.5", "duration_s=20")
    assert run.estimated(0)[0] == 0
    assert run.estimated(1)[0] == 6
    assert max(np.diff(run.estimated(1))) == 1


@pytest.mark.slow
def test_a_chain_of_encounters_mixes_the_identities_of_all_that_were_joint(scenarios):
    """Track 0 meets 1, and one of the two then meets 2: halves, then halves of halves; columns keep their sums."""
    run = JointRun(scenarios / "liu2004/three-targets.yaml")
    assert run.changes() == ["merge", "split", "merge", "split"]
    last = {event.track: event.probability for _, event in run.of(Identity)}
    assert sorted(map(sorted, last.values())) == [[0.0, 0.5, 0.5], [0.25, 0.25, 0.5], [0.25, 0.25, 0.5]]
    np.testing.assert_allclose(np.sum(list(last.values()), axis=0), 1.0, rtol=1e-12)
    assert run.figures()["track_losses"] == 0


@pytest.mark.slow
def test_three_targets_at_once_are_one_group(scenarios):
    third = "problem.targets.2.track={type: straight, from_m: [250, 480], to_m: [250, 20], speed_m_per_s: 11}"
    run = JointRun(scenarios / "liu2004/three-targets.yaml", third, "algorithm.separate_m=140")
    parted = [len(parts) - 1 for kind, parts in zip(run.changes(), run.parts(), strict=True) if kind == "split"]
    assert run.changes().count("merge") == sum(parted), "what was joined has parted, perhaps in three at once"
    groups = [json.loads(event.fields_json)["tracks"] for _, event in run.of(AlgorithmRecord) if event.kind == "joint"]
    assert [0, 1, 2] in groups
    last = {event.track: event.probability for _, event in run.of(Identity)}
    np.testing.assert_allclose(list(last.values()), 1 / 3, rtol=1e-12)
    assert run.figures()["track_losses"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_targets_that_nobody_announces_are_tracked_from_the_first_reading_to_the_last(scenarios, seed):
    run = JointRun(scenarios / "liu2004/arrivals.yaml", f"seed={seed}")
    begun, ended = run.logs("beginning track"), run.logs("ending")
    assert len(begun) == len(ended) == 2
    assert [round(at_s) for at_s, _ in begun] == [1, 5]
    figures = run.figures()
    assert figures["track_losses"] == 0
    assert [run.estimated(track)[0] for track in sorted(run.leaders())] == [1, 5], (
        "by the claim's leader, at the next reading"
    )
    assert all(run.estimated(track)[-1] >= 9 for track in run.leaders())
    assert figures["reading_error_mean_m"] < 15.0
    assert not run.crashes()
