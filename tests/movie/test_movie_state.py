"""What the state keeps of the events, and for how long."""

import math

import numpy as np
import pytest
from movie_traces import write_trace

from netsim.movie.cast import load_cast
from netsim.movie.state import CRASHED, DEAD, HOLD_NS, UP, State
from netsim.trace.events import (
    Estimate,
    Fault,
    Group,
    NodeEnergy,
    NodeLife,
    NodePositions,
    Particles,
    Role,
    TruthTargets,
)

S = 1_000_000_000


@pytest.fixture
def state(tmp_path):
    return State(load_cast(write_trace(tmp_path / "t.mcap", [])))


def test_energy_is_a_fraction_and_unknown_on_mains_power(state):
    assert state.moment(0).charge.tolist()[1:] == [1.0, 1.0]
    before = state.moment(0)
    state.take(1, NodeEnergy([2, 0, 1], [0.0] * 3, [0.5, math.inf, 3.0]))
    charge = state.moment(1).charge
    assert math.isnan(charge[0])
    assert charge.tolist()[1:] == [1.0, 0.25]
    assert before.charge.tolist()[1:] == [1.0, 1.0]  # an earlier moment stays as it was


def test_who_goes_down_leads_nothing_any_more(state):
    state.take(1, Role(1, "leader 3", 1))
    state.take(2, Role(2, "leader", 1))
    state.take(2, Role(2, "member", 1))
    assert state.moment(2).leaders == (1, 2)
    state.take(3, NodeLife(1, "crashed", "rule"))
    state.take(3, NodeLife(0, "died", "battery"))
    state.take(3, NodeLife(2, "finished", ""))
    assert state.moment(3).leaders == (2,)
    assert state.moment(3).life.tolist() == [DEAD, CRASHED, UP]
    state.take(4, NodeLife(1, "rebooted", ""))
    state.take(4, Role(2, "leader", 0))
    assert state.moment(4).life.tolist() == [DEAD, UP, UP]
    assert state.moment(4).leaders == ()


def test_a_joint_group_has_one_hull_and_goes_after_a_while(state):
    state.take(1 * S, Group(0, 0, [0], [0, 1]))
    state.take(1 * S, Group(2, 0, [1], [2]))
    assert state.moment(1 * S).groups == {0: ((0, 1), False), 1: ((2,), False)}
    state.take(2 * S, Group(0, 1, [0, 1], [0, 1, 2]))
    assert state.moment(2 * S).groups == {0: ((0, 1, 2), True)}
    assert state.moment(2 * S + HOLD_NS - 1).groups
    assert state.moment(2 * S + HOLD_NS).groups == {}


def test_each_track_has_its_part_of_a_joint_cloud(state):
    cloud = Particles(0, 0, [4, 7], 2, [0.5, 0.5], [1.0, 2.0, 3.0, 4.0], [0.0] * 4)
    state.take(S, cloud)
    assert state.moment(S).particles == {4: (cloud, 0), 7: (cloud, 1)}
    assert state.moment(S + HOLD_NS).particles == {}


def test_trails_hold_the_last_places_and_targets_only_those_there_are(state):
    for step in range(60):
        state.take(step, TruthTargets([3], [float(step)], [1.0]))
        state.take(step, Estimate(0, 5, float(step), 2.0, [], 1))
    moment = state.moment(60)
    assert moment.target_trails[3][:, 0].tolist() == [float(step) for step in range(20, 60)]
    assert np.array_equal(moment.trails[5, 1][-1], [59.0, 2.0])
    state.take(61, TruthTargets([], [], []))
    assert state.moment(61).targets == {}


def test_faults_mark_their_nodes_and_places_while_they_are_at_work(state):
    state.take(1, Fault(0, "outage", "begins", [1], "from here"))
    state.take(1, Fault(1, "jammer", "begins", [0, 1, 2], "at (10, -2.5) m with 0 dBm"))
    state.take(2, Fault(0, "outage", "strikes", [2], ""))
    assert state.moment(2).struck == (1,)
    assert state.moment(2).jammers == ((10.0, -2.5),)
    state.take(3, Fault(0, "outage", "ends", [1], ""))
    state.take(3, Fault(1, "jammer", "ends", [0, 1, 2], ""))
    assert (state.moment(3).struck, state.moment(3).jammers) == ((), ())


def test_nodes_are_where_they_were_last_told_to_be_and_links_join_those_that_stay(tmp_path):
    cast = load_cast(write_trace(tmp_path / "t.mcap", [(2 * S, NodePositions([2], [18.0], [9.0]))]))
    assert cast.motion.snapshot(2 * S - 1)[2].tolist() == [18.0, 5.0]
    assert cast.motion.snapshot(2 * S)[2].tolist() == [18.0, 9.0]
    assert cast.lines()[0].tolist() == [[0, 1]]
    low, high = cast.outline()
    assert high[1] > 9.0
    assert low[0] <= 0.0
