"""From a trace to its rounds, its graphical model and the places that the trace tells."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from netsim.errors import ScenarioError, TraceError
from netsim.flow.hosts import HostLog
from netsim.flow.rounds import Edge, Round, RoundLog
from netsim.flow.trees import SpanningTrees, load_trees
from netsim.trace.events import (
    AlgorithmRecord,
    Event,
    GraphMessages,
    NodeLife,
    NodeTable,
    TruthTargets,
    VariablePlacement,
)
from netsim.trace.reader import read_trace, trace_metadata

_TOPICS = {
    each.topic for each in (NodeTable, NodeLife, TruthTargets, VariablePlacement, GraphMessages, AlgorithmRecord)
}


@dataclass(frozen=True)
class Flow:
    """The information flow of a run.

    Attributes:
        title: Name of the scenario and seed.
        nodes: Who takes part.
        model: The graphical model as it was placed at the start.
        truth: True positions of targets at the start, if the trace has them.
        rounds: All rounds from 0 on.
        hosts: What befell the nodes that host the vertices.
    """

    title: str
    nodes: NodeTable
    model: VariablePlacement
    truth: TruthTargets | None
    rounds: tuple[Round, ...]
    hosts: HostLog = field(default_factory=HostLog)

    def down_in(self, this: Round) -> frozenset[int]:
        """The vertices whose node is down in a round, as it begins."""
        at_start = dict(zip(map(int, self.model.variable), map(int, self.model.host), strict=True))
        return self.hosts.down_at(at_start, this.time_ns)

    @property
    def telling(self) -> list[int]:
        """The rounds in which something was sent, other messages than in the round before."""
        last: tuple[Edge, ...] = ()
        found = []
        for each in self.rounds:
            if each.messages and (each.messages != last or self.hosts.taken_over_for(each.number)):
                found.append(each.number)
            last = each.messages
        return found

    @property
    def last_active(self) -> int:
        """The last round in which something was sent."""
        return max((each.number for each in self.rounds if each.messages), default=0)


def load_flow(trace: Path) -> Flow:
    """Read the information flow of a run.

    Raises:
        ScenarioError: If the run passed no graph messages, or passed them in no common rounds.
        TraceError: If the trace cannot be read, has no nodes, or names vertices in its messages that its model lacks.
    """
    return _flow(trace, *_read(trace))


def load_flow_or_trees(trace: Path) -> Flow | SpanningTrees:
    """The spanning trees of a run whose nodes share no rounds and that grew some; of any other its information flow.

    Raises:
        ScenarioError: See `load_flow`.
        TraceError: See `load_flow`.
    """
    first, log, hosts = _read(trace)
    trees = None if log.is_synchronous else load_trees(trace)
    return _flow(trace, first, log, hosts) if trees is None else trees


def _flow(trace: Path, first: Mapping[type, Event], log: RoundLog, hosts: HostLog) -> Flow:
    nodes, model, truth = first.get(NodeTable), first.get(VariablePlacement), first.get(TruthTargets)
    rounds = log.rounds()
    if not isinstance(nodes, NodeTable):
        message = f"{trace}: expected a table of nodes, got none"
        raise TraceError(message)
    if not isinstance(model, VariablePlacement) or not any(each.messages for each in rounds):
        message = (
            f"{trace}: expected messages between the vertices of a graphical model, got none; the algorithm passes none"
        )
        raise ScenarioError(message)
    if not log.is_synchronous:
        message = (
            f"{trace}: expected rounds that all nodes share, got nodes that each count their own; {_advice(trace)}"
        )
        raise ScenarioError(message)
    _check_vertices(trace, model, rounds)
    metadata = trace_metadata(trace)
    title = f"{metadata.get('scenario', trace.stem)}, seed {metadata.get('seed', '?')}"
    return Flow(title, nodes, model, truth if isinstance(truth, TruthTargets) else None, rounds, hosts)


def _advice(trace: Path) -> str:
    if load_trees(trace) is None:
        return "run the scenario with algorithm.schedule=synchronous (type trmp: with algorithm.type=max-product)"
    return (
        "tree-reweighted max-product has no others: netsim flow shows its spanning trees; for rounds, run the scenario with "
        "algorithm.type=max-product"
    )


def _read(trace: Path) -> tuple[dict[type, Event], RoundLog, HostLog]:
    """The first event of each kind, all graph messages, and what befell the hosts."""
    first: dict[type, Event] = {}
    log, hosts = RoundLog(), HostLog()
    for time_ns, event in read_trace(trace, _TOPICS):
        if isinstance(event, GraphMessages):
            log.add(event, time_ns)
        elif isinstance(event, NodeLife):
            hosts.add_life(event, time_ns)
        elif isinstance(event, AlgorithmRecord):
            hosts.add_record(event, time_ns)
        else:
            first.setdefault(type(event), event)
    return first, log, hosts


def _check_vertices(trace: Path, model: VariablePlacement, rounds: tuple[Round, ...]) -> None:
    known = set(map(int, model.variable))
    unknown = {vertex for each in rounds for edge in each.messages for vertex in edge} - known
    if unknown:
        message = (
            f"{trace}: expected messages between the {len(known)} vertices of the model, got vertex {min(unknown)}"
        )
        raise TraceError(message)
