"""Every figure is defined, and everything defined exists."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenario import tracking_scenario

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import (
    CATALOGUE,
    DEFAULT_COSTS,
    DEFAULT_METRICS,
    ERROR_METRICS,
    flatten,
    markdown_table,
    metric_of,
)
from netsim.metrics.reach import Reach
from netsim.scenario.load import LoadedScenario, load
from netsim.scenario.outlook import lifetime_figures
from netsim.scenario.run import run

DOCUMENT = Path(__file__).parents[2] / "docs" / "metrics.md"
LONGEST_S = 45
NO_NUMBER = {"scenario", "seed", "interrupted", "energy_most_node"}


@pytest.fixture(scope="module")
def figures(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, object]]:
    """What the shipped scenarios give in their first seconds, with the lifetimes where they plan a day; one with tracks."""
    shipped = (path for path in sorted(scenarios.rglob("*.yaml")) if "kind: scenario" in path.read_text())
    return [
        *(_all_of(_shortened(path)) for path in shipped),
        _all_of(tracking_scenario(tmp_path_factory.mktemp("tracking"))),
    ]


def _shortened(path: Path) -> LoadedScenario:
    """A scenario cut off when all that the shipped ones do has begun."""
    loaded = load(path)
    return loaded if loaded.scenario.duration_s <= LONGEST_S else load(path, [f"duration_s={LONGEST_S}"])


def _all_of(loaded: LoadedScenario) -> dict[str, object]:
    reach = Reach()
    metrics = run(loaded, observers=[reach]).metrics
    return {**metrics, **lifetime_figures(loaded, metrics, reach.links, reach.hosts)}


def test_what_scenarios_give_is_what_is_defined(figures: list[dict[str, object]]) -> None:
    given_names = {name for each in figures for name in each}
    assert given_names - set(CATALOGUE) == set()
    assert set(CATALOGUE) - given_names == set()


def test_names_end_in_the_unit(figures: list[dict[str, object]]) -> None:
    endings = {
        "s": "_s",
        "J": "_j",
        "byte": "_byte",
        "nat": "_nat",
        "m": "_m",
        "m2": "_m2",
        "bit": "_bit",
        "day": "_days",
    }
    for name, metric in CATALOGUE.items():
        assert (metric.unit == "") == (name in NO_NUMBER), name
        if metric.unit in endings:
            assert name.endswith(endings[metric.unit]), name
        assert metric.definition.endswith(".")
        assert metric.source


def test_entries_of_dictionaries_belong_to_their_metric(figures: list[dict[str, object]]) -> None:
    for each in figures:
        flat = flatten(each)
        assert {metric_of(name).name for name in flat} <= set(each)
        states = {name: value for name, value in flat.items() if name.startswith("energy_by_state_j.")}
        assert sum(states.values()) == pytest.approx(each["energy_j"], rel=1e-12)


def test_energy_beyond_listening_is_what_the_states_leave(figures: list[dict[str, object]]) -> None:
    standing = ("radio.listen", "radio.sleep", "radio.off", "radio.dead", "cpu.sleep", "cpu.off", "cpu.dead")
    for each in figures:
        states = each["energy_by_state_j"]
        rest_j = each["energy_j"] - sum(states.get(state, 0.0) for state in standing)
        assert each["energy_beyond_listening_j"] == pytest.approx(rest_j, rel=1e-9)
        assert sum(each["energy_by_device_j"].values()) == pytest.approx(each["energy_j"], rel=1e-12)


def test_choices_are_defined() -> None:
    for name in (*ERROR_METRICS, *DEFAULT_COSTS, *DEFAULT_METRICS):
        assert name in CATALOGUE
    assert all(CATALOGUE[name].better == "lower" for name in (*ERROR_METRICS, *DEFAULT_COSTS))
    assert len(set(DEFAULT_METRICS)) == len(DEFAULT_METRICS)


def test_an_unknown_name_is_told_with_similar_ones() -> None:
    with pytest.raises(ScenarioError, match=r"did you mean .*energy_by_node_j"):
        metric_of("energy_by_nodes_j.n03")


KEYS = st.text(st.characters(exclude_characters="."))
NESTED = st.recursive(
    st.none() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.dictionaries(KEYS, inner, max_size=3) | st.lists(inner, max_size=2),
    max_leaves=12,
)


@given(st.dictionaries(KEYS, NESTED, max_size=4))
def test_flattened_figures_are_scalars_and_all_there(figures: dict[str, object]) -> None:
    def leaves(value: object) -> int:
        return sum(map(leaves, value.values())) if isinstance(value, dict) else not isinstance(value, list)

    flat = flatten(figures)
    assert not any(isinstance(value, dict | list) for value in flat.values())
    assert len(flat) == leaves(figures)
    assert all(flat[key] == value for key, value in figures.items() if not isinstance(value, dict | list))


def test_the_document_is_up_to_date() -> None:
    assert markdown_table() in DOCUMENT.read_text(encoding="utf-8"), "write it anew: python tools/document_metrics.py"
