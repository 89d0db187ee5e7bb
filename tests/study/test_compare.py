"""Runs side by side, from folders and from traces."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import netsim
from netsim.errors import ScenarioError
from netsim.study.compare import Held, compare, rows_of
from netsim.study.contender import are_studies, contender
from netsim.study.settings import Setting
from netsim.trace.events import GraphMessages


@pytest.fixture(scope="module")
def runs(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """A run, the same again, one of another tolerance without a trace, and one with."""
    made: dict[str, Path] = {}
    folder = tmp_path_factory.mktemp("runs")
    for name, changes, trace in (
        ("one", [], True),
        ("again", [], True),
        ("silent", ["algorithm.tolerance=0.5"], False),
        ("tolerant", ["algorithm.tolerance=0.5"], True),
    ):
        made[name] = folder / name
        made[name].mkdir()
        netsim.run(netsim.load(scenarios / "quickstart.yaml", changes), folder=made[name], trace=trace)
    return made


def test_equal_runs_are_equal_in_everything(runs: Mapping[str, Path]) -> None:
    comparison = compare([runs["one"], runs["again"]])
    assert comparison.settings == []
    assert comparison.versions == []
    assert all(row.is_equal for row in comparison.rows)
    assert comparison.lists == []
    assert (comparison.partings, comparison.traced) == ((None,), (True,))


def test_each_is_held_against_the_first(runs: Mapping[str, Path]) -> None:
    comparison = compare([runs["one"], runs["silent"], runs["tolerant"]])
    assert comparison.settings == [Setting("algorithm.tolerance", ("0.1", "0.5", "0.5"))]
    rows = {row.metric: row for row in comparison.rows}
    figures = [json.loads((runs[name] / "metrics.json").read_text()) for name in ("one", "silent")]
    row = rows["radio_messages"]
    first, later = (each["radio_messages"] for each in figures)
    assert first != later
    assert row.first == first
    assert row.others == (Held(later, later - first, (later - first) / first),) * 2
    assert rows["energy_by_state_j.radio.listen"].first == figures[0]["energy_by_state_j"]["radio.listen"]
    assert comparison.rows[0].metric == "association_error"
    assert "graph_messages_by_round" in comparison.lists
    assert comparison.traced == (False, True)


def test_traces_part_where_the_tolerance_first_matters(runs: Mapping[str, Path]) -> None:
    """The first event that differs is a round in which one sends a graph message that the other withholds."""
    parting = compare([runs["one"], runs["tolerant"]]).partings[0]
    assert parting is not None
    assert parting.first is not None
    assert parting.second is not None
    sent, withheld = parting.first.event, parting.second.event
    assert isinstance(sent, GraphMessages)
    assert isinstance(withheld, GraphMessages)
    assert (sent.node, sent.round) == (withheld.node, withheld.round)
    assert 0.1 < sent.largest_change <= 0.5
    assert len(sent.source) > len(withheld.source)


def test_a_trace_stands_for_its_run(runs: Mapping[str, Path]) -> None:
    folder, trace = contender(runs["one"]), contender(runs["one"] / "trace.mcap")
    assert trace.figures == folder.figures
    assert trace.lists == folder.lists
    assert trace.scenario == folder.scenario
    assert trace.versions == {"netsim": folder.versions["netsim"]}
    comparison = compare([runs["one"], runs["one"] / "trace.mcap"])
    assert (comparison.settings, comparison.versions, comparison.partings) == ([], [], (None,))


def figures(**changes: Any) -> Mapping[str, Any]:
    return {"energy_j": 0.0, "deaths": 1, "energy_most_node": "n01", **changes}


def test_what_is_no_number_has_no_difference() -> None:
    given = [figures(first_death_s=None), figures(first_death_s=2.0, energy_most_node="n02", energy_j=1.0)]
    rows = {row.metric: row for row in rows_of(given)}
    assert rows["first_death_s"].others == (Held(2.0, None, None),)
    assert rows["energy_most_node"].others == (Held("n02", None, None),)
    assert rows["energy_j"].others == (Held(1.0, 1.0, float("inf")),)
    assert rows["energy_j"].unit == "J"
    assert [rows[name].is_equal for name in ("first_death_s", "energy_most_node", "deaths")] == [False, False, True]


def test_what_cannot_be_compared_is_refused(runs: Mapping[str, Path], tmp_path: Path) -> None:
    study = tmp_path / "study"
    study.mkdir()
    (study / "study.json").write_text("{}")
    one = runs["one"]
    for paths, message in (
        ([one], "expected two or more runs to compare, got 1"),
        ([one, tmp_path / "none"], "got no such file"),
        ([one, runs["again"], one], "got the same one twice"),
        ([one, study], "expected runs only or studies only, got the study .*study and the run .*one"),
    ):
        with pytest.raises(ScenarioError, match=message):
            are_studies(paths)
    assert not are_studies([one, runs["again"]])
    with pytest.raises(ScenarioError, match=r"expected the folder of a finished run, got one without metrics\.json"):
        contender(tmp_path)
    (tmp_path / "metrics.json").write_text("[1]")
    with pytest.raises(ScenarioError, match="expected a JSON object, got list"):
        contender(tmp_path)
    (tmp_path / "metrics.json").write_text("{")
    with pytest.raises(ScenarioError, match="expected JSON"):
        contender(tmp_path)
    with pytest.raises(ScenarioError, match="not an MCAP file"):
        contender(one / "metrics.json")
