"""`netsim flow` on a run of the quickstart."""

import json
import re
from pathlib import Path

import pytest

import netsim
from netsim.cli.flow import chosen_rounds, flow_command, spans
from netsim.cli.questions import Question, ask
from netsim.errors import ScenarioError
from netsim.trace.events import VariablePlacement
from netsim.trace.reader import read_trace


@pytest.fixture(scope="module")
def run(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "out"
    netsim.run(netsim.load(scenarios / "quickstart.yaml", ["seed=11"]), folder=folder)
    return folder


def test_the_rounds_are_those_of_the_metrics(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flow_command(run, None, "0-10", 4, as_json=True)
    rounds = json.loads(capsys.readouterr().out)
    metrics = json.loads((run / "metrics.json").read_text())
    assert [len(each["senders"]) for each in rounds] == metrics["senders_by_round"]
    assert [len(each["messages"]) for each in rounds] == metrics["graph_messages_by_round"]
    assert sum(len(each["woken"]) for each in rounds) == metrics["vertices_woken"] > 0
    assert sum(each["over_air"] for each in rounds) == metrics["graph_messages_over_air"]


def test_who_wakes_a_sensor_is_on_the_nodes_that_inspect_names(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The messages of round 1 that led to what n03 sent in round 2 are those of the vertices that woke its sensor."""
    flow_command(run, None, "2", 4, as_json=True)
    (this,) = json.loads(capsys.readouterr().out)
    (woken,) = (each for each in this["woken"] if each["vertex"] == "sensor 3")
    (model,) = (event for _, event in read_trace(run / "trace.mcap", {VariablePlacement.topic}))
    host = dict(zip(model.name, model.host, strict=True))
    ask(run, Question(why="n03", round=2))
    told = re.findall(r"^[├└]── #\d+ belief of round 1 from n(\d\d)", capsys.readouterr().out, re.MULTILINE)
    assert {host[name] for name in woken["after_messages_of"]} - {3} == set(map(int, told))


def test_a_table_and_a_picture(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flow_command(run, tmp_path / "flow.svg", None, 2, as_json=False)
    told = capsys.readouterr().out
    assert "Information flow: quickstart, seed 11" in told
    assert "nothing was sent in the last" in told
    assert f"wrote {tmp_path / 'flow.svg'}" in told
    assert (tmp_path / "flow.svg").read_text().startswith("<?xml")


def test_rounds_are_numbers_and_ranges() -> None:
    assert chosen_rounds("5-7, 0,2,6", 9) == [0, 2, 5, 6, 7]
    for text in ("", "a", "3-1", "1-", "-2", "1.5"):
        with pytest.raises(ScenarioError, match="--rounds: expected numbers and ranges"):
            chosen_rounds(text, 9)
    with pytest.raises(
        ScenarioError, match="--rounds: expected rounds from 0 to 9, the last of this run; got 1000000000"
    ):
        chosen_rounds("0-1000000000", 9)


def test_a_picture_has_a_known_ending(run: Path, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"x.pdf: expected the name of a picture that ends in .png or .svg"):
        flow_command(run, tmp_path / "x.pdf", None, 4, as_json=False)
    with pytest.raises(ScenarioError, match=r"--out .*: expected a folder that exists, got .*nowhere; make it"):
        flow_command(run, tmp_path / "nowhere" / "x.png", None, 4, as_json=False)


def test_rounds_are_told_as_ranges() -> None:
    assert spans([0, 1, 2, 5, 7, 8]) == "0-2, 5, 7-8"
    assert spans([3]) == "3"


def test_a_picture_leaves_out_rounds_that_bring_nothing_new(
    scenarios: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Max-product sends the same messages in every round."""
    changes = ["seed=11", "algorithm={type: max-product, rounds: 3}"]
    netsim.run(netsim.load(scenarios / "quickstart.yaml", changes), folder=tmp_path / "out")
    flow_command(tmp_path / "out", tmp_path / "flow.svg", None, 2, as_json=False)
    told = capsys.readouterr().out
    assert f"wrote {tmp_path / 'flow.svg'}: round 0, without 1-3: nothing was sent, or the same as before" in told


def test_what_holds_no_trace_is_told_apart(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="got one without any; give the folder that `netsim run` wrote"):
        flow_command(tmp_path, None, None, 4, as_json=False)
    (tmp_path / "metrics.json").write_text("{}")
    with pytest.raises(ScenarioError, match="got a run that wrote none; run it again without --no-trace"):
        flow_command(tmp_path, None, None, 4, as_json=False)
    (tmp_path / "study.json").write_text("{}")
    with pytest.raises(ScenarioError, match="got that of a study"):
        flow_command(tmp_path, None, None, 4, as_json=False)


def test_a_trace_cut_short_before_its_first_events_is_refused(run: Path, tmp_path: Path) -> None:
    data = (run / "trace.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: data.index(b"metrics.json")])
    with pytest.raises(ScenarioError, match="cut short before its first ones; copy the file again"):
        flow_command(cut, None, None, 4, as_json=False)


@pytest.fixture(scope="module")
def trmp(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("trmp") / "out"
    path = scenarios / "chen2006" / "association-trmp.yaml"
    netsim.run(netsim.load(path, ["problem.targets.count=8"]), folder=folder)
    return folder


def test_tree_reweighted_max_product_shows_its_trees(trmp: Path, tmp_path: Path, capsys) -> None:
    flow_command(trmp, None, None, 4, as_json=True)
    told = json.loads(capsys.readouterr().out)
    metrics = json.loads((trmp / "metrics.json").read_text())
    assert len(told["trees"]) == metrics["trmp_trees"]
    assert max(each["iterations"] for each in told["components"]) == metrics["trmp_iterations"]
    (model,) = (event for _, event in read_trace(trmp / "trace.mcap", {VariablePlacement.topic}))
    assert sum(len(each["new_edges"]) for each in told["trees"]) == len(model.edge_a)
    flow_command(trmp, tmp_path / "trees.svg", None, 2, as_json=False)
    printed = capsys.readouterr().out
    assert "Spanning trees: association-trmp, seed 1" in printed
    assert " proved" in printed
    assert f"wrote {tmp_path / 'trees.svg'}" in printed


def test_tree_reweighted_max_product_has_no_rounds_to_choose(trmp: Path) -> None:
    with pytest.raises(ScenarioError, match="--rounds 0-2: expected a run whose nodes share rounds"):
        flow_command(trmp, None, "0-2", 4, as_json=False)
