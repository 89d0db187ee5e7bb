"""Transmissions as arrows from the sender's life line to each receiver's.

An arrow begins where the frame begins and ends where it ends; between both lies a band, the airtime. (Over the tens or
hundreds of metres of such a network a signal takes under a microsecond: a receiver hears the frame while it is sent.)
"""

from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from netsim.replay import style
from netsim.sequence.ink import Drawn, add, colour, cross, line, number
from netsim.sequence.labels import SIZE, Label, Room
from netsim.sequence.plan import Plan
from netsim.sequence.records import Arm, Transmission
from netsim.sequence.words import labels, reason, told
from netsim.trace.events import BROADCAST

RECEIVED, LOST, INTERFERED = "received", "lost", "interfered"
LOST_COLOUR, INTERFERED_COLOUR = colour(style.LOST), colour(style.COLLIDED)
THIN_COLOUR = colour(style.ACKNOWLEDGEMENT)
DASHES = "4 3"
_EDGE = 3.5  # from the middle of a life line to where an arrow begins or ends
_CROSS, _MARK = 3.6, 3.8
_STRONG_BAND, _WEAK_BAND = 0.14, 0.06  # opacity of an airtime where no other is
_FEW = 4  # arms of a broadcast that are drawn as strong as those of a unicast frame


@dataclass(frozen=True)
class Layers:
    """Where the parts of arrows go: labels lie above all arrows."""

    arrows: ET.Element
    labels: ET.Element
    room: Room


@dataclass(frozen=True)
class _Look:
    colour: str
    width: float
    head: float
    opacity: str | None


def draw_transmission(layers: Layers, plan: Plan, sent: Transmission, place: int) -> None:
    """Draw a transmission.

    Args:
        layers: Where to.
        plan: The layout.
        sent: The transmission.
        place: Its number in the chart.
    """
    tags = {
        "class_": f"f {sent.role}",
        "data_m": str(sent.message_id),
        "data_k": str(list(plan.colours).index(sent.kind)) if sent.kind in plan.colours else "-1",
    }
    group = add(layers.arrows, "g", **tags, id=f"f{place}")
    add(group, "title", told(plan.exchange, sent))
    _draw_band(group, plan, sent)
    texts = add(layers.labels, "g", **tags, data_f=str(place))
    for fate, arms in _by_fate(sent.arms).items():
        if fate != RECEIVED and sent.destination == BROADCAST:
            _draw_losses(texts, plan, sent, fate, arms)
        else:
            _draw_arms(group, plan, sent, fate, arms)
    _label(texts, layers.room, plan, sent)
    if not len(texts):
        layers.labels.remove(texts)


def _look(plan: Plan, sent: Transmission, fate: str) -> _Look:
    thin = not sent.carries_message
    if fate == RECEIVED:
        tone = THIN_COLOUR if thin else plan.colours.get(sent.kind, LOST_COLOUR)
    else:
        tone = INTERFERED_COLOUR if fate == INTERFERED else LOST_COLOUR
    many = sent.destination == BROADCAST and len(sent.arms) > _FEW
    return _Look(tone, 0.8 if thin or many else 1.6, 5.0 if thin or many else 7.0, "0.45" if many else None)


def _by_fate(arms: Iterable[Arm]) -> dict[str, list[Arm]]:
    found: dict[str, list[Arm]] = {}
    for arm in arms:
        fate = RECEIVED if arm.is_received else INTERFERED if arm.is_interfered else LOST
        found.setdefault(fate, []).append(arm)
    return found


def _draw_band(group: ET.Element, plan: Plan, sent: Transmission) -> None:
    """The airtime, from the outermost node on the left to that on the right."""
    x = [plan.x[sent.source], *(plan.x[arm.node] for arm in sent.arms)]
    if len(x) == 1:
        x = [x[0] - plan.column / 3, x[0] + plan.column / 3]
    top, bottom = plan.y(sent.start_ns), plan.y(sent.end_ns)
    fates = _by_fate(sent.arms)
    fate = next((fate for fate in (RECEIVED, INTERFERED, LOST) if fate in fates), LOST)
    strong = _STRONG_BAND if sent.carries_message and len(sent.arms) <= _FEW else _WEAK_BAND
    add(
        group,
        "rect",
        class_="air",
        x=min(x),
        y=top,
        width=max(x) - min(x),
        height=max(bottom - top, 1.0),
        fill=_look(plan, sent, fate).colour,
        fill_opacity=f"{strong / plan.scale.most_in_air(sent.start_ns, sent.end_ns) ** 0.5:.3f}",
    )


def _draw_arms(group: ET.Element, plan: Plan, sent: Transmission, fate: str, arms: list[Arm]) -> None:
    look = _look(plan, sent, fate)
    shafts, heads = "", ""
    for arm in arms:
        start, end = ends(plan, sent, arm)
        side = 1.0 if end[0] > start[0] else -1.0
        if fate == RECEIVED:
            back = end[0] - side * look.head
            rise = (end[1] - start[1]) * look.head / max(abs(end[0] - start[0]), look.head)
            shafts += line(start, (back, end[1] - rise))
            heads += _head(end, (back, end[1] - rise), 0.42 * look.head)
        else:
            end = (end[0] - side * _CROSS, end[1])
            shafts += line(start, end)
            heads += cross(*end, _CROSS)
    dashes = None if fate == RECEIVED else DASHES
    drawn: Drawn = {
        "stroke": look.colour,
        "stroke_width": look.width,
        "stroke_dasharray": dashes,
        "opacity": look.opacity,
    }
    add(group, "path", d=shafts, fill="none", **drawn)
    if fate == RECEIVED:
        add(group, "path", d=heads, fill=look.colour)
    else:
        add(group, "path", d=heads, stroke=look.colour, stroke_width=1.8, fill="none")


def _draw_losses(group: ET.Element, plan: Plan, sent: Transmission, fate: str, arms: list[Arm]) -> None:
    """Light crosses on the life lines of those who lost a broadcast."""
    tone = _look(plan, sent, fate).colour
    marks = "".join(cross(plan.x[arm.node], plan.y(sent.end_ns), _MARK) for arm in arms)
    add(group, "path", d=marks, stroke=tone, stroke_width=1.2, fill="none")


def ends(plan: Plan, sent: Transmission, arm: Arm) -> tuple[tuple[float, float], tuple[float, float]]:
    """Where the arrow to a receiver begins and ends: at the rims of the two life lines."""
    x0, x1 = plan.x[sent.source], plan.x[arm.node]
    side = _EDGE if x1 > x0 else -_EDGE
    return (x0 + side, plan.y(sent.start_ns)), (x1 - side, plan.y(sent.end_ns))


def _head(tip: tuple[float, float], back: tuple[float, float], half: float) -> str:
    """A triangle whose base is across the arrow."""
    dx, dy = tip[0] - back[0], tip[1] - back[1]
    size = max((dx * dx + dy * dy) ** 0.5, 1e-9)
    aside = (-dy / size * half, dx / size * half)
    return line(tip, (back[0] + aside[0], back[1] + aside[1]), (back[0] - aside[0], back[1] - aside[1])) + "Z"


def _label(texts: ET.Element, room: Room, plan: Plan, sent: Transmission) -> None:
    """The label on the arrow, of a broadcast on the longest, above all others; and why it failed."""
    if sent.destination != BROADCAST:
        for arm in sent.arms:
            if not arm.is_received and sent.role != "ack":
                _tell_reason(texts, room, plan, sent, arm)
    if not sent.arms:
        left, right = ((plan.x[sent.source] + side * plan.column / 3, plan.y(sent.end_ns)) for side in (-1.0, 1.0))
        label = room.along(left, right, _wordings(plan, sent))
        if label is not None:
            put_label(texts, label, LOST_COLOUR)
        return
    arm = max(sent.arms, key=lambda each: (each.is_received, abs(plan.x[each.node] - plan.x[sent.source])))
    fate = next(iter(_by_fate([arm])))
    label = room.along(*ends(plan, sent, arm), _wordings(plan, sent))
    if label is not None:
        put_label(texts, label, _look(plan, sent, fate).colour)


def _wordings(plan: Plan, sent: Transmission) -> list[str]:
    sending = plan.exchange.sendings.get(sent.message_id)
    return labels(sent, 1 if sending is None else sending.fragments)


def _tell_reason(texts: ET.Element, room: Room, plan: Plan, sent: Transmission, arm: Arm) -> None:
    """Beyond the life line that the frame did not get past."""
    _, (x, y) = ends(plan, sent, arm)
    is_right = plan.x[arm.node] > plan.x[sent.source]
    text = reason(arm.outcome)
    tone = INTERFERED_COLOUR if arm.is_interfered else LOST_COLOUR
    x += 12.0 if is_right else -12.0
    wide = 0.6 * SIZE * len(text)
    if room.take((x if is_right else x - wide, y - 6.0, x + wide if is_right else x, y + 4.0)):
        anchor = "start" if is_right else "end"
        add(texts, "text", text, class_="t", x=x, y=y + 2.5, text_anchor=anchor, fill=tone, font_size=SIZE - 0.5)


def put_label(texts: ET.Element, label: Label, tone: str) -> None:
    """Write a label."""
    turn = f"translate({number(label.x)} {number(label.y)}) rotate({number(label.angle)})"
    add(texts, "text", label.text, class_="t", transform=turn, text_anchor="middle", fill=tone, font_size=SIZE)
