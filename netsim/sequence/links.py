"""Which reception led to which sending: cause links along a node's life line.

A message names the messages that its sender had received (see `netsim.metrics.causes`). A link leads from where the last
part of such a message arrived at the sender to where the message that it led to first goes on the air; of a message that is
passed on over several hops also from each arrival to the next hop's sending.
"""

from collections import defaultdict
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from netsim.sequence.ink import add, number
from netsim.sequence.plan import Plan
from netsim.sequence.records import Exchange

LINK = "#cdd4de"
"""Colour of links between messages whose kind is not known."""
_BULGE, _SLOPE = 6.0, 0.1
_WIDEST, _SHARE = 30.0, 0.42  # in points, and of a column


@dataclass(frozen=True, slots=True)
class Link:
    """From a reception to the sending that it led to, at one node.

    Attributes:
        node: The node.
        received_ns: When the one message had arrived there.
        sent_ns: When the other began to go out.
        cause: The message received.
        effect: The message sent; the same where it was passed on.
    """

    node: int
    received_ns: int
    sent_ns: int
    cause: int
    effect: int


def cause_links(exchange: Exchange) -> list[Link]:
    """All links both ends of which are in the window, in the order of their sendings."""
    arrived = _arrivals(exchange)
    found: list[Link] = []
    for (message, node), sent_ns in _first_sendings(exchange).items():
        sending = exchange.sendings.get(message)
        is_own = sending is not None and sending.source == node
        causes = (sending.causes if sending is not None else ()) if is_own else (message,)
        for cause in causes:
            received_ns = arrived.get((cause, node))
            if received_ns is not None and received_ns <= sent_ns:
                found.append(Link(node, received_ns, sent_ns, cause, message))
    return found


def _first_sendings(exchange: Exchange) -> dict[tuple[int, int], int]:
    """When each node first sent each message, or announced it by wake-up frames."""
    found: dict[tuple[int, int], int] = {}
    for sent in exchange.transmissions:
        if sent.message_id and sent.role != "ack":
            found.setdefault((sent.message_id, sent.source), sent.start_ns)
    return found


def _arrivals(exchange: Exchange) -> dict[tuple[int, int], int]:
    """When each message had arrived at each node: as delivered there, else as its first frame was received there."""
    found: dict[tuple[int, int], int] = {}
    for sent in exchange.transmissions:
        if sent.message_id and sent.carries_message:
            for arm in sent.arms:
                if arm.is_received:
                    found.setdefault((sent.message_id, arm.node), sent.end_ns)
    for message, there in exchange.delivered.items():
        for node, note in there.items():
            if (message, node) in found:
                found[message, node] = note.time_ns
    return found


def draw_links(parent: ET.Element, plan: Plan) -> None:
    """Thin dotted arcs to the left of the life lines; receptions at one instant that led to one sending share theirs."""
    arcs: defaultdict[tuple[int, int, int, int], list[int]] = defaultdict(list)
    for link in cause_links(plan.exchange):
        arcs[link.node, link.received_ns, link.sent_ns, link.effect].append(link.cause)
    numbers = {kind: str(place) for place, kind in enumerate(plan.colours)}
    for (node, received_ns, sent_ns, effect), causes in arcs.items():
        sending = plan.exchange.sendings.get(effect)
        kind = sending.kind if sending is not None else ""
        add(
            parent,
            "path",
            class_="c",
            d=_arc(plan.x[node] - 3.0, plan.y(received_ns), plan.y(sent_ns), min(_WIDEST, _SHARE * plan.column)),
            data_m=str(effect),
            data_c=" ".join(map(str, causes)),
            data_k=numbers.get(kind, "-1"),
            stroke=plan.colours.get(kind, LINK),
        )


def _arc(x: float, top: float, bottom: float, widest: float) -> str:
    """A curve that leaves the life line and comes back to it."""
    bulge = min(widest, _BULGE + _SLOPE * (bottom - top)) / 0.75
    reach = min(24.0, 0.3 * (bottom - top))
    a, b, c, d = (number(value) for value in (x - bulge, top + reach, bottom - reach, bottom))
    return f"M{number(x)} {number(top)}C{a} {b} {a} {c} {number(x)} {d}"
