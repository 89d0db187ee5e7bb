"""Names beside points: nearest to their own point, clear of the others, in its colour, joined to it where they are away."""

import itertools

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Annotation
from report_studies import written

from netsim.study.plots.labels import Mark, label_points
from netsim.study.plots.rows import label_rows
from netsim.study.plots.style import PALETTE, RC, legible, panels, settle, styled
from netsim.study.plots.tradeoff import tradeoff_plots
from netsim.study.reporting.view import view_of
from netsim.study.results import load_study

NAMES = ("CC2420", "CC2538", "nRF52840", "CC1000", "SX1276 (LoRa)")
RR = {
    "energy_j": [(74.42, 0.0667), (67.43, 0.0667), (57.06, 0.0667), (56.4, 0.1), (28.0, 0.25)],
    "energy_beyond_listening_j": [(1.26, 0.0667), (1.35, 0.0667), (0.75, 0.0667), (2.1, 0.1), (4.0, 0.25)],
}
"""Five radios, three of one error and nearly one cost."""


def distances(panel):
    """By name: how far its box is from its own point, and from the nearest other one, in pixels."""
    renderer = FigureCanvasAgg(panel.figure).get_renderer()
    texts = [text for text in panel.texts if isinstance(text, Annotation)]
    points = [panel.transData.transform(text.xy) for text in texts]
    for place, text in enumerate(texts):
        box = text.get_window_extent(renderer)
        apart = [np.hypot(max(box.x0 - x, 0, x - box.x1), max(box.y0 - y, 0, y - box.y1)) for x, y in points]
        yield text.get_text(), apart[place], min(apart[:place] + apart[place + 1 :], default=np.inf)


def labelled(points):
    figure, axes = panels(1, 1, 3.4, width_in=6.0)
    panel = axes[0][0]
    panel.plot(*zip(*points, strict=True), "o")
    panel.margins(0.15)
    settle(figure)
    marks = [Mark(x, y, name=name, colour=colour) for (x, y), name, colour in zip(points, NAMES, PALETTE, strict=False)]
    label_points(panel, marks)
    return panel


@pytest.mark.parametrize("cost", RR)
def test_in_a_crowd_every_name_is_nearest_to_its_own_point(tmp_path, cost):
    points = dict(zip(NAMES, RR[cost], strict=True))

    def law(levels, repetition):
        cost_j, error = points[levels["radio"]]
        return {"association_error": error, cost: cost_j}

    written(tmp_path, {"radio": list(NAMES)}, 6, law, costs=(cost,))
    (plot,) = tradeoff_plots(view_of(load_study(tmp_path)))
    found = list(distances(plot.figure.axes[0]))
    assert [name for name, own, other in found if own >= other] == []
    assert len(found) == 5


@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 6)), min_size=2, max_size=5, unique=True))
@settings(max_examples=25, deadline=None)
def test_wherever_the_points_lie_no_name_is_nearer_to_another(points):
    found = list(distances(labelled(points)))
    assert [name for name, own, other in found if own >= other] == []


def test_a_name_has_the_colour_of_its_point_dark_enough_to_read():
    panel = labelled(RR["energy_j"])
    colours = {text.get_text(): text.get_color() for text in panel.texts}
    assert colours == {name: legible(colour) for name, colour in zip(NAMES, PALETTE, strict=False)}
    for colour in (*PALETTE, "#fde725"):
        red, green, blue = mpl.colors.to_rgb(legible(colour))
        linear = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in (red, green, blue)]
        assert 1.05 / (np.dot(linear, [0.2126, 0.7152, 0.0722]) + 0.05) >= 4.49
    assert legible(PALETTE[0]) == PALETTE[0].lower()  # dark enough as it is


def test_a_name_that_is_away_is_joined_to_its_point():
    """A point in the midst of four has no room beside it."""
    ring = [(x, y) for x, y in itertools.product((-1.0, 1.0), (-1.0, 1.0))]
    panel = labelled([*ring, (0.0, 0.0)])
    lines = {tuple(line.get_xydata()[0]) for line in panel.lines if len(line.get_xdata()) == 2}
    far = [text.xy for (_, own, _), text in zip(distances(panel), panel.texts, strict=True) if own > 13]
    assert lines == set(far)


LONG = ("literal, measurements first", "literal, few neighbours first", "normalised")
DEPTHS = list(range(1, 10))


def falling(levels, _):
    """An error that spans decades."""
    return {
        "association_error": 0.5 * 10.0 ** -levels["t"],
        "energy_j": 2.0 ** levels["t"] + LONG.index(levels["form"]),
    }


def test_errors_decades_apart_are_told_by_factors_and_long_names_in_full(tmp_path):
    written(tmp_path, {"t": DEPTHS, "form": list(LONG)}, 1, falling, costs=("energy_j",))
    (plot,) = tradeoff_plots(view_of(load_study(tmp_path)))
    assert plot.figure.axes[0].get_yscale() == "log"
    assert set(LONG) <= {text.get_text() for text in plot.figure.legends[0].get_texts()}


def test_a_legend_of_many_lines_leaves_the_panel_its_height(tmp_path):
    written(tmp_path, {"t": DEPTHS, "form": list(LONG)}, 1, falling, costs=("energy_j",))
    (plot,) = tradeoff_plots(view_of(load_study(tmp_path)))
    settle(plot.figure)
    assert plot.figure.axes[0].get_position().height * plot.figure.get_size_inches()[1] > 1.5


@pytest.mark.parametrize("rows", [2, 3])
def test_labels_of_rows_are_in_the_picture_as_saved(rows):
    with styled():
        figure, axes = panels(1, 1, 3.0)
        axes[0][0].plot(range(rows), range(rows))
        label_rows(axes[0][0], ["t 6, literal, events first"] * (rows - 1) + ["literal,\nfew neighbours first"])
        settle(figure)
        figure.set_dpi(RC["savefig.dpi"])
        renderer = FigureCanvasAgg(figure).get_renderer()
        assert min(text.get_window_extent(renderer).x0 for text in axes[0][0].get_yticklabels()) >= 0
