"""What is refused before the start is what the vertices would refuse, and large tables give what small ones do."""

from dataclasses import replace
from pathlib import Path

import association_oracle as oracle
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels import association_reach, injections, semiring
from netsim.kernels.assignment import best_assignment, joint_score
from netsim.kernels.association_reach import demands, largest, require_reach, sensor_states
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.polar_evidence import polar_log_evidence
from netsim.kernels.semiring import Semiring, contract, reduce
from netsim.problems.association import AssociationParameters, UniformTargets
from netsim.problems.association import build as draw
from netsim.rng import Streams
from netsim.scenario.build import build
from netsim.scenario.load import load

COVERAGES = [
    [(0, 1)] * 3 + [(0,), (1,)],
    [(0, 1), (1, 2), (0, 2), (0, 1, 2), (2,)],
    [(0, 1, 2)] * 2 + [(0, 1), ()],
]


@given(st.sampled_from(COVERAGES), st.lists(st.integers(0, 6), min_size=3, max_size=3), st.integers(1, 400))
@settings(max_examples=60, deadline=None)
def test_refused_before_the_start_exactly_when_a_vertex_refuses(coverage, counts, limit):
    problem = oracle.instance(coverage, counts, 1, oracle.model("geometric"))
    with pytest.MonkeyPatch.context() as patch:
        for module in (injections, association_reach):
            patch.setattr(module, "STATE_LIMIT", limit)
            patch.setattr(module, "PAIR_LIMIT", 4 * limit)
        patch.setattr(injections.check_states, "__defaults__", (limit,))
        injections.injections.cache_clear()
        early, late = refuses(require_reach, problem), refuses(instance_vertices, problem)
    injections.injections.cache_clear()
    assert early == late


def refuses(function, problem):
    try:
        function(problem)
    except ScenarioError:
        return True
    return False


def test_the_message_names_the_sensor_and_the_size():
    problem = oracle.instance([(0, 1)] * 7, [9, 2], 1, oracle.model("geometric"))
    with pytest.raises(
        ScenarioError, match=r"2 sensors, 7 targets; sensor 10 with 9 measurements: 7 targets shared with"
    ):
        require_reach(problem)
    with pytest.raises(ScenarioError, match="10,000,000 entries, at most 5,000,000"):
        require_reach(problem)
    assert largest(problem).entries == 10**7
    assert largest(oracle.instance([], [], 1, oracle.model())) is None


def test_states_of_a_sensor_are_counted_out():
    problem = oracle.instance(COVERAGES[1], [3, 2, 3], 1, oracle.model())
    assert sensor_states(problem) == [len(options) for options in oracle.sensor_states(problem)]
    assert all(demand.entries >= 1 for demand in demands(problem))


@pytest.mark.parametrize("shape", [(5, 4, 3), (9, 9, 9), (11,), (2, 1, 1)])
@pytest.mark.parametrize("semiring_", Semiring)
def test_a_contraction_row_by_row_is_that_of_the_whole_sum(shape, semiring_, monkeypatch):
    rng = np.random.default_rng(3)
    weights, table = rng.normal(size=shape), rng.normal(size=(shape[0], 6))
    weights[rng.random(shape) < 0.3] = -np.inf
    table[:, 2] = -np.inf
    whole = reduce(semiring_, weights[..., None] + table.reshape(shape[0], *(1,) * (len(shape) - 1), 6), 0)
    monkeypatch.setattr(semiring, "_WHOLE", 0)
    found = contract(semiring_, weights, table)
    assert found.shape == whole.shape
    np.testing.assert_allclose(found, whole, rtol=1e-14)
    if semiring_ is Semiring.MAX:
        assert found.tobytes() == whole.tobytes()


@pytest.mark.parametrize(("targets", "measurements"), [(3, 7), (1, 5), (2, 0), (0, 3)])
@pytest.mark.parametrize("semiring_", Semiring)
def test_neither_blocks_nor_leaving_out_what_overlaps_changes_a_bit(targets, measurements, semiring_, monkeypatch):
    rng = np.random.default_rng(4)
    stored = injections.injections.__wrapped__(targets, measurements)
    table, weights = rng.normal(size=1 << measurements), rng.normal(size=len(stored.states))
    table[rng.random(len(table)) < 0.2] = -np.inf
    masks = np.arange(1 << measurements)[:, None]
    padded = np.append(table, -np.inf)[np.where(masks & stored.distinct, len(table), masks | stored.distinct)]
    expected = reduce(semiring_, padded + stored.by_mask(weights, semiring_), 1)
    assert stored.absorb(table, weights, semiring_).tobytes() == expected.tobytes()
    monkeypatch.setattr(injections, "STORED_PAIRS", 0)
    monkeypatch.setattr(injections, "_BLOCK_PAIRS", 100)
    bare = injections.injections.__wrapped__(targets, measurements)
    assert bare.unions is None
    assert bare.pairs == padded.size
    assert bare.absorb(table, weights, semiring_).tobytes() == expected.tobytes()


def test_six_shared_targets_and_ten_measurements():
    """19,487,171 pairs of a choice here and a choice there: within reach, and exact."""
    problem = oracle.instance([(0, 1)] * 6, [10, 9], 11, oracle.model("geometric"))
    require_reach(problem)
    vertices = instance_vertices(problem)
    result = run_synchronous(vertices, Semiring.MAX, 3)
    decisions = [vertex.decide(result.incoming[vertex.id]) for vertex in vertices]
    assert joint_score(problem, decisions) == pytest.approx(best_assignment(problem).score, abs=1e-9)


def test_a_scenario_beyond_reach_is_a_finding_at_its_problem(scenarios: Path):
    crowd = ["problem.targets.count=150", "seed=1"]
    loaded = load(scenarios / "chen2006" / "association-csmp.yaml", crowd)
    with pytest.raises(ScenarioError) as caught:
        build(loaded)
    (finding,) = caught.value.findings
    assert finding.path == "problem"
    assert "25 sensors, 150 targets" in str(finding)


def test_of_fifty_problems_of_54_targets_none_is_refused():
    grid_m = np.array([[5.0 * x, 5.0 * y] for x in range(5) for y in range(5)])
    parameters = AssociationParameters(targets=UniformTargets(count=54))
    instances = [draw(parameters, grid_m, range(25), Streams(seed)).instance for seed in range(50)]
    for instance in instances:
        require_reach(instance)
    assert max(max(sensor_states(instance)) for instance in instances) > 2e7  # the paper's figure


def test_bearings_too_exact_for_the_quadrature_are_refused_before_the_start(scenarios: Path):
    exact = ["problem.bearing_sd_rad=0.01", "problem.targets.count=17"]
    with pytest.raises(ScenarioError, match=r"grid of .* points, more than the 4,000,000 supported"):
        build(load(scenarios / "chen2006" / "association-bearing.yaml", exact))


def test_a_quadrature_over_very_many_choices_is_refused_by_its_size():
    model = replace(oracle.model("geometric"), measures="bearing", bearing_sd_rad=0.05)
    base = oracle.instance([(0, 1, 2)], [90, 90, 30], 1, model)
    bearings = tuple(np.zeros((count, 1)) for count in (90, 90, 30))
    problem = replace(base, measurements_m=bearings, sensors_m=((4.0, 3.0), (-3.0, 2.0), (0.0, -4.0)))
    (most,) = (each for each in demands(problem) if "points of the quadrature" in each.who)
    assert most.share > 1.0
    at = problem.means_m[0], problem.covariances_m2[0], np.array(problem.sensors_m)
    with pytest.raises(ScenarioError, match=f"quadrature of one target's evidence has {most.entries} entries"):
        polar_log_evidence(*at, bearings, "bearing", model.range_sd_m, model.bearing_sd_rad)
