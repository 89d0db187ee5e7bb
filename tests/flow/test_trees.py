"""Spanning trees worked out by hand, from records to the picture."""

import json
from pathlib import Path

import pytest
from handmade import write_flow
from matplotlib.colors import to_hex
from matplotlib.quiver import Quiver

from netsim.errors import NetsimError, ScenarioError, TraceError
from netsim.flow import look
from netsim.flow.load import load_flow, load_flow_or_trees
from netsim.flow.tree_picture import draw_trees, write_tree_picture
from netsim.flow.trees import SpanningTrees, forests_of, load_trees

PARENTS = {0: [None, 3], 1: [3, 3], 2: [3, None], 3: [0, 2]}
"""A star of three sensors around vertex 3, rooted at 0, then at 2: all edges are in the first tree already."""


def write_trees(path: Path, parents: dict[int, list[int | None]] = PARENTS) -> Path:
    notes = [("trmp_parents", {"vertex": vertex, "parents": row}) for vertex, row in parents.items()]
    notes.append(("trmp_component", {"root": 0, "vertices": 4, "trees": 2, "iterations": 5, "proved": True}))
    return write_flow(path, shared=False, notes=[(kind, json.dumps(fields)) for kind, fields in notes])


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> SpanningTrees:
    found = load_flow_or_trees(write_trees(tmp_path_factory.mktemp("trees") / "trees.mcap"))
    assert isinstance(found, SpanningTrees)
    return found


def test_what_is_new_in_each_tree() -> None:
    """A ring of four and an edge apart: the ring's second tree has the edge that the first leaves out."""
    ring = {0: [None, 1], 1: [0, None], 2: [1, 3], 3: [0, 0], 7: [None], 8: [7], 9: [None]}
    first, second = forests_of(ring)
    assert first.edges == first.new == {(1, 0), (2, 1), (3, 0), (8, 7)}
    assert (first.roots, first.height) == ((0, 7, 9), 2)
    assert second.edges == {(0, 1), (2, 3), (3, 0)}
    assert second.new == {(2, 3)}  # 0 - 1 is 1 - 0 the other way round
    assert (second.roots, second.height) == ((1,), 3)
    assert forests_of({4: []}) == ()


def test_trees_are_read_from_the_trace(trees: SpanningTrees) -> None:
    assert trees.title == "by hand, seed 4"
    assert [forest.parents for forest in trees.forests] == [
        {vertex: row[number] for vertex, row in PARENTS.items()} for number in (0, 1)
    ]
    assert [each["proved"] for each in trees.components] == [True]


def test_a_panel_shows_a_tree_with_what_is_new_and_its_root(trees: SpanningTrees) -> None:
    figure = draw_trees(trees, 24, 2)
    panels = [axes for axes in figure.axes if axes.get_title(loc="left")]
    assert [axes.get_title(loc="left") for axes in panels] == ["Tree 1: 3 edges, 3 new", "Tree 2: 3 edges, 0 new"]
    arrows = [
        {to_hex(each.get_facecolor()[0]).lower(): each.N for each in axes.collections if isinstance(each, Quiver)}
        for axes in panels
    ]
    assert arrows == [{look.SENDS.lower(): 3}, {look.SILENT_EDGE.lower(): 3}]
    for axes in panels:
        filled = [each for each in axes.collections if not isinstance(each, Quiver) and len(each.get_facecolor())]
        roots = [len(each.get_offsets()) for each in filled if to_hex(each.get_facecolor()[0]) == look.WAKES.lower()]
        assert sum(roots) == 1


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_files_are_the_same_each_time(trees: SpanningTrees, tmp_path: Path, ending: str) -> None:
    paths = [tmp_path / f"{number}.{ending}" for number in range(2)]
    for path in paths:
        write_tree_picture(trees, 1, 3, path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    with pytest.raises(NetsimError, match="cannot write the picture"):
        write_tree_picture(trees, 1, 3, tmp_path / "none" / f"x.{ending}")


def test_who_asks_for_rounds_hears_what_there_is_instead(tmp_path: Path) -> None:
    grown = write_trees(tmp_path / "grown.mcap")
    with pytest.raises(ScenarioError, match=r"netsim flow shows its spanning trees; .*algorithm\.type=max-product"):
        load_flow(grown)
    without = write_flow(tmp_path / "without.mcap", shared=False)
    assert load_trees(without) is None
    with pytest.raises(ScenarioError, match=r"schedule=synchronous \(type trmp: with algorithm\.type=max-product\)"):
        load_flow_or_trees(without)
    with pytest.raises(TraceError, match="trees of the 4 vertices of the model, got vertex 77"):
        load_flow_or_trees(write_trees(tmp_path / "odd.mcap", PARENTS | {77: [None]}))


def test_common_rounds_come_before_trees(tmp_path: Path) -> None:
    assert not isinstance(load_flow_or_trees(write_flow(tmp_path / "rounds.mcap")), SpanningTrees)
