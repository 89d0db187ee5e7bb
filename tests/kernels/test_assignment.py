"""The integer programme against enumeration and against max-product."""

import association_oracle as oracle
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.assignment import best_assignment, brute_force, joint_score

COVERAGES = [
    [(0, 1), (1, 2), (0, 2), (0,)],
    [(0, 1, 2), (0, 1), (2,), ()],
    [(0, 1, 2), (0, 1, 2)],
    [(0, 1), (0, 1), (1,)],
]


@st.composite
def problems(draw):
    coverage = draw(st.sampled_from(COVERAGES))
    sensors = 1 + max(max(covering, default=0) for covering in coverage)
    most = [min(2, sum(s in covering for covering in coverage) + 1) for s in range(sensors)]
    counts = [draw(st.integers(0, limit)) for limit in most]
    model = oracle.model(draw(st.sampled_from(["strict", "geometric"])), alarm=draw(st.sampled_from([0.15, 0.9])))
    return oracle.instance(coverage, counts, draw(st.integers(0, 2**32 - 1)), model)


@given(problems())
@settings(max_examples=40, deadline=None)
def test_integer_programme_equals_enumeration(problem):
    joint = oracle.joint(problem)
    exact = best_assignment(problem)
    assert exact.score == pytest.approx(joint.max(), abs=1e-9)
    best = oracle.assignment(problem, np.unravel_index(np.argmax(joint), joint.shape))
    if np.ptp(np.sort(joint, axis=None)[-2:]) > 1e-9:
        assert [d.tolist() for d in exact.assignment] == [d.tolist() for d in best]


@given(problems())
@settings(max_examples=10, deadline=None)
def test_brute_force_finds_the_best_score(problem):
    assert joint_score(problem, brute_force(problem)) == pytest.approx(oracle.joint(problem).max(), abs=1e-9)


@pytest.mark.parametrize("false_alarms", ["strict", "geometric"])
@pytest.mark.parametrize(("alarm", "counts"), [(0.0, [1, 2, 2]), (1.0, [2, 2, 2])])
def test_certain_false_alarms(false_alarms, alarm, counts):
    problem = oracle.instance([(0, 1), (1, 2), (0, 2)], counts, 3, oracle.model(false_alarms, alarm=alarm))
    assert best_assignment(problem).score == pytest.approx(oracle.joint(problem).max(), abs=1e-9)


def test_impossible_problems_are_refused():
    problem = oracle.instance([(0, 1)], [3, 0], 3, oracle.model("strict"))
    with pytest.raises(ScenarioError, match="no association explains"):
        best_assignment(problem)


def test_no_targets_leave_false_alarms():
    problem = oracle.instance([(), ()], [1], 3, oracle.model("strict"))
    assert best_assignment(problem).assignment[0].tolist() == [-1]


@pytest.mark.parametrize("decision", [[0], [0, 0], [2, -1]])
def test_inconsistent_assignments_are_refused(decision):
    problem = oracle.instance([(0,), (0, 1), (1,)], [2, 0], 3, oracle.model())
    with pytest.raises(ScenarioError, match="no association of its"):
        joint_score(problem, [np.array(decision), np.zeros(0, dtype=int)])
