"""Names of the nodes of a trace, and instants as they are printed."""

from collections.abc import Callable
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.metrics.collect import replay
from netsim.replay import node_ids
from netsim.trace.events import BROADCAST, NodeTable
from netsim.trace.reader import read_trace
from netsim.trace.recorder import Observer
from netsim.units import NS_PER_S

Label = Callable[[int], str]


def labels(trace: Path) -> Label:
    """How to call the nodes of a trace: by name if it has a table of them, else by number."""
    names: dict[int, str] = {}
    for _, event in read_trace(trace, {NodeTable.topic}, 0, 1):
        if isinstance(event, NodeTable):
            names = dict(zip(map(int, event.node), event.name, strict=True))
    return lambda node: "all" if node == BROADCAST else names.get(node, str(node))


def one_node(trace: Path, option: str, given: str) -> int:
    """The id of a node that is given by id or name.

    Raises:
        ScenarioError: If it is not exactly one node of the trace.
    """
    found = node_ids(trace, given.split(","))
    if len(found) != 1:
        message = f"{option}: expected one node, got {given}"
        raise ScenarioError(message)
    return next(iter(found))


def follow(trace: Path, observer: Observer, end_ns: int | None = None) -> None:
    """Hand an observer the events of a trace that it is for, up to an instant."""
    topics = {event_type.topic for event_type in observer.handlers()}
    replay(read_trace(trace, topics, None, end_ns), [observer])


def instant(time_ns: int) -> str:
    """An instant in seconds, to the microsecond."""
    return f"{time_ns / NS_PER_S:.6f}"
