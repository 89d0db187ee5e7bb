"""A picture of spanning trees: one panel a tree, its edges from child to parent over the grey graph."""

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D

from netsim.flow import look
from netsim.flow.drawing import save, styled
from netsim.flow.layout import GraphLayout, lay_out
from netsim.flow.panels import LOOKS, Canvas, draw_arrows, draw_graph, draw_vertices, make_canvas
from netsim.flow.picture import (
    HEAD_IN,
    LEGEND_IN,
    PANEL_IN,
    TEXT_IN,
    kind_handles,
    panel_height_in,
)
from netsim.flow.rounds import State
from netsim.flow.trees import Forest, SpanningTrees


def write_tree_picture(trees: SpanningTrees, most: int, columns: int, path: Path) -> None:
    """Draw the trees and write the picture.

    Args:
        trees: What to draw.
        most: How many trees get a panel at most, the first.
        columns: How many panels stand side by side at most.
        path: Where to write; a name that ends in `.png` or `.svg`.

    Raises:
        NetsimError: If the file cannot be written.
    """
    with styled():
        save(draw_trees(trees, most, columns), path)


def draw_trees(trees: SpanningTrees, most: int, columns: int) -> Figure:
    """The picture as a figure."""
    layout = lay_out(trees.model, trees.nodes, trees.truth)
    canvas = make_canvas(layout, PANEL_IN)
    shown = trees.forests[:most]
    across = min(columns, len(shown))
    rows = -(-len(shown) // across)
    panels_in = rows * (panel_height_in(canvas) + TEXT_IN)
    width_in = max(7.4, across * (PANEL_IN + 0.12))
    figure = Figure(figsize=(width_in, HEAD_IN + panels_in + LEGEND_IN), layout="constrained")
    grid = figure.add_gridspec(2, 1, height_ratios=[HEAD_IN + panels_in, LEGEND_IN])
    above, below = (figure.add_subfigure(grid[row]) for row in range(2))
    above.suptitle(f"Spanning trees: {trees.title}", x=0.01, ha="left", fontsize=11, color=look.INK)
    axes = above.subplots(rows, across, squeeze=False).flat
    for axis, forest in zip(axes, shown, strict=False):
        _draw_panel(axis, canvas, forest)
    for axis in axes[len(shown) :]:
        axis.set_axis_off()
    _draw_legend(below, layout)
    return figure


def _draw_panel(axes: Axes, canvas: Canvas, forest: Forest) -> None:
    draw_graph(axes, canvas)
    draw_arrows(axes, canvas, sorted(forest.edges - forest.new), look.SILENT_EDGE, 2)
    draw_arrows(axes, canvas, sorted(forest.new), look.SENDS, 3)
    draw_vertices(axes, canvas, [_state(forest, vertex) for vertex in canvas.layout.row_of])
    edges = len(forest.edges)
    axes.set_title(f"Tree {forest.number}: {edges} edge{'' if edges == 1 else 's'}, {len(forest.new)} new", loc="left")


def _state(forest: Forest, vertex: int) -> State:
    """How a vertex looks: roots stand out, a vertex that is in no edge of the tree stands back."""
    if vertex not in forest.parents:
        return "silent"
    if forest.parents[vertex] is not None:
        return "fell silent"
    return "wakes" if vertex in forest.parents.values() else "silent"


def _draw_legend(figure: SubFigure, layout: GraphLayout) -> None:
    words: dict[State, str] = {"wakes": "root", "fell silent": "in the tree", "silent": "not in it"}
    handles = [
        Line2D([], [], ls="", marker="o", ms=8, mfc=LOOKS[state][0], mec=LOOKS[state][1], label=label)
        for state, label in words.items()
    ]
    arrow: dict[str, Any] = {"ls": "-", "marker": ">", "markevery": (1, 2), "ms": 5, "lw": 1.2}
    handles.append(Line2D([0, 1], [0, 0], color=look.SENDS, label="to the parent, edge in no tree before", **arrow))
    handles.append(Line2D([0, 1], [0, 0], color=look.SILENT_EDGE, label="to the parent, edge in one before", **arrow))
    figure.legend(
        handles=handles + kind_handles(layout), loc="center", ncols=4, fontsize=8, columnspacing=1.6, handletextpad=0.5
    )
