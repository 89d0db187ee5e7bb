"""Life lines: what each node's radio does, the roles it holds, what it computes and what befalls it."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as ET

from netsim.replay import style
from netsim.sequence.aim import OVERHEAR
from netsim.sequence.ink import Drawn, add, colour, cross, line, number, uprights
from netsim.sequence.labels import SIZE, Room
from netsim.sequence.plan import AXIS_WIDTH, TOLD_LIVES, Plan
from netsim.sequence.records import Noted, Span
from netsim.sequence.states import DOWN, announced, roles
from netsim.sequence.words import drop_words, instant, note_words, reason, round_words
from netsim.trace.events import AlgorithmRecord, MessageDropped, NodeLife

BAND = 5.0
FAINT = 0.35
"""How much overhearing looks like receiving; the rest like listening."""
_ROLE = 4.6  # half the width of the frame around the life line of a node that holds a role
_DOT, _NOTE = 2.6, 4.0
_ASIDE = 8.5  # from the middle of a life line to words beside it
_LEAST = 0.05  # shorter than this nothing is seen
LEADER, LABEL, FAULT = colour(style.LEADER), colour(style.LABEL), colour(style.FAULT)
DOT, NOTE = colour(style.VARIABLE), colour(style.ESTIMATE)

Spans = Mapping[int, list[Span]]


def draw_lifelines(parent: ET.Element, plan: Plan) -> None:
    """A band a node, in the colours of its radio's states."""
    taken_in = _busy(plan)
    for node in plan.order:
        group = add(parent, "g", class_="life", data_n=str(node))
        _draw_states(group, plan, node, announced(plan.exchange, node, plan.first_ns, plan.last_ns), BAND)
        _draw_states(group, plan, node, taken_in.get(node, []), BAND)


def _busy(plan: Plan) -> Spans:
    """What radios did for the transmissions shown; a transmission lies above what its sender hears."""
    found: defaultdict[int, list[Span]] = defaultdict(list)
    for sent in plan.exchange.transmissions:
        for span in sent.heard:
            found[span.node].append(span)
    for sent in plan.exchange.transmissions:
        found[sent.source] += [Span(sent.source, "transmit", begun_ns, end_ns) for begun_ns, end_ns in sent.aired]
    return found


def _draw_states(group: ET.Element, plan: Plan, node: int, spans: Iterable[Span], width: float) -> None:
    """One path a state, so that a chart of many thousand spans stays small."""
    paths: dict[str, list[tuple[float, float]]] = {}
    for span in spans:
        top, bottom = plan.y(span.start_ns), plan.y(span.end_ns)
        if bottom - top < _LEAST:
            continue
        runs = paths.setdefault(span.state, [])
        if runs and runs[-1][1] >= top - _LEAST:
            runs[-1] = runs[-1][0], max(bottom, runs[-1][1])
        else:
            runs.append((top, bottom))
    for state, runs in paths.items():
        add(
            group,
            "path",
            class_=f"s {state}",
            d=uprights(plan.x[node], runs),
            stroke=state_colour(state),
            stroke_width=width,
            stroke_dasharray="2 4" if state in DOWN else None,
        )


def state_colour(state: str) -> str:
    """The colour of a radio's state, as in the replay."""
    if state != OVERHEAR:
        return colour(style.RADIO_COLOURS[state])
    bright, dark = style.RADIO_COLOURS["receive"], style.RADIO_COLOURS["listen"]
    red, green, blue = (round(FAINT * bright[part] + (1.0 - FAINT) * dark[part]) for part in range(3))
    return colour((red, green, blue, 255))


def draw_marks(parent: ET.Element, texts: ET.Element, plan: Plan, room: Room) -> None:
    """Roles, computations, notes, what was given up, deaths."""
    for node in plan.order:
        _draw_roles(parent, texts, plan, node, room)
    _draw_rounds(parent, plan)
    for note in plan.exchange.notes:
        if note.event.node in plan.x:
            _draw_note(parent, texts, plan, note, room)
    for drop in plan.exchange.dropped:
        if drop.event.node in plan.x:
            _draw_drop(parent, texts, plan, drop, room)
    for life in plan.exchange.lives:
        event = life.event
        if event.node in plan.x and event.event in TOLD_LIVES and plan.first_ns <= life.time_ns <= plan.last_ns:
            _draw_life(parent, texts, plan, life, room)


def diamond(x: float, y: float) -> str:
    """Path data of the mark of a note."""
    return line((x, y - _NOTE), (x + _NOTE, y), (x, y + _NOTE), (x - _NOTE, y)) + "Z"


def _draw_roles(parent: ET.Element, texts: ET.Element, plan: Plan, node: int, room: Room) -> None:
    x = plan.x[node]
    for span in roles(plan.exchange, node, plan.first_ns, plan.last_ns):
        top, bottom = plan.y(span.start_ns), plan.y(span.end_ns)
        box = add(
            parent,
            "rect",
            class_="role",
            x=x - _ROLE,
            y=top,
            width=2 * _ROLE,
            height=max(bottom - top, 2.0),
            rx=2.0,
            fill="none",
            stroke=LEADER,
            stroke_width=1.2,
        )
        since = f" from {instant(span.start_ns)}" if span.is_taken else ""
        add(box, "title", f"{plan.exchange.name(node)} is {span.role}{since} to {instant(span.end_ns)} s")
        _write(texts, room, plan, node, top + 8.0, span.role, LEADER)


def _draw_rounds(parent: ET.Element, plan: Plan) -> None:
    for note in plan.exchange.rounds:
        event = note.event
        if event.node in plan.x:
            fill = DOT if len(event.source) else colour(style.BACKGROUND)
            place: Drawn = {"cx": plan.x[event.node], "cy": plan.y(note.time_ns), "r": _DOT}
            dot = add(parent, "circle", class_="round", **place, fill=fill, stroke=DOT, stroke_width=1.2)
            add(dot, "title", round_words(plan.exchange, note))


def _draw_note(parent: ET.Element, texts: ET.Element, plan: Plan, note: Noted[AlgorithmRecord], room: Room) -> None:
    x, y = plan.x[note.event.node], plan.y(note.time_ns)
    mark = add(parent, "path", class_="note", d=diamond(x, y), fill=NOTE)
    add(mark, "title", note_words(plan.exchange, note))
    _write(texts, room, plan, note.event.node, y + 3.5, note.event.kind, NOTE)


def _draw_drop(parent: ET.Element, texts: ET.Element, plan: Plan, note: Noted[MessageDropped], room: Room) -> None:
    x, y = plan.x[note.event.node], plan.y(note.time_ns)
    group = add(parent, "g", class_="drop", data_m=str(note.event.message_id))
    add(group, "title", drop_words(plan.exchange, note))
    add(group, "circle", cx=x, cy=y, r=4.2, fill=colour(style.BACKGROUND), stroke=FAULT, stroke_width=1.6)
    bar = f"M{number(x - 3.0)} {number(y + 3.0)}L{number(x + 3.0)} {number(y - 3.0)}"
    add(group, "path", d=bar, stroke=FAULT, stroke_width=1.6)
    number_of = f" #{note.event.message_id}" if note.event.message_id else ""
    _write(texts, room, plan, note.event.node, y + 3.5, f"gave up{number_of}: {reason(note.event.reason)}", FAULT)


def _draw_life(parent: ET.Element, texts: ET.Element, plan: Plan, note: Noted[NodeLife], room: Room) -> None:
    x, y = plan.x[note.event.node], plan.y(note.time_ns)
    tone = LABEL if note.event.event == "rebooted" else colour(style.COLLIDED)
    why = f": {note.event.reason}" if note.event.reason and note.event.event != "rebooted" else ""
    group = add(parent, "g", class_="lives")
    add(group, "title", f"{plan.exchange.name(note.event.node)} {note.event.event} at {instant(note.time_ns)} s{why}")
    add(group, "path", d=cross(x, y, 5.5), stroke=tone, stroke_width=2.4)
    _write(texts, room, plan, note.event.node, y + 3.5, f"{note.event.event}{why}", tone)


def _write(texts: ET.Element, room: Room, plan: Plan, node: int, y: float, text: str, tone: str) -> None:
    """A word beside a life line, where there is room for it; where there is none it is told by pointing at the mark."""
    wide = 0.6 * SIZE * len(text)
    for side, anchor in ((1.0, "start"), (-1.0, "end")):
        x = plan.x[node] + side * _ASIDE
        left, right = min(x, x + side * wide), max(x, x + side * wide)
        if left >= AXIS_WIDTH and right <= plan.width and room.take((left, y - SIZE, right, y + 2.0)):
            add(texts, "text", text, class_="t", x=x, y=y, fill=tone, font_size=SIZE, text_anchor=anchor)
            return
