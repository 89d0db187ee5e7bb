"""Geographically constrained groups: whoever stands in a region, called by a leader (Liu et al. 2004, section 5).

A group needs no membership list: the leader sends each call to a shape that covers the region, with the region in it, and
who stands in the region is a member for that call. A group so migrates by calling another region next time, and grows or
shrinks by union and intersection.

    leader: ticket = call(node, group, number, b"how loud?"); answers = yield from collect(node, group, number, deadline_ns)
    member: yield from serve(node, lambda heard: reading_of(heard.payload))
"""

from collections.abc import Callable
from dataclasses import dataclass

from netsim.api import Message, NodeHandle, Op, Ticket
from netsim.codec import Record
from netsim.protocols.region_payload import decode_region, encode_region
from netsim.protocols.regions import CompoundRegion, contains, covering

GROUP_CALL, GROUP_ANSWER = "group-call", "group-answer"
_TURN = Record("HI")  # name of the group, number of the call


@dataclass(frozen=True, slots=True)
class GeographicGroup:
    """A group as its leader sees it.

    Attributes:
        name: Of the group, 0 to 65,535; groups of one leader have different ones.
        region: Who stands in it is a member.
    """

    name: int
    region: CompoundRegion


@dataclass(frozen=True, slots=True)
class GroupCall:
    """A call as a member hears it.

    Attributes:
        leader: Who calls.
        group: The group.
        number: Of the call.
        payload: What the leader says.
        message: The message that it came in.
    """

    leader: int
    group: GeographicGroup
    number: int
    payload: bytes
    message: Message


def call(node: NodeHandle, group: GeographicGroup, number: int, payload: bytes) -> Ticket | None:
    """Speak to all in a group's region.

    Args:
        node: The leader.
        group: Whom to speak to.
        number: Of the call: answers name it, so that late ones of an earlier call are told apart.
        payload: What to say.

    Returns:
        The ticket of the geocast; None where nothing lies in the region, and nothing is sent.
    """
    cover = covering(group.region)
    if cover is None:
        return None
    head = _TURN.pack(group.name, number) + encode_region(group.region)
    return node.geocast(cover, GROUP_CALL, head + payload)


def heard_call(message: Message) -> GroupCall:
    """What a message of the kind `GROUP_CALL` says."""
    name, number = _TURN.unpack(message.payload, 0)
    region, end = decode_region(message.payload, _TURN.size_byte)
    return GroupCall(message.source, GeographicGroup(int(name), region), int(number), message.payload[end:], message)


def is_member(node: NodeHandle, group: GeographicGroup) -> bool:
    """Whether a node stands in the group's region now."""
    return bool(contains(group.region, node.position_m))


def answer(node: NodeHandle, heard: GroupCall, payload: bytes) -> Ticket:
    """Tell the leader of a call something."""
    turn = _TURN.pack(heard.group.name, heard.number)
    return node.send(heard.leader, GROUP_ANSWER, turn + payload, causes=[heard.message])


def collect(node: NodeHandle, group: GeographicGroup, number: int, deadline_ns: int) -> Op[dict[int, bytes]]:
    """The answers to a call until a deadline, by the node's clock: of every member the first one."""
    turn = _TURN.pack(group.name, number)
    found: dict[int, bytes] = {}
    while node.now_ns < deadline_ns:
        message = yield from node.receive(
            kinds={GROUP_ANSWER},
            match=lambda each: each.payload.startswith(turn),
            timeout_ns=deadline_ns - node.now_ns,
        )
        if message is not None:
            found.setdefault(message.source, message.payload[len(turn) :])
    return found


def serve(
    node: NodeHandle, respond: Callable[[GroupCall], bytes | None], *, spread_ns: int = 0, until_ns: int | None = None
) -> Op[None]:
    """Answer every call of a group that this node is a member of.

    Args:
        node: The member.
        respond: What to answer; None for silence.
        spread_ns: Answers wait for a random time up to this, lest all members speak at once.
        until_ns: When to stop, by the node's clock; None for never.
    """
    rng = node.rng("group-answers")
    while until_ns is None or node.now_ns < until_ns:
        message = yield from node.receive(
            kinds={GROUP_CALL}, timeout_ns=None if until_ns is None else until_ns - node.now_ns
        )
        if message is None:
            continue
        heard = heard_call(message)
        if is_member(node, heard.group) and (payload := respond(heard)) is not None:
            node.spawn(_later(node, heard, payload, int(rng.random() * spread_ns)))


def _later(node: NodeHandle, heard: GroupCall, payload: bytes, pause_ns: int) -> Op[None]:
    yield from node.pause(pause_ns)
    answer(node, heard, payload)
