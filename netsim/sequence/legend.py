"""What the colours and marks of a chart mean: only those that are in it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from netsim.sequence.aim import OVERHEAR
from netsim.sequence.arrows import DASHES, INTERFERED_COLOUR, LOST_COLOUR, THIN_COLOUR
from netsim.sequence.ink import Drawn, add, cross, line, width_of
from netsim.sequence.lifelines import BAND, DOT, FAULT, LEADER, NOTE, diamond, state_colour
from netsim.sequence.links import LINK, cause_links
from netsim.sequence.plan import Plan
from netsim.sequence.states import announced, roles
from netsim.sequence.words import reason
from netsim.trace.events import RADIO_STATES

SIZE = 10.5
ROW = 19.0
MARK = 26.0
_GAP, _AFTER = 6.0, 16.0


@dataclass(frozen=True)
class Entry:
    """A mark and what it means.

    Attributes:
        shape: `arrow`, `thin`, `cross`, `arc`, `dot`, `note`, `frame`, `band` or `refused`.
        label: What it means.
        colour: Of the mark.
        hides: What a click on it in the page takes away: `kind-3`, `ack`, `cause`; empty for nothing.
    """

    shape: str
    label: str
    colour: str
    hides: str = ""


def entries(plan: Plan) -> list[Entry]:
    """The legend of a chart."""
    return [*_kinds(plan), *_frames(plan), *_marks(plan), *_states(plan)]


def _kinds(plan: Plan) -> Iterator[Entry]:
    present = {sent.kind for sent in plan.exchange.transmissions}
    for place, (kind, tone) in enumerate(plan.colours.items()):
        if kind in present:
            yield Entry("arrow", kind, tone, f"kind-{place}")


def _frames(plan: Plan) -> Iterator[Entry]:
    sent = plan.exchange.transmissions
    if any(each.role == "ack" for each in sent):
        yield Entry("thin", "acknowledgement", THIN_COLOUR, "ack")
    if any(each.role == "strobe" for each in sent):
        yield Entry("thin", "wake-up frames", THIN_COLOUR, "strobe")
    failed = [arm for each in sent for arm in each.arms if not arm.is_received]
    for tone, arms in (
        (LOST_COLOUR, [arm for arm in failed if not arm.is_interfered]),
        (INTERFERED_COLOUR, [arm for arm in failed if arm.is_interfered]),
    ):
        if arms:
            reasons = sorted({reason(arm.outcome) for arm in arms} - {"lost"})
            head = "not received: " if tone == LOST_COLOUR and reasons else "lost" if tone == LOST_COLOUR else ""
            yield Entry("cross", head + ", ".join(reasons), tone)


def _marks(plan: Plan) -> Iterator[Entry]:
    if cause_links(plan.exchange):
        yield Entry("arc", "a reception led to a sending", LINK, "cause")
    if any(drop.event.node in plan.x for drop in plan.exchange.dropped):
        yield Entry("refused", "given up", FAULT)
    if any(note.event.node in plan.x for note in plan.exchange.rounds):
        yield Entry("dot", "computed, and sent graph messages (filled) or none", DOT)
    if any(note.event.node in plan.x for note in plan.exchange.notes):
        yield Entry("note", "a note of the algorithm", NOTE)
    if any(roles(plan.exchange, node, plan.first_ns, plan.last_ns) for node in plan.order):
        yield Entry("frame", "holds a role", LEADER)


def _states(plan: Plan) -> Iterator[Entry]:
    """Those of the life lines, in the order of the vocabulary."""
    present = {"transmit"} | {span.state for sent in plan.exchange.transmissions for span in sent.heard}
    for node in plan.order:
        present |= {span.state for span in announced(plan.exchange, node, plan.first_ns, plan.last_ns)}
    known = (*RADIO_STATES, OVERHEAR, "crashed")
    for state in known:
        if state in present:
            yield Entry("band", state, state_colour(state))
    failed = {state_colour(state) for state in present.difference(known)}
    for tone, label in ((LOST_COLOUR, "fails to receive"), (INTERFERED_COLOUR, "loses to another signal")):
        if tone in failed:
            yield Entry("band", label, tone)


def rows(found: Sequence[Entry], width: float) -> list[list[Entry]]:
    """The entries in rows that are at most so wide; radio states begin a row of their own."""
    lines: list[list[Entry]] = [[]]
    left = width
    for place, entry in enumerate(found):
        needs = _needs(entry)
        starts = entry.shape == "band" and place and found[place - 1].shape != "band"
        if lines[-1] and (needs > left or starts):
            lines.append([])
            left = width
        lines[-1].append(entry)
        left -= needs
    return lines


def _needs(entry: Entry) -> float:
    return MARK + _GAP + width_of(entry.label, SIZE) + _AFTER


def draw_rows(parent: ET.Element, lines: Sequence[Sequence[Entry]], x: float, top: float, text: str) -> None:
    """Draw the legend.

    Args:
        parent: Where to.
        lines: The rows of entries.
        x: Its left edge.
        top: Its upper edge.
        text: Colour of the words.
    """
    for depth, row in enumerate(lines):
        at, y = x, top + ROW * (depth + 0.5)
        for entry in row:
            draw_mark(parent, entry, at, y)
            add(parent, "text", entry.label, x=at + MARK + _GAP, y=y + 3.8, fill=text, font_size=SIZE)
            at += _needs(entry)


def draw_mark(parent: ET.Element, entry: Entry, x: float, y: float) -> None:
    """The mark of an entry, `MARK` wide, from its left end on."""
    stroke, end = entry.colour, x + MARK
    if entry.shape in ("arrow", "thin"):
        wide, head = (2.0, 7.0) if entry.shape == "arrow" else (0.9, 5.0)
        add(parent, "path", d=line((x, y), (end - head, y)), stroke=stroke, stroke_width=wide)
        tip = line((end, y), (end - head, y - 0.42 * head), (end - head, y + 0.42 * head)) + "Z"
        add(parent, "path", d=tip, fill=stroke)
    elif entry.shape == "cross":
        add(parent, "path", d=line((x, y), (end - 6.0, y)), stroke=stroke, stroke_width=1.6, stroke_dasharray=DASHES)
        add(parent, "path", d=cross(end - 5.0, y, 3.6), stroke=stroke, stroke_width=1.8)
    elif entry.shape == "arc":
        path = (
            f"M{end - 8.0:.1f} {y - 7.0:.1f}C{x:.1f} {y - 5.0:.1f} {x:.1f} {y + 5.0:.1f} {end - 8.0:.1f} {y + 7.0:.1f}"
        )
        add(parent, "path", class_="c", d=path, stroke=stroke)
    else:
        _draw_blob(parent, entry, x + MARK / 2, y)


def _draw_blob(parent: ET.Element, entry: Entry, x: float, y: float) -> None:
    stroke = entry.colour
    if entry.shape == "band":
        add(parent, "path", d=line((x - 9.0, y), (x + 9.0, y)), stroke=stroke, stroke_width=BAND + 2.0)
    elif entry.shape == "frame":
        place: Drawn = {"x": x - 4.6, "y": y - 7.0, "width": 9.2, "height": 14.0, "rx": 2.0}
        add(parent, "rect", **place, fill="none", stroke=stroke, stroke_width=1.2)
    elif entry.shape == "dot":
        add(parent, "circle", cx=x - 5.0, cy=y, r=3.2, fill=stroke, stroke=stroke, stroke_width=1.2)
        add(parent, "circle", cx=x + 5.0, cy=y, r=3.2, fill="none", stroke=stroke, stroke_width=1.2)
    elif entry.shape == "note":
        add(parent, "path", d=diamond(x, y), fill=stroke)
    else:
        add(parent, "circle", cx=x, cy=y, r=4.2, fill="none", stroke=stroke, stroke_width=1.6)
        add(parent, "path", d=line((x - 3.0, y + 3.0), (x + 3.0, y - 3.0)), stroke=stroke, stroke_width=1.6)
