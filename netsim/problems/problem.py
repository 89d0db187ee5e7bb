"""What the simulator asks of a problem, whatever its kind."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from netsim.kernels.semiring import FloatArray
from netsim.trace.events import Event, VariablePlacement


class Problem(Protocol):
    """A problem drawn for one run: its truth, what each node observes and knows, and its instance for exact answers."""

    @property
    def kind(self) -> str:
        """Name of the kind, as in the scenario: `association`, `factor-graph`."""
        ...

    def instance_json(self) -> str:
        """The instance without its truth, enough to compute the exact answer."""
        ...

    def truth_events(self) -> Sequence[Event]:
        """The truth as events for the trace."""
        ...

    def placement_event(self) -> VariablePlacement:
        """Which node hosts which variable, and the model's edges."""
        ...

    def knowledge(self, node: int) -> Any:
        """The frozen record a node is given at the start; None for a node that has no part in the problem."""
        ...

    def later_truth(self, end_ns: int) -> Iterable[tuple[int, Event]]:
        """How the truth goes on: events with their times in ns after 0, ascending, none after `end_ns`."""
        ...

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """What the node's sensor reads at a time. The same node at the same time reads the same, whoever asks, and when.

        Raises:
            ScenarioError: When the node has no sensor.
        """
        ...


def placement(
    hosts: Mapping[int, int], names: Mapping[int, str], edges: Sequence[tuple[int, int]]
) -> VariablePlacement:
    """The placement event of a model.

    Args:
        hosts: Node that hosts each variable.
        names: Name of each variable.
        edges: Pairs of variables.
    """
    variables = sorted(hosts)
    return VariablePlacement(
        variable=variables,
        name=[names[variable] for variable in variables],
        host=[hosts[variable] for variable in variables],
        edge_a=[first for first, _ in edges],
        edge_b=[second for _, second in edges],
    )
