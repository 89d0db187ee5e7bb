"""The vocabulary as a document: every topic with its fields, types, units and meaning, written from the event classes."""

import inspect
import re
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields

from netsim.trace import events
from netsim.trace.cdr import CODES, field_notes, schema_name, wire_types
from netsim.trace.events import EVENT_TYPES, Event

UNITS = {
    "ns": "ns",
    "s": "s",
    "m": "m",
    "m2": "m²",
    "j": "J",
    "db": "dB",
    "dbm": "dBm",
    "byte": "B",
    "bit": "bit",
    "sec": "s",
    "nanosec": "ns",
}
"""Units by the last word of a field's name."""

COMMON = {
    "node": "Node id; in a table, one a row.",
    "name": "Name.",
    "group": "Group of nodes in the scenario.",
    "radio": "Name of its radio.",
    "cpu": "Name of its processor.",
    "x_m": "Position, to the right.",
    "y_m": "Position, upwards.",
    "width_m": "Size, to the right.",
    "height_m": "Size, upwards.",
    "source": "Node it comes from.",
    "destination": "Node it is for.",
    "spent_j": "Spent so far.",
    "allowance_j": "May be spent in all.",
    "detail": "In words.",
    "consumed_j": "Drawn since the start.",
    "energy_j": "Energy of the row.",
    "time_s": "Time of the row.",
    "frame_id": "Number of the transmission, from 1, in the order of their beginnings; jammers take numbers too.",
    "t_start_ns": "First symbol on the air.",
    "t_end_ns": "End of the last symbol.",
    "is_ack": "1 for an acknowledgement, else 0.",
    "message_id": "Number of the message, from 1, in the order of sending; 0 for none.",
    "tx_power_dbm": "Transmit power.",
    "rx_node": "The listeners, one a row of the columns `rx_...`.",
    "rx_rssi_dbm": "Received power.",
    "kind": "Kind, in the algorithm's words.",
    "fragments": "Packets it takes.",
    "size_byte": "Application payload.",
    "hops": "Links it crossed.",
    "latency_ns": "Since it was sent.",
    "content_json": "A JSON object.",
    "fields_json": "A JSON object, units in its keys.",
    "target": "Number of the target.",
    "count": "How many there are.",
    "variable": "Number of the variable.",
    "host": "Node that hosts it.",
    "round": "Number of the round.",
    "probability": "Of each, at the same place.",
    "cell_m": "Side of a cell.",
    "columns": "Cells in a row.",
    "step": "Number of the track's measurement instant.",
    "payload_byte": "Size of its message.",
    "role": "Name of the role.",
    "holds": "1 if taken, 0 if left.",
    "sec": "Time, whole seconds.",
    "nanosec": "Time, the rest.",
    "message": "The line.",
    "file": "Where it comes from, if it is told.",
    "line": "Where it comes from, if it is told.",
}
"""What fields mean that have no words of their own in their class."""

_TABLE = ["| field | type | unit | meaning |", "| --- | --- | --- | --- |"]


def markdown_topics() -> str:
    """Every topic as Markdown: a list of all, then a section each, then the codes."""
    listing = ["| topic | event | what it tells |", "| --- | --- | --- |"]
    listing += [f"| `{each.topic}` | `{each.__name__}` | {_cell(_summary(each))} |" for each in EVENT_TYPES]
    sections = ["\n".join(_section(each)) for each in EVENT_TYPES]
    return "\n\n".join(["\n".join(listing), *sections, *_codes()]) + "\n"


def _summary(event_type: type[Event]) -> str:
    return _doc(event_type).split("\n")[0]


def _doc(event_type: type[Event]) -> str:
    return inspect.cleandoc(event_type.__doc__ or "")


def _section(event_type: type[Event]) -> Iterator[str]:
    yield f"### `{event_type.topic}`\n"
    yield f"`{schema_name(event_type)}`. {_doc(event_type)}\n"
    yield from _TABLE
    notes = field_notes(event_type)
    for field in fields(event_type):
        name, wire = field.name, wire_types(event_type)[field.name]
        note = " ".join(notes.get(name, COMMON.get(name, "")).split())
        added = "" if field.default is MISSING else f" Added later; {field.default} where a trace has no such field."
        yield f"| `{name}` | {wire} | {UNITS.get(name.rpartition('_')[2], '')} | {_cell((note + added).strip())} |"


def _codes() -> Iterator[str]:
    """A table for each field that holds a code, with the comment beside each meaning in the source."""
    for (event_type, name), words in CODES.items():
        rows = [f"| {code} | `{word}` | {_cell(_comment_of(words, word))} |" for code, word in enumerate(words)]
        title = f"### Codes of `{name}` in `{event_type.topic}`"
        yield "\n".join([title, "", "| code | name | meaning |", "| --- | --- | --- |", *rows])


def _comment_of(words: Sequence[str], word: str) -> str:
    """What stands beside a word in the tuple of words, which is a constant of the module of events."""
    name = next(name for name, value in vars(events).items() if value is words)
    source = inspect.getsource(events).partition(f"\n{name} = (\n")[2].partition("\n)\n")[0]
    found = re.search(rf'"{word}",  # (.+)', source)
    return found.group(1) if found else ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
