"""Whether a trace has what a replay is asked to show: nodes by name or id, message kinds, a time window."""

from collections.abc import Collection, Iterable, Iterator
from itertools import chain
from pathlib import Path

from netsim.errors import ScenarioError, TraceError
from netsim.replay.options import ReplayOptions
from netsim.trace.events import EnergyLedger, Frame, MessageSent, NodeTable
from netsim.trace.reader import last_time_ns, read_trace
from netsim.units import NS_PER_S

_LISTED = 12  # more names than this are cut short in a message


def node_ids(trace: Path | str, nodes: Iterable[str]) -> frozenset[int]:
    """The ids of nodes that are given by id or by the name they have on the map, such as `7` or `n07`.

    Raises:
        ScenarioError: If the trace has no such node.
        TraceError: If the trace cannot be read or names no nodes.
    """
    table = node_table(Path(trace))
    known = {str(node): int(node) for node in table.node}
    known |= {name: int(node) for name, node in zip(table.name, table.node, strict=True)}
    wanted = [node.strip() for node in nodes]
    _demand("nodes", [node for node in wanted if node not in known], table.name)
    return frozenset(known[node] for node in wanted)


def check_window(trace: Path | str, options: ReplayOptions) -> None:
    """Make sure that a trace has the nodes, the message kinds and the time that a replay is to show.

    Raises:
        ScenarioError: If it has not; the message names what is unknown and what there is.
        TraceError: If the trace cannot be read or names no nodes.
    """
    path = Path(trace)
    end_s = last_time_ns(path) / NS_PER_S
    if options.start_s > end_s:
        msg = f"start: expected a time up to {end_s:g} s, where the trace ends, got {options.start_s:g} s"
        raise ScenarioError(msg)
    if options.end_s is not None and options.end_s <= options.start_s:
        msg = f"end: expected a time after the start ({options.start_s:g} s), got {options.end_s:g} s"
        raise ScenarioError(msg)
    if options.nodes is not None:
        table = node_table(path)
        known = {int(node) for node in table.node}
        names = [f"{node} ({name})" for node, name in zip(table.node, table.name, strict=True)]
        _demand("nodes", [str(node) for node in sorted(options.nodes - known)], names)
    if options.kinds is not None:
        _check_kinds(path, options.kinds)


def check_instant(trace: Path | str, at_s: float) -> None:
    """Make sure that a picture's instant is within the trace.

    Raises:
        ScenarioError: If it is not.
        TraceError: If the trace cannot be read.
    """
    end_s = last_time_ns(Path(trace)) / NS_PER_S
    if not 0.0 <= at_s <= end_s:
        msg = f"--at: expected an instant from 0 to {end_s:g} s, where the trace ends, got {at_s:g} s"
        raise ScenarioError(msg)


def node_table(path: Path) -> NodeTable:
    """Who takes part.

    Raises:
        TraceError: If the trace names no nodes or cannot be read.
    """
    for _, event in read_trace(path, {NodeTable.topic}, end_ns=1):
        if isinstance(event, NodeTable) and len(event.node):
            return event
    msg = f"{path}: the trace names no nodes, so there is nothing to show"
    raise TraceError(msg)


def _check_kinds(path: Path, wanted: Collection[str]) -> None:
    """The quick places first: one look at the end of the file is enough for most traces."""
    found: set[str] = set()
    for some in chain(_booked_kinds(path), _aired_kinds(path)):
        found |= some
        if found.issuperset(wanted):
            return
    _demand("message kinds", sorted(set(wanted) - found), sorted(found))


def _booked_kinds(path: Path) -> Iterator[set[str]]:
    """Kinds that energy was spent on, told at the end of a run."""
    for _, event in read_trace(path, {EnergyLedger.topic}, start_ns=last_time_ns(path)):
        if isinstance(event, EnergyLedger):
            yield set(event.kind) - {""}


def _aired_kinds(path: Path) -> Iterator[set[str]]:
    """Kinds of the messages sent and of the frames on the air, part by part of the file."""
    from netsim.replay.source import batches

    for topic in (MessageSent.topic, Frame.topic):
        for batch in batches(path, [topic], 0, last_time_ns(path) + 1):
            yield set(batch.words("kind")[1])


def _demand(what: str, unknown: Collection[str], known: Collection[str]) -> None:
    if unknown:
        some = f"some of {_listed(known)}" if known else "no choice, for the trace has none"
        msg = f"{what}: expected {some}; got {_listed(unknown)}"
        raise ScenarioError(msg)


def _listed(names: Collection[str]) -> str:
    shown = list(names)[:_LISTED]
    more = f", ... ({len(names)} in all)" if len(names) > _LISTED else ""
    return ", ".join(shown) + more
