"""Algorithms and graphical models that do not go together are refused when the scenario is loaded."""

from pathlib import Path

import pytest

from netsim.errors import ScenarioError
from netsim.scenario.load import load

ASSOCIATION = Path("scenarios/chen2006/association-csmp.yaml")
GRAPH = Path("scenarios/graphs/grid-sum-product.yaml")
DISTRIBUTION = Path("scenarios/chen2006/target-distribution.yaml")
GEOMETRIC = "problem.false_alarms=geometric"


@pytest.mark.parametrize(
    ("path", "overrides", "got"),
    [
        (ASSOCIATION, ["problem.model=target", GEOMETRIC], "model: target"),
        (ASSOCIATION, ["problem.model=sensor"], "model: sensor"),
        (GRAPH, [], "the problem `factor-graph`"),
    ],
)
def test_rehosting_needs_the_hybrid_model(path, overrides, got):
    with pytest.raises(ScenarioError) as refused:
        load(path, [*overrides, "algorithm.rehost=true"])
    (finding,) = refused.value.findings
    assert finding.path == "algorithm.rehost"
    assert finding.got == f"rehost: true with {got}"
    assert finding.remedy
    load(path, overrides)


def test_the_algorithm_of_a_group_is_looked_at_too():
    own = "nodes[0].algorithm={type: max-product, rehost: true}"
    with pytest.raises(ScenarioError, match=r"nodes\[0\].algorithm.rehost: expected false"):
        load(ASSOCIATION, ["problem.model=sensor", own])


def test_the_line_of_the_file_is_named(tmp_path):
    text = Path("scenarios/chen2006/dead-host.yaml").read_text(encoding="utf-8")
    text = text.replace("extends: ", f"extends: {ASSOCIATION.parent.resolve()}/")
    file = tmp_path / "dead-host.yaml"
    file.write_text(text, encoding="utf-8")
    line = next(number for number, words in enumerate(text.splitlines(), 1) if "rehost:" in words)
    with pytest.raises(ScenarioError, match=rf"dead-host.yaml:{line}: algorithm.rehost"):
        load(file, ["problem.model=sensor"])


@pytest.mark.parametrize("model", ["hybrid", "target", "sensor"])
def test_hybrid_models_may_rehost_and_trmp_runs_on_every_model(model):
    load(ASSOCIATION, ["algorithm={type: trmp}", f"problem.model={model}", GEOMETRIC])
    if model == "hybrid":
        load(ASSOCIATION, ["algorithm.rehost=true", f"problem.model={model}", GEOMETRIC])


def test_trmp_is_refused_for_target_distribution():
    with pytest.raises(
        ScenarioError, match=r"algorithm.type: expected an algorithm for the problem `target-distribution`"
    ):
        load(DISTRIBUTION, ["algorithm={type: trmp}"])
