"""What stands around the arrows: names of the nodes above, the time axis at the left, pauses and rounds across."""

from bisect import bisect_left
from collections.abc import Iterator
from xml.etree import ElementTree as ET

from netsim.replay import style
from netsim.sequence.ink import Drawn, add, colour, line, width_of
from netsim.sequence.plan import AXIS_WIDTH, HEAD_HEIGHT, NAME_SIZE, Plan
from netsim.sequence.words import duration, instant

BACKGROUND, FIELD, LABEL = colour(style.BACKGROUND), colour(style.FIELD), colour(style.LABEL)
SOFT = colour(style.LOST)
PAUSE = "#171c23"
_TICK_SIZE = 10.0
_TICK_GAP = 15.0
_EDGE = AXIS_WIDTH - 8.0
_REPEAT = 900.0  # names are told again after so much height


def draw_backdrop(parent: ET.Element, plan: Plan) -> None:
    """Bands of pauses, lines of rounds that all nodes share, names again in a long chart."""
    for pause in plan.scale.pauses:
        top, bottom = plan.y(pause.start_ns), plan.y(pause.end_ns)
        inset = min(3.0, (bottom - top) / 4)
        place: Drawn = {"x": _EDGE, "y": top + inset, "width": plan.width - _EDGE, "height": bottom - top - 2 * inset}
        band = add(parent, "rect", class_="pause", **place, fill=PAUSE)
        add(band, "title", f"nothing is on the air for {duration(pause.end_ns - pause.start_ns)}")
    for number, time_ns in _shared_rounds(plan):
        y = plan.y(time_ns)
        add(parent, "path", d=line((_EDGE, y), (plan.width, y)), stroke=FIELD, stroke_dasharray="1 3", stroke_width=1.0)
        text = f"round {number}"
        add(
            parent, "text", text, class_="t", x=plan.width - 4.0, y=y - 3.0, text_anchor="end", fill=SOFT, font_size=9.0
        )


def _shared_rounds(plan: Plan) -> Iterator[tuple[int, int]]:
    """Number and first instant of the rounds that are the same instant on all nodes."""
    first: dict[int, int] = {}
    for note in plan.exchange.rounds:
        if note.event.is_synchronous and note.event.node in plan.x:
            first.setdefault(note.event.round, note.time_ns)
    yield from first.items()


def draw_names(parent: ET.Element, plan: Plan) -> None:
    """The names of the nodes, above their life lines."""
    add(
        parent,
        "rect",
        x=AXIS_WIDTH - 8.0,
        y=0.0,
        width=plan.width - AXIS_WIDTH + 8.0,
        height=HEAD_HEIGHT,
        fill=BACKGROUND,
    )
    for node in plan.order:
        place: Drawn = {"x": plan.x[node], "y": HEAD_HEIGHT - 10.0, "text_anchor": "middle"}
        name = add(parent, "text", _fitting(plan, node), class_="n", **place, fill=LABEL, font_size=NAME_SIZE)
        name.set("data-n", str(node))
        add(name, "title", plan.exchange.name(node))


def draw_names_again(parent: ET.Element, plan: Plan) -> None:
    """In a chart of several screens: beside the life lines, in pauses if there are, so that nobody needs to scroll back."""
    quiet = [(plan.y(pause.start_ns) + plan.y(pause.end_ns)) / 2 + 3.5 for pause in plan.scale.pauses]
    y = HEAD_HEIGHT + _REPEAT
    while y < plan.height - _REPEAT / 3:
        near = min(quiet, key=lambda place, y=y: abs(place - y), default=y)  # type: ignore[misc]
        at = near if abs(near - y) < _REPEAT / 3 else y
        for node in plan.order:
            add(parent, "text", _fitting(plan, node), class_="t", x=plan.x[node] + 6.0, y=at, fill=SOFT, font_size=9.0)
        y += _REPEAT


def _fitting(plan: Plan, node: int) -> str:
    name = plan.exchange.name(node)
    most = max(3, int((plan.column - 6.0) / width_of("x", NAME_SIZE)))
    return name if len(name) <= most else f"{name[: most - 1]}…"


def draw_corner(parent: ET.Element) -> None:
    """Above the time axis: what it is in."""
    add(parent, "rect", x=0.0, y=0.0, width=_EDGE, height=HEAD_HEIGHT, fill=BACKGROUND)
    place: Drawn = {"x": _EDGE - 10.0, "y": HEAD_HEIGHT - 10.0, "text_anchor": "end", "font_size": _TICK_SIZE}
    add(parent, "text", "time (s)", **place, fill=SOFT)


def draw_axis(parent: ET.Element, plan: Plan) -> None:
    """True times: after every pause, and of frames as far as there is room, with the lengths of the pauses between."""
    add(parent, "rect", x=0.0, y=0.0, width=_EDGE, height=plan.height, fill=BACKGROUND)
    add(parent, "path", d=line((_EDGE, HEAD_HEIGHT), (_EDGE, plan.height)), stroke=FIELD, stroke_width=1.0)
    taken: list[float] = []
    for time_ns in _ticks(plan):
        y = plan.y(time_ns)
        if _claim(taken, y, _TICK_GAP):
            _tick(parent, y, instant(time_ns))
    for pause in plan.scale.pauses:
        y = (plan.y(pause.start_ns) + plan.y(pause.end_ns)) / 2
        if _claim(taken, y, 0.8 * _TICK_GAP):
            text = f"↕ {duration(pause.end_ns - pause.start_ns)}"
            place: Drawn = {"x": _EDGE - 10.0, "y": y + 3.5, "text_anchor": "end", "font_size": _TICK_SIZE}
            add(parent, "text", text, **place, fill=SOFT, font_style="italic")


def _claim(taken: list[float], y: float, gap: float) -> bool:
    """Take a place on the axis if nothing in this list, which is in order, is nearer than a gap; whether that is so."""
    at = bisect_left(taken, y)
    if any(abs(y - near) < gap for near in taken[max(0, at - 1) : at + 1]):
        return False
    taken.insert(at, y)
    return True


def _tick(parent: ET.Element, y: float, text: str) -> None:
    add(parent, "path", d=line((_EDGE - 5.0, y), (_EDGE, y)), stroke=FIELD, stroke_width=1.0)
    place: Drawn = {"x": _EDGE - 10.0, "y": y + 3.5, "text_anchor": "end", "font_size": _TICK_SIZE}
    add(parent, "text", text, **place, fill=LABEL)


def _ticks(plan: Plan) -> Iterator[int]:
    """Instants worth a label, the most worth it first."""
    tick_ns = plan.scale.tick_ns
    if tick_ns:
        yield from range(-(-plan.first_ns // tick_ns) * tick_ns, plan.last_ns + 1, tick_ns)
        return
    yield plan.first_ns
    yield plan.last_ns
    for pause in plan.scale.pauses:
        yield pause.end_ns
    for sent in plan.exchange.transmissions:
        if sent.carries_message:
            yield sent.start_ns
