"""What each node's radio does over a window, and which roles it holds."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

from netsim.sequence.records import Change, Exchange, Span

FIRST_STATE = "listen"
"""Of a radio that has announced nothing yet."""
DOWN = ("dead", "off", "crashed")
"""States in which nothing is to be expected of a node."""
_LIFE_STATES = {"crashed": "crashed", "rebooted": "listen"}


@dataclass(frozen=True, slots=True)
class RoleSpan:
    """A role that a node holds for a while.

    Attributes:
        node: The node.
        role: Such as `leader 0`.
        start_ns: Since when; that of the window if it was earlier.
        end_ns: Until when.
        is_taken: Whether it was taken within the window.
    """

    node: int
    role: str
    start_ns: int
    end_ns: int
    is_taken: bool


def announced(exchange: Exchange, node: int, first_ns: int, last_ns: int) -> list[Span]:
    """The states of a node's radio as it announced them, and as crashes and reboots tell.

    At one instant crashes prevail, and reboots yield.
    """
    changes = exchange.radio.get(node, [])
    lives = [
        Change(each.time_ns, node, _LIFE_STATES[each.event.event])
        for each in exchange.lives
        if each.event.node == node and each.event.event in _LIFE_STATES
    ]
    up = [life for life in lives if life.state == FIRST_STATE]
    down = [life for life in lives if life.state != FIRST_STATE]
    ordered = sorted([*up, *changes, *down], key=lambda change: change.time_ns)
    return list(_spans(node, ordered, first_ns, last_ns))


def _spans(node: int, changes: Iterable[Change], first_ns: int, last_ns: int) -> Iterator[Span]:
    steps = [(first_ns, FIRST_STATE)]
    for change in changes:
        if change.time_ns <= first_ns:
            steps[0] = first_ns, change.state
        elif change.time_ns < last_ns:
            steps.append((change.time_ns, change.state))
    for (start_ns, state), (end_ns, _) in pairwise([*steps, (last_ns, "")]):
        if end_ns > start_ns:
            yield Span(node, state, start_ns, end_ns)


def roles(exchange: Exchange, node: int, first_ns: int, last_ns: int) -> list[RoleSpan]:
    """The roles of a node; who goes down holds none any more."""
    ends = [
        each.time_ns for each in exchange.lives if each.event.node == node and each.event.event in ("died", "crashed")
    ]
    steps = [
        (each.time_ns, each.event.role, bool(each.event.holds)) for each in exchange.roles if each.event.node == node
    ]
    steps += [(time_ns, "", False) for time_ns in ends]
    held: dict[str, int] = {}
    found: list[RoleSpan] = []
    for time_ns, role, holds in [*sorted(steps, key=lambda step: step[0]), (last_ns, "", False)]:
        if holds:
            held.setdefault(role, time_ns)
            continue
        for over in [name for name in held if role in ("", name)]:
            since_ns = held.pop(over)
            if time_ns > first_ns and since_ns < last_ns:
                found.append(RoleSpan(node, over, max(since_ns, first_ns), min(time_ns, last_ns), since_ns >= first_ns))
    return found
