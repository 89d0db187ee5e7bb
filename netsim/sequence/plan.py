"""Where everything goes: a column a node, and a place on the page for each instant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from netsim.replay import style
from netsim.sequence.ink import colour, width_of
from netsim.sequence.records import Exchange
from netsim.sequence.scale import TimeScale, scale_of

AXIS_WIDTH = 100.0
HEAD_HEIGHT = 30.0
NAME_SIZE = 11.0
_WIDE, _NARROW = 180.0, 46.0  # columns
_WIDTH = 1200.0  # of all columns, if they are neither too wide nor too narrow so
_RIGHT, _TOP, _BOTTOM = 30.0, 16.0, 22.0
_TALKATIVE_EVENTS = ("died", "crashed", "rebooted", "failed")


@dataclass(frozen=True)
class Plan:
    """A layout.

    Attributes:
        exchange: What is shown.
        order: Nodes from left to right.
        x: Where the life line of each is.
        column: Width of a column.
        scale: The time axis.
        colours: Of the message kinds.
    """

    exchange: Exchange
    order: Sequence[int]
    x: Mapping[int, float]
    column: float
    scale: TimeScale
    colours: Mapping[str, str]

    @property
    def width(self) -> float:
        """Of the chart, axis included."""
        return AXIS_WIDTH + self.column * len(self.order) + _RIGHT

    @property
    def height(self) -> float:
        """Of the chart, names included."""
        return HEAD_HEIGHT + _TOP + self.scale.length + _BOTTOM

    @property
    def first_ns(self) -> int:
        """When the chart begins."""
        return int(self.scale.instants_ns[0])

    @property
    def last_ns(self) -> int:
        """When it ends."""
        return int(self.scale.instants_ns[-1])

    def y(self, time_ns: int) -> float:
        """Where an instant lies on the page."""
        return HEAD_HEIGHT + _TOP + self.scale.place(time_ns)


def plan(exchange: Exchange, time: str) -> Plan:
    """The layout of an exchange.

    Args:
        exchange: What is shown.
        time: See `netsim.sequence.scale.scale_of`.
    """
    order = node_order(exchange)
    longest = max((width_of(exchange.name(node), NAME_SIZE) for node in order), default=0.0)
    least = min(max(_NARROW, longest + 10.0), 2 * _NARROW)
    column = min(_WIDE, max(least, _WIDTH / len(order)))
    kinds = {kind: colour(style.kind_colour(place)) for place, kind in enumerate(exchange.kinds)}
    x = {node: AXIS_WIDTH + column * (place + 0.5) for place, node in enumerate(order)}
    return Plan(exchange, order, x, column, scale_of(exchange, time, _marks_ns(exchange, set(order))), kinds)


def node_order(exchange: Exchange) -> list[int]:
    """The nodes that take part, in the order in which they first send; to the right those who only listen."""
    talk = dict.fromkeys(each.source for each in exchange.transmissions)
    listen = dict.fromkeys(arm.node for each in exchange.transmissions for arm in each.arms)
    return [*talk, *(node for node in listen if node not in talk)]


def _marks_ns(exchange: Exchange, nodes: set[int]) -> list[int]:
    """Instants of what is marked on the life lines of some nodes."""
    noted = [
        *(each.time_ns for each in exchange.rounds if each.event.node in nodes),
        *(each.time_ns for each in exchange.notes if each.event.node in nodes),
        *(each.time_ns for each in exchange.dropped if each.event.node in nodes),
        *(each.time_ns for each in exchange.roles if each.event.node in nodes),
        *(each.time_ns for each in exchange.lives if each.event.node in nodes and each.event.event in TOLD_LIVES),
    ]
    return [time_ns for time_ns in noted if exchange.start_ns <= time_ns < exchange.end_ns]


TOLD_LIVES = frozenset(_TALKATIVE_EVENTS)
"""What befalls a node that is marked on its life line."""
