"""What an algorithm imports: everything a node may do, and nothing else.

An algorithm is a class with one generator method, `run(node)`. It keeps its state in local variables and waits with
`yield from`. It learns about the world only through its `NodeHandle`: its knowledge, its own sensor, the messages it
receives. Payloads are bytes (see `netsim.codec`); nothing is passed between nodes by reference.
"""

from netsim.api.handle import Algorithm, NodeHandle
from netsim.api.records import (
    SERVICE_PREFIX,
    Circle,
    Delivery,
    Message,
    Neighbour,
    NoEnergyError,
    Observation,
    Op,
    Polygon,
    Rectangle,
    Region,
)
from netsim.api.waiting import Budget, EnergyTask, Task, Ticket
from netsim.trace.events import BROADCAST

__all__ = [
    "BROADCAST",
    "SERVICE_PREFIX",
    "Algorithm",
    "Budget",
    "Circle",
    "Delivery",
    "EnergyTask",
    "Message",
    "Neighbour",
    "NoEnergyError",
    "NodeHandle",
    "Observation",
    "Op",
    "Polygon",
    "Rectangle",
    "Region",
    "Task",
    "Ticket",
]
