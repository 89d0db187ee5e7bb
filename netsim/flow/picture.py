"""The picture of an information flow: one panel a round, and how many send, wake and fall silent below."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from netsim.flow import look
from netsim.flow.drawing import save, styled
from netsim.flow.layout import GraphLayout, lay_out
from netsim.flow.load import Flow
from netsim.flow.panels import LOOKS, Canvas, draw_panel, make_canvas
from netsim.flow.rounds import Round, State

MOST_PANELS = 24
"""Panels that one picture may have."""

PANEL_IN = 3.1
TEXT_IN = 0.55  # a panel's title and the line below it
_STRIP_IN = 1.7
HEAD_IN = 0.45
LEGEND_IN = 0.35


def write_picture(flow: Flow, numbers: Sequence[int], columns: int, path: Path) -> None:
    """Draw some rounds and write the picture.

    Args:
        flow: What to draw.
        numbers: The rounds that get a panel, in order.
        columns: How many panels stand side by side at most.
        path: Where to write; a name that ends in `.png` or `.svg`.

    Raises:
        NetsimError: If the file cannot be written.
    """
    with styled():
        save(draw(flow, numbers, columns), path)


def draw(flow: Flow, numbers: Sequence[int], columns: int) -> Figure:
    """The picture as a figure."""
    layout = lay_out(flow.model, flow.nodes, flow.truth)
    canvas = make_canvas(layout, PANEL_IN)
    across = min(columns, len(numbers))
    rows = -(-len(numbers) // across)
    panels_in = rows * (panel_height_in(canvas) + TEXT_IN)
    width_in = max(7.4, across * (PANEL_IN + 0.12))
    figure = Figure(figsize=(width_in, HEAD_IN + panels_in + LEGEND_IN + _STRIP_IN), layout="constrained")
    grid = figure.add_gridspec(3, 1, height_ratios=[HEAD_IN + panels_in, LEGEND_IN, _STRIP_IN])
    above, middle, below = (figure.add_subfigure(grid[row]) for row in range(3))
    above.suptitle(f"Information flow: {flow.title}", x=0.01, ha="left", fontsize=11, color=look.INK)
    _draw_panels(above, flow, numbers, (rows, across), canvas)
    _draw_legend(middle, layout, any(flow.down_in(flow.rounds[number]) for number in numbers))
    _draw_strip(below.subplots(), flow.rounds[: flow.last_active + 2], numbers)
    return figure


def panel_height_in(canvas: Canvas) -> float:
    """Height of a panel that is `PANEL_IN` wide."""
    low, high = canvas.limits
    return PANEL_IN * float((high - low)[1] / max(high - low))


def _draw_panels(figure: SubFigure, flow: Flow, numbers: Sequence[int], shape: tuple[int, int], canvas: Canvas) -> None:
    axes = figure.subplots(*shape, squeeze=False).flat
    for axis, number in zip(axes, numbers, strict=False):
        following = flow.rounds[number + 1] if number + 1 < len(flow.rounds) else None
        this = flow.rounds[number]
        draw_panel(axis, canvas, this, following, flow.down_in(this), _takeovers(flow, canvas.layout, number))
    for axis in axes[len(numbers) :]:
        axis.set_axis_off()


def _takeovers(flow: Flow, layout: GraphLayout, number: int) -> str:
    """Who hosts what anew from a round on."""
    nodes = dict(zip(map(int, flow.nodes.node), flow.nodes.name, strict=True))
    return "; ".join(
        f"{layout.label[layout.row_of[each.vertex]]} taken over by {nodes[each.host]} from {nodes[each.before]}"
        for each in flow.hosts.taken_over_for(number)
    )


def _draw_legend(figure: SubFigure, layout: GraphLayout, has_crosses: bool) -> None:
    words: dict[State, str] = {"sends": "sends", "wakes": "wakes: sends again after silence"}
    words |= {"fell silent": "falls silent", "silent": "silent"}
    handles = [
        Line2D([], [], ls="", marker="o", ms=8, mfc=LOOKS[state][0], mec=LOOKS[state][1], label=label)
        for state, label in words.items()
    ]
    if has_crosses:
        handles.append(Line2D([], [], ls="", marker="x", ms=8, mec=look.INK, label="its node is down"))
    arrow: dict[str, Any] = {"ls": "-", "marker": ">", "markevery": (1, 2), "ms": 5, "lw": 1.2}
    handles.append(Line2D([0, 1], [0, 0], color=look.SENDS, label="message", **arrow))
    handles.append(Line2D([0, 1], [0, 0], color=look.WAKES, label="message that its receiver wakes after", **arrow))
    figure.legend(
        handles=handles + kind_handles(layout), loc="center", ncols=4, fontsize=8, columnspacing=1.6, handletextpad=0.5
    )


def kind_handles(layout: GraphLayout) -> list[Line2D]:
    """What circles and squares stand for, where there are both."""
    if not layout.is_square.any() or layout.is_square.all():
        return []
    plain: dict[str, Any] = {"ls": "", "ms": 8, "mfc": "white", "mec": look.SOFT}
    return [
        Line2D([], [], marker=marker, label=_kinds(layout, square=square), **plain)
        for marker, square in (("o", False), ("s", True))
    ]


def _kinds(layout: GraphLayout, *, square: bool) -> str:
    words = {"s": "sensor", "t": "target", "r": "subregion", "c": "cell", "f": "factor", "v": "variable"}
    letters = sorted({name[:1] for name, each in zip(layout.label, layout.is_square, strict=True) if each == square})
    return ", ".join(words.get(letter, letter) for letter in letters)


def _draw_strip(axes: Axes, rounds: Sequence[Round], shown: Sequence[int]) -> None:
    """Bars above the line for those that send, woken ones on top; below it for those that fall silent."""
    at = [each.number for each in rounds]
    woken = [len(each.woken) for each in rounds]
    others = [len(each.senders) - len(each.woken) for each in rounds]
    silent = [-len(each.fell_silent) for each in rounds]
    axes.bar(at, others, color=look.SENDS, width=0.7)
    axes.bar(at, woken, bottom=others, color=look.WAKES, width=0.7)
    axes.bar(at, silent, color=look.SILENT_EDGE, width=0.7)
    for each, up, down in zip(rounds, [len(each.senders) for each in rounds], silent, strict=True):
        axes.annotate(str(up), (each.number, up), (0, 1.5), textcoords="offset points", ha="center", fontsize=7.5)
        if down:
            axes.annotate(
                str(-down), (each.number, down), (0, -1.5), textcoords="offset points", ha="center", va="top",
                fontsize=7.5, color=look.SOFT,
            )  # fmt: skip
    axes.axhline(0, color=look.SOFT, lw=0.8)
    axes.set_xlim(-0.6, len(rounds) - 0.4)
    axes.use_sticky_edges = False
    axes.margins(y=0.22)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=4, integer=True))
    axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.spines[["top", "right", "bottom"]].set_visible(False)
    axes.set_xlabel("round (0: start messages)")
    axes.set_ylabel("vertices")
    handles = [
        Patch(color=look.SENDS, label="send"),
        Patch(color=look.WAKES, label="of these, wake"),
        Patch(color=look.SILENT_EDGE, label="fall silent"),
    ]
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=8, ncols=3, borderaxespad=0.0)
    if any(each.messages and each.number not in shown for each in rounds):
        axes.set_title("All rounds", loc="left", fontsize=8.5)
