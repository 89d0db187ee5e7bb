"""How events become tables: which columns a table has, what they mean, and how their values are found in an event.

An event is either one row of a table, or, where it holds columns itself (all nodes' energies at an instant, a frame's
listeners), as many rows as those are long.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any, Literal

from netsim.export.selection import Selection
from netsim.trace.cdr import field_notes, wire_types
from netsim.trace.events import BROADCAST, Event

Subject = Literal["", "frame", "message", "node", "row"]
"""What a choice of nodes and message kinds applies to: nothing, the frame, the message, the event's node, each row's."""

_COMMON: Mapping[str, str] = {
    "node": "Node id; its name is in `nodes`",
    "source": "Node id of the sender",
    "destination": "Node id of the receiver; 4294967295 stands for all in reach",
    "kind": "Kind of the message",
    "size_byte": "Size in bytes",
    "message_id": "Number of the message, one for the whole run",
    "frame_id": "Number of the frame, one for the whole run",
    "t_start_ns": "When its transmission began, in nanoseconds",
    "t_end_ns": "When its transmission ended, in nanoseconds",
    "tx_power_dbm": "Transmitted power in dBm",
    "hops": "Transmissions on its way",
    "latency_ns": "From sending to delivery, in nanoseconds",
    "name": "Name",
    "group": "Group of nodes in the scenario",
    "radio": "Its radio",
    "cpu": "Its processor",
    "x_m": "Position in metres, to the east",
    "y_m": "Position in metres, to the north",
    "width_m": "Width in metres",
    "height_m": "Height in metres",
    "consumed_j": "Energy drawn so far, in joules",
    "energy_j": "Energy in joules",
    "time_in_state_s": "How long the device did it, in seconds",
    "spent_j": "Energy spent of the allowance, in joules",
    "allowance_j": "The allowance, in joules",
    "detail": "In words",
    "reason": "Why",
    "target": "Number of the target",
    "variable": "Number of the variable of the graphical model",
    "round": "Round of the algorithm",
    "probability": "Probability",
    "host": "Node id of the host",
    "step": "Number of the measurement instant",
    "columns": "Columns of the grid",
    "cell_m": "Side of a cell in metres",
    "next_hop": "Node id of the next hop; 4294967295 where there is none",
    "role": "The role",
    "holds": "Whether it took the role (or left it)",
    "event": "What happened",
    "fields_json": "What was noted: a JSON object, units in its keys",
    "content_json": "The instance, as JSON",
    "message": "The line",
    "prr": "Packet reception ratio of a full-size frame without interference",
    "count": "How many",
}


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        name: Its name, with the unit.
        wire: Type of its values: `uint32`, `int64`, `float64`, `bool`, `string`, ...
        meaning: What it says, for people.
        value: Its value in an event; of a column that differs by row the values, one a row.
        by_row: Whether it differs by row.
        codes: What the numbers stand for, where they are codes.
        nullable: Whether a value may be missing (None).
    """

    name: str
    wire: str
    meaning: str
    value: Callable[[Any], Any]
    by_row: bool = False
    codes: tuple[str, ...] = ()
    nullable: bool = False


@dataclass(frozen=True)
class Sheet:
    """A table.

    Attributes:
        name: Its name.
        title: What a row is.
        event: Class of the events it is made of.
        columns: Its columns, without the time.
        subject: What a choice of nodes and message kinds applies to.
    """

    name: str
    title: str
    event: type[Event]
    columns: tuple[Column, ...]
    subject: Subject = ""

    @cached_property
    def measure(self) -> int | None:
        """Place of a column whose length is the number of rows of an event; None where an event is one row."""
        return next((place for place, column in enumerate(self.columns) if column.by_row), None)

    def has(self, event: Any, selection: Selection) -> bool:
        """Whether an event belongs to what is exported; single rows are chosen later."""
        if self.subject == "frame":
            return selection.has_frame(event)
        if self.subject == "message":
            return selection.has_message(event)
        return self.subject != "node" or selection.has_node(event.node)


def one(
    event: type[Event],
    field: str,
    name: str = "",
    meaning: str = "",
    *,
    codes: tuple[str, ...] = (),
    is_flag: bool = False,
) -> Column:
    """A column of a field that an event has once."""
    wire = "string" if codes else "bool" if is_flag else wire_types(event)[field]
    return Column(name or field, wire, meaning or _meaning(event, field, name), attrgetter(field), codes=codes)


def each(
    event: type[Event],
    field: str,
    name: str = "",
    meaning: str = "",
    *,
    codes: tuple[str, ...] = (),
    is_flag: bool = False,
) -> Column:
    """A column of a field that an event has once a row."""
    wire = "string" if codes else "bool" if is_flag else wire_types(event)[field].removesuffix("[]")
    text = meaning or _meaning(event, field, name)
    return Column(name or field, wire, text, attrgetter(field), by_row=True, codes=codes)


def ones(event: type[Event], *fields: str) -> tuple[Column, ...]:
    """Columns of fields that an event has once, under their own names."""
    return tuple(one(event, field) for field in fields)


def eaches(event: type[Event], *fields: str) -> tuple[Column, ...]:
    """Columns of fields that an event has once a row, under their own names."""
    return tuple(each(event, field) for field in fields)


def place_of(field: str, name: str, meaning: str) -> Column:
    """A column with the place of each row's value in the event's field, from 0."""

    def places(event: Any) -> Sequence[int]:
        return range(len(getattr(event, field)))

    return Column(name, "uint32", meaning, places, by_row=True)


def computed(
    name: str, wire: str, meaning: str, value: Callable[[Any], Any], *, by_row: bool = False, nullable: bool = False
) -> Column:
    """A column of values that are made of several fields."""
    return Column(name, wire, meaning, value, by_row, nullable=nullable)


def _meaning(event: type[Event], field: str, name: str) -> str:
    """The note under a field of an event class, or the usual meaning of the name."""
    note = " ".join(field_notes(event).get(field, "").split()).replace("`BROADCAST`", f"{BROADCAST}")
    return note or _COMMON.get(name or field, (name or field).replace("_", " "))
