"""A sequence chart as SVG."""

from collections.abc import Iterator
from xml.etree import ElementTree as ET

from netsim.sequence.arrows import Layers, draw_transmission
from netsim.sequence.frame import (
    BACKGROUND,
    LABEL,
    SOFT,
    draw_axis,
    draw_backdrop,
    draw_corner,
    draw_names,
    draw_names_again,
)
from netsim.sequence.ink import FONT, SVG, add, number
from netsim.sequence.labels import Room
from netsim.sequence.legend import ROW, draw_rows, entries, rows
from netsim.sequence.lifelines import draw_lifelines, draw_marks
from netsim.sequence.links import draw_links
from netsim.sequence.plan import Plan
from netsim.sequence.words import instant

CSS = (
    f"text{{font-family:{FONT};font-variant-numeric:tabular-nums}}"
    f".t{{paint-order:stroke;stroke:{BACKGROUND};stroke-width:2.6px;stroke-linejoin:round}}"
    ".c{fill:none;stroke-width:1;stroke-dasharray:1 3.2;stroke-linecap:round;opacity:.6}"
    ".n{font-weight:600}"
)
_MARGIN = 16.0
_TITLE_HEIGHT = 48.0
_LEAST_WIDTH = 620.0


def svg_of(plan: Plan) -> str:
    """The chart with its title and its legend, as an SVG document."""
    width = max(plan.width, _LEAST_WIDTH) + 2 * _MARGIN
    legend = rows(entries(plan), width - 2 * _MARGIN)
    top = _TITLE_HEIGHT + ROW * len(legend) + 10.0
    height = top + plan.height + _MARGIN
    root = _root(f"0 0 {number(width)} {number(height)}", width, height)
    add(root, "title", f"{plan.exchange.title}: sequence chart")
    add(root, "style", CSS)
    add(root, "rect", width=width, height=height, fill=BACKGROUND)
    add(root, "text", plan.exchange.title, x=_MARGIN, y=22.0, fill=LABEL, font_size=15.0, class_="n")
    add(root, "text", summary(plan), x=_MARGIN, y=39.0, fill=SOFT, font_size=11.0)
    draw_rows(root, legend, _MARGIN, _TITLE_HEIGHT, LABEL)
    inner = add(root, "g", transform=f"translate({number(_MARGIN)} {number(top)})")
    for part in parts(plan):
        inner.append(part)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def summary(plan: Plan) -> str:
    """What is shown, on one line."""
    sent = plan.exchange.transmissions
    messages = len({each.message_id for each in sent if each.message_id})
    frames = sum(each.count for each in sent)
    of_messages = f"{_counted(messages, 'message')} in " if messages else ""
    span = f"{instant(plan.first_ns)} to {instant(plan.last_ns)} s"
    nodes = f"{_counted(len(plan.order), 'node')}, in the order in which they first send"
    return f"{span} · {of_messages}{_counted(frames, 'frame')} · {nodes}"


def _counted(count: int, noun: str) -> str:
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def parts(plan: Plan) -> Iterator[ET.Element]:
    """The chart itself in parts that a page can move on their own: body, time axis, names, and the corner between."""
    body = ET.Element("g", {"id": "body"})
    draw_backdrop(body, plan)
    draw_links(add(body, "g", id="causes"), plan)
    layers = Layers(add(body, "g", id="arrows"), ET.Element("g", {"id": "labels"}), Room())
    draw_lifelines(add(body, "g", id="lives"), plan)
    draw_marks(add(body, "g", id="marks"), layers.labels, plan, layers.room)
    body.append(layers.labels)
    for place, sent in enumerate(plan.exchange.transmissions):
        draw_transmission(layers, plan, sent, place)
    draw_names_again(body, plan)
    axis, names, corner = (ET.Element("g", {"id": part}) for part in ("axis", "names", "corner"))
    draw_axis(axis, plan)
    draw_names(names, plan)
    draw_corner(corner)
    yield from (body, axis, names, corner)


def _root(view_box: str, width: float, height: float) -> ET.Element:
    size = {"width": number(width), "height": number(height)}
    return ET.Element("svg", {"xmlns": SVG, "viewBox": view_box, **size, "role": "img"})
