"""What an algorithm holds while something goes on: tickets, tasks, its energy allowance."""

from types import TracebackType
from typing import Protocol, TypeVar

from netsim.api.records import Delivery, Op

T_co = TypeVar("T_co", covariant=True)


class Ticket(Protocol):
    """A receipt for a message that was handed over; it is on its way whether or not one waits."""

    message_id: int

    def wait(self) -> Op[Delivery]:
        """Wait until this node's link layer has finished with the message."""
        ...


class Task(Protocol[T_co]):
    """An operation running beside the caller on the same node."""

    def join(self) -> Op[T_co]:
        """Wait for the end and return the result."""
        ...

    def cancel(self) -> None:
        """End it where it waits."""
        ...


class Budget(Protocol):
    """What a node may draw in the present period, all its devices together. Without an allowance it is only counted."""

    @property
    def allowance_j(self) -> float:
        """What it may draw; infinity without an allowance."""
        ...

    @property
    def spent_j(self) -> float:
        """What it has drawn since the period began."""
        ...

    @property
    def left_j(self) -> float:
        """What is left of the allowance; 0 when it is used up."""
        ...

    @property
    def is_short(self) -> bool:
        """Whether it is used up."""
        ...

    @property
    def replenishes_ns(self) -> int | None:
        """When the next period begins, by the node's clock; None if there is none."""
        ...


class EnergyTask(Protocol):
    """Counts what the node draws inside a `with` block, and holds it against an allowance if there is one.

    Everything counts that the whole node draws meanwhile, listening and the work of other tasks included: tasks that
    overlap count the same joules twice.
    """

    def __enter__(self) -> "EnergyTask":
        """Begin to count."""
        ...

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Count no further; what was spent can still be read."""
        ...

    @property
    def allowance_j(self) -> float:
        """What the task may draw; infinity if it is only counted."""
        ...

    @property
    def spent_j(self) -> float:
        """What the node has drawn since the task began, until it ended."""
        ...

    @property
    def left_j(self) -> float:
        """What is left of the allowance; 0 when it is used up."""
        ...

    @property
    def is_short(self) -> bool:
        """Whether it is used up."""
        ...
