"""Giving a group to another node, until it confirms."""

from dataclasses import replace

from netsim.algorithms.joint_messages import Held, encode_given, encode_taken
from netsim.algorithms.joint_station import GIVEN, TAKEN, Station
from netsim.api import Message, Op
from netsim.units import s_to_ns


def give(station: Station, held: Held, receiver: int) -> Op[bool]:
    """Give a group to a node; whether it has confirmed. The group's turn goes up by one.

    Args:
        station: Of the giver.
        held: The group.
        receiver: Node to give it to.
    """
    node, parameters = station.node, station.parameters
    given = replace(held, turn=held.turn + 1)
    payload, confirmation = encode_given(given, parameters.payload), encode_taken(given)

    def confirms(message: Message) -> bool:
        return message.source == receiver and message.payload == confirmation

    for _ in range(parameters.give_attempts):
        node.send(receiver, GIVEN, payload)
        answer = yield from node.receive(kinds={TAKEN}, match=confirms, timeout_ns=s_to_ns(parameters.give_s))
        if answer is not None:
            return True
    node.log(f"node {receiver} does not confirm that it takes {held.label}")
    return False
