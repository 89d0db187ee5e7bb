"""Models whose variables other nodes host: the run equals the central kernel, and every sensor hears its association."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from test_message_passing import IDEAL, SEMIRING, sent_by_round, simulate

from netsim.algorithms.association_report import decode_claims, encode_claims
from netsim.algorithms.message_passing_parameters import rule_of
from netsim.errors import ScenarioError
from netsim.kernels.association_graph import decide_by_claims, graph_vertices
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.central import run_synchronous
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import Association, Problem

FEW = ["problem.false_alarms=geometric", "problem.targets.count=4"]


@pytest.mark.parametrize("model", ["sensor", "target"])
@pytest.mark.parametrize("algorithm", ["csmp", "sum-product"])
def test_sensors_hear_what_the_central_kernel_decides(scenarios: Path, model: str, algorithm: str) -> None:
    overrides = [*FEW, f"problem.model={model}", f"algorithm={{type: {algorithm}, rounds: 5}}", *IDEAL]
    parameters, keep, _ = simulate(scenarios / "chen2006" / "association-csmp.yaml", overrides)
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    assert instance.graph == model
    vertices, semiring = graph_vertices(instance), SEMIRING[algorithm]
    central = run_synchronous(vertices, semiring, 5, rule_of(parameters), stop_when_converged=False)
    assert sent_by_round(keep) == {count.round: set(count.sent) for count in central.rounds}
    claims: dict[int, dict[int, np.ndarray]] = {sensor: {} for sensor in range(25)}
    for vertex in vertices:
        for (sensor, target), row in vertex.claims(central.incoming[vertex.id], semiring).items():  # type: ignore[attr-defined]
            claims[sensor][target] = row
    decided = {event.node: event.target for event in keep.of(Association)}
    assert len(decided) == 25
    for sensor, points in enumerate(instance.measurements_m):
        expected = decide_by_claims(claims[sensor], len(points), semiring)
        assert decided[instance.sensor_nodes[sensor]] == expected.tolist()


@pytest.mark.parametrize("model", ["sensor", "target"])
def test_models_work_over_a_radio_that_sleeps(scenarios: Path, model: str) -> None:
    overrides = [*FEW, f"problem.model={model}", "algorithm.sleep=scheduled", "algorithm.rounds=4"]
    _, keep, _ = simulate(scenarios / "chen2006" / "association-csmp.yaml", overrides)
    assert len({event.node for event in keep.of(Association)}) == 25


@given(
    st.dictionaries(
        st.integers(0, 65535), arrays.arrays(float, st.integers(1, 6), elements=st.floats(0, 1)), max_size=4
    )
)
def test_claims_survive_the_air(claims: dict[int, np.ndarray]) -> None:
    heard = decode_claims(encode_claims(claims, "float64"), "float64")
    assert {target: row.tolist() for target, row in heard.items()} == {t: row.tolist() for t, row in claims.items()}


def test_what_cannot_be_is_refused_before_the_run(scenarios: Path) -> None:
    path = scenarios / "chen2006" / "association-csmp.yaml"
    with pytest.raises(ScenarioError, match=r"false_alarms: geometric .* model: target"):
        load(path, ["problem.model=target"])
    with pytest.raises(ScenarioError, match=r"one variable of .* joint associations, more than"):
        run(load(path, ["problem.model=sensor"]))
