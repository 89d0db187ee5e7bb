"""One round as a panel: the graph in grey, the round's messages as arrows, the vertices by what they do."""

import textwrap
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import NDArray

from netsim.flow import look
from netsim.flow.layout import GraphLayout
from netsim.flow.rounds import Edge, Round, State, waking

Floats = NDArray[np.float64]

_MARGIN = 0.75  # of the gap, around the outermost vertices
_ARROW_WIDTH = 0.085  # of a vertex's diameter
_TOLD_WHY = 3
_LINE_CHARACTERS = 56
_LINES = 2


@dataclass(frozen=True)
class Canvas:
    """What all panels share.

    Attributes:
        layout: Where the vertices are.
        mark_pt: Diameter of a vertex, points.
        mark_m: The same in the layout's metres.
    """

    layout: GraphLayout
    mark_pt: float
    mark_m: float

    @property
    def limits(self) -> tuple[Floats, Floats]:
        """Opposite corners of a panel."""
        place, margin = self.layout.place_m, _MARGIN * self.layout.gap_m
        return place.min(axis=0) - margin, place.max(axis=0) + margin


def make_canvas(layout: GraphLayout, width_in: float) -> Canvas:
    """Marks as large as the layout's gap allows in a panel of that width."""
    low, high = Canvas(layout, 0.0, 0.0).limits
    point_per_m = 72.0 * width_in / float(max(high - low))
    mark_pt = min(look.MARK_PT, 0.86 * layout.gap_m * point_per_m)
    return Canvas(layout, mark_pt, mark_pt / point_per_m)


def draw_panel(
    axes: Axes, canvas: Canvas, this: Round, following: Round | None, down: Collection[int] = (), note: str = ""
) -> None:
    """Draw a round.

    Args:
        axes: Where to.
        canvas: Layout and sizes.
        this: The round.
        following: The next one: messages that wake somebody in it are marked.
        down: Vertices whose node is down.
        note: What else is to be said below the panel.
    """
    draw_graph(axes, canvas)
    wake = waking(this, following)
    draw_arrows(axes, canvas, [edge for edge in this.messages if edge not in wake], look.SENDS, 2)
    draw_arrows(axes, canvas, sorted(wake), look.WAKES, 3)
    draw_vertices(axes, canvas, [this.state_of(vertex) for vertex in canvas.layout.row_of])
    draw_crosses(axes, canvas, down)
    axes.set_title(title_of(this), loc="left")
    told = "\n".join(each for each in (wakes_text(canvas.layout, this), note) if each)
    axes.set_xlabel(told, fontsize=7.5, color=look.WAKES)


def draw_graph(axes: Axes, canvas: Canvas) -> None:
    """The panel's frame, and the edges of the model in grey."""
    layout = canvas.layout
    low, high = canvas.limits
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_color(look.GRID)
    lines = LineCollection(list(layout.place_m[layout.edges]), colors=look.EDGE, linewidths=0.8, zorder=1)
    axes.add_collection(lines)


def title_of(this: Round) -> str:
    """The round, its senders and its messages."""
    name = "Start round" if this.number == 0 else f"Round {this.number}"
    return f"{name}: {_counted(len(this.senders), 'sender')}, {_counted(len(this.messages), 'message')}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def wakes_text(layout: GraphLayout, this: Round) -> str:
    """Who wakes; where these are few, after messages of whom too."""
    name = dict(zip(layout.row_of, layout.label, strict=True))
    if len(this.woken) > _TOLD_WHY:
        told = "wake: " + ", ".join(name[vertex] for vertex in this.woken)
    else:
        told = "; ".join(
            f"{name[vertex]} wakes" + (f" after {', '.join(name[by] for by in sources)}" if sources else "")
            for vertex, sources in this.woken.items()
        )
    return "\n".join(textwrap.wrap(told, _LINE_CHARACTERS, max_lines=_LINES, placeholder=" ..."))


def draw_arrows(axes: Axes, canvas: Canvas, messages: Sequence[Edge], colour: str, order: int) -> None:
    """Arrows from rim to rim, a little to the right of the edge as seen by the sender."""
    if not messages:
        return
    tail, way = canvas.layout.arrows(messages, canvas.mark_m)
    axes.quiver(
        *tail.T, *way.T, angles="xy", scale_units="xy", scale=1.0, units="inches", color=colour, zorder=order,
        width=_ARROW_WIDTH * canvas.mark_pt / 72, headwidth=4.6, headlength=5.2, headaxislength=4.6, minlength=0.0,
    )  # fmt: skip


def draw_crosses(axes: Axes, canvas: Canvas, vertices: Collection[int]) -> None:
    """Cross out vertices."""
    place = canvas.layout.place_m[[canvas.layout.row_of[vertex] for vertex in sorted(vertices)]].reshape(-1, 2)
    axes.scatter(
        place[:, 0], place[:, 1], s=(1.15 * canvas.mark_pt) ** 2, marker="x", color=look.INK, linewidths=1.1, zorder=6
    )


def draw_vertices(axes: Axes, canvas: Canvas, states: Sequence[State]) -> None:
    """The vertices in the order of the layout, each by its state."""
    layout = canvas.layout
    for square, marker, size in ((False, "o", 1.0), (True, "s", 0.86)):
        for state, (fill, edge, _) in LOOKS.items():
            rows = [row for row, each in enumerate(states) if each == state and layout.is_square[row] == square]
            place = layout.place_m[rows].reshape(-1, 2)
            axes.scatter(
                place[:, 0], place[:, 1], s=(size * canvas.mark_pt) ** 2, marker=marker, facecolors=fill, edgecolors=edge,
                linewidths=0.8, zorder=4,
            )  # fmt: skip
    label_pt = look.LABEL_PT * canvas.mark_pt / look.MARK_PT
    if label_pt >= look.LEAST_LABEL_PT:
        for (x, y), label, state in zip(layout.place_m, layout.label, states, strict=True):
            size = min(label_pt, 2.6 * label_pt / max(1, len(label)))
            axes.text(x, y, label, ha="center", va="center_baseline", fontsize=size, color=LOOKS[state][2], zorder=5)


LOOKS: dict[State, tuple[str, str, str]] = {
    "silent": (look.SILENT_FILL, look.SILENT_EDGE, "#8a96a3"),
    "fell silent": ("white", look.SENDS, look.SENDS),
    "sends": (look.SENDS, look.SENDS, "white"),
    "wakes": (look.WAKES, look.WAKES, "white"),
}
"""Fill, rim and label of a vertex in each state."""
