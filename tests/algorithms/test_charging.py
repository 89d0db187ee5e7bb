"""Work that is done whether or not the energy allowance has room for it."""

from netsim.algorithms.charging import charge
from netsim.api import NoEnergyError


class Node:
    """As much of a node as is charged: it refuses from so many operations on."""

    def __init__(self, most):
        self.most, self.computed, self.said = most, [], []

    def compute(self, operations):
        if operations > self.most:
            message = "the allowance is used up"
            raise NoEnergyError(message)
        self.computed.append(operations)
        yield

    def log(self, text):
        self.said.append(text)


def test_what_the_allowance_has_room_for_occupies_the_processor():
    node = Node(10)
    assert len(list(charge(node, 10))) == 1
    assert (node.computed, node.said) == ([10], [])


def test_what_it_refuses_is_said_and_raises_nothing():
    node = Node(10)
    assert list(charge(node, 11)) == []
    assert (node.computed, node.said) == ([], ["too little energy to compute: it is charged to nobody"])
