"""A sequence chart as an HTML page that needs no other file: pan, zoom, point at a message to see its causal chain."""

from xml.etree import ElementTree as ET

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from netsim.sequence.chart import CSS, parts, summary
from netsim.sequence.frame import BACKGROUND, FIELD, LABEL, PAUSE, SOFT
from netsim.sequence.ink import SVG, number
from netsim.sequence.legend import MARK, Entry, draw_mark, entries
from netsim.sequence.plan import HEAD_HEIGHT, Plan

_MARK_HEIGHT = 16.0


def html_of(plan: Plan) -> str:
    """The page."""
    environment = Environment(
        loader=PackageLoader("netsim.sequence"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    found = entries(plan)
    colours = {"background": BACKGROUND, "text": LABEL, "soft": SOFT, "line": FIELD, "panel": PAUSE}
    return environment.get_template("page.html.j2").render(
        title=plan.exchange.title,
        summary=summary(plan),
        colours=colours,
        css=Markup(CSS),  # ours, and a style element's text is not escaped
        switches=[(entry, _mark(entry)) for entry in found if entry.hides],
        marks=[(entry, _mark(entry)) for entry in found if not entry.hides and entry.shape != "band"],
        states=[(entry, _mark(entry)) for entry in found if entry.shape == "band"],
        size={"width": number(plan.width), "height": number(plan.height), "head": number(HEAD_HEIGHT)},
        causes=_causes(plan),
        parts=Markup("".join(ET.tostring(part, encoding="unicode") for part in parts(plan))),
    )


def _mark(entry: Entry) -> Markup:
    size = {"width": number(MARK), "height": number(_MARK_HEIGHT), "aria-hidden": "true"}
    root = ET.Element("svg", {"xmlns": SVG, **size})
    draw_mark(root, entry, 0.0, _MARK_HEIGHT / 2)
    return Markup(ET.tostring(root, encoding="unicode"))


def _causes(plan: Plan) -> dict[str, list[int]]:
    """The causes of each message of the window; messages without are left out."""
    sendings = plan.exchange.sendings
    return {str(message): list(sending.causes) for message, sending in sendings.items() if sending.causes}
