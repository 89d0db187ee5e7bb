"""`netsim flow` on a run of tree-reweighted max-product: its spanning trees."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from netsim.cli.console import counted, say, show
from netsim.errors import ScenarioError
from netsim.flow.trees import Forest, SpanningTrees

_NAMED = 8

Names = Mapping[int, str]


def show_trees(trees: SpanningTrees, out: Path | None, rounds: str | None, columns: int, *, as_json: bool) -> None:
    """Print the trees, and draw them if a picture is asked for.

    Raises:
        ScenarioError: If rounds are asked for.
    """
    if rounds is not None:
        message = (
            f"--rounds {rounds}: expected a run whose nodes share rounds, got one of tree-reweighted max-product, whose "
            "components iterate each at its own pace; without --rounds its spanning trees are shown"
        )
        raise ScenarioError(message)
    names = {int(vertex): name for vertex, name in zip(trees.model.variable, trees.model.name, strict=True)}
    if as_json:
        plain = {"trees": [plain_tree(each, names) for each in trees.forests], "components": _components(trees, names)}
        say(json.dumps(plain, indent=1))
    else:
        _print(trees, names)
    if out is not None:
        _draw(trees, columns, out, quiet=as_json)


def plain_tree(forest: Forest, names: Names) -> dict[str, Any]:
    """A tree for JSON, vertices by name."""
    return {
        "tree": forest.number,
        "roots": [names[vertex] for vertex in forest.roots],
        "parents": {names[child]: names[parent] for child, parent in sorted(forest.edges)},
        "new_edges": [[names[child], names[parent]] for child, parent in sorted(forest.new)],
        "height": forest.height,
    }


def _components(trees: SpanningTrees, names: Names) -> list[dict[str, Any]]:
    """What the components' roots recorded, the largest first."""
    ordered = sorted(trees.components, key=lambda each: (-each["vertices"], each["root"]))
    return [{**each, "root": names[each["root"]]} for each in ordered]


def _print(trees: SpanningTrees, names: Names) -> None:
    table = Table(box=box.SIMPLE_HEAD, title=f"Spanning trees: {trees.title}", title_justify="left")
    for column in ("tree", "edges", "in no tree before", "height"):
        table.add_column(column, justify="right")
    table.add_column("roots", overflow="fold")
    for each in trees.forests:
        roots = [names[vertex] for vertex in each.roots if vertex in each.parents.values()]
        told = ", ".join([*roots[:_NAMED], *([f"{len(roots) - _NAMED} more"] if len(roots) > _NAMED else [])])
        table.add_row(f"{each.number}", f"{len(each.edges):,}", f"{len(each.new):,}", f"{each.height}", told)
    show(table)
    _print_components(trees, names)


def _print_components(trees: SpanningTrees, names: Names) -> None:
    """What was proved, component by component; those of one vertex together."""
    table = Table(box=box.SIMPLE_HEAD, title="Connected components of the model", title_justify="left")
    table.add_column("root of the first tree")
    for column in ("vertices", "trees", "iterations"):
        table.add_column(column, justify="right")
    table.add_column("most probable state")
    alone = [each for each in trees.components if each["vertices"] == 1]
    for each in _components(trees, names):
        if each["vertices"] > 1:
            numbers = (f"{each[key]:,}" for key in ("vertices", "trees", "iterations"))
            table.add_row(each["root"], *numbers, "proved" if each["proved"] else "not proved")
    show(table)
    finished = sum(each["vertices"] for each in trees.components)
    rest = f"; {counted(len(alone), 'more component')} of one vertex" if alone else ""
    lost = len(names) - finished
    say(f"{len(names)} vertices{rest}{f'; {lost} heard no last verdict' if lost else ''}")


def _draw(trees: SpanningTrees, columns: int, out: Path, *, quiet: bool) -> None:
    from netsim.flow.picture import MOST_PANELS
    from netsim.flow.tree_picture import write_tree_picture

    write_tree_picture(trees, MOST_PANELS, columns, out)
    if not quiet:
        left = f" of the first {MOST_PANELS} trees" if len(trees.forests) > MOST_PANELS else ""
        say(f"wrote {out}{left}")
