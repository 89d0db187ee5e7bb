"""A graphical model as the problem: read from a file or drawn, its variables spread over the nodes.

The model itself is the truth here: there is nothing to sense, and the exact answer is its marginals and modes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from netsim.errors import ScenarioError
from netsim.kernels.factor_graph import FactorGraph
from netsim.kernels.graph_files import parse_libdai, parse_uai
from netsim.kernels.graph_model import Form, GraphInstance, GraphKnowledge
from netsim.kernels.semiring import FloatArray
from netsim.kernels.vertex import Vertex
from netsim.parameters import Name, parameters
from netsim.problems.drawn_graphs import ChainGraph, GridGraph, TreeGraph, draw_graph
from netsim.problems.problem import placement
from netsim.rng import Streams
from netsim.trace.events import Event, VariablePlacement


@parameters
class GraphFile:
    """A model read from a file: `.uai` (Markov network) or `.fg` (libDAI)."""

    type: Literal["file"] = "file"
    """Where the model comes from."""
    path: Name
    """The file, relative to the scenario."""


@parameters
class GraphParameters:
    """Inference on a given graphical model whose variables live on the nodes."""

    type: Literal["factor-graph"] = "factor-graph"
    """Kind of problem."""
    graph: GraphFile | ChainGraph | TreeGraph | GridGraph = GridGraph()
    """The model."""
    form: Form = "factor"
    """Vertices that exchange messages: variables and factors, or variables alone (`pairwise`, factors of two at most)."""
    placement: Literal["round_robin", "contiguous"] = "round_robin"
    """Variable i on node i modulo the number of nodes, or equal runs of consecutive variables on each node. A factor
    lives with its first variable."""


@dataclass(frozen=True, eq=False)
class GraphProblem:
    """A graphical model on the nodes.

    Attributes:
        instance: Model and placement.
    """

    instance: GraphInstance

    @property
    def kind(self) -> str:
        """`factor-graph`."""
        return "factor-graph"

    @cached_property
    def _vertices_by_node(self) -> dict[int, list[Vertex]]:
        hosted: dict[int, list[Vertex]] = {}
        for vertex in self.instance.vertices():
            hosted.setdefault(self.instance.hosts[vertex.id], []).append(vertex)
        return hosted

    def instance_json(self) -> str:
        """The instance; read it with `GraphInstance.from_json`."""
        return self.instance.to_json()

    def truth_events(self) -> Sequence[Event]:
        """None: the answer is a function of the instance."""
        return ()

    def knowledge(self, node: int) -> GraphKnowledge:
        """The vertices a node hosts, perhaps none."""
        hosts = self.instance.hosts
        mine = tuple(self._vertices_by_node.get(node, ()))
        met = sorted({other for vertex in mine for other in (vertex.id, *vertex.neighbours)})
        return GraphKnowledge(node, mine, {vertex: hosts[vertex] for vertex in met})

    def later_truth(self, end_ns: int) -> Sequence[tuple[int, Event]]:
        """Nothing: the truth stays as it is."""
        return ()

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """Nodes have nothing to observe here.

        Raises:
            ScenarioError: Always.
        """
        text = f"node {node} has nothing to observe in a factor-graph problem"
        raise ScenarioError(text)

    def placement_event(self) -> VariablePlacement:
        """Where every vertex lives, and which exchange messages."""
        vertices, count = self.instance.vertices(), len(self.instance.graph.cardinalities)
        names = {v.id: f"variable {v.id}" if v.id < count else f"factor {v.id - count}" for v in vertices}
        edges = [(v.id, other) for v in vertices for other in v.neighbours if v.id < other]
        return placement(dict(enumerate(self.instance.hosts)), names, edges)


def parse_graph(text: str, name: str) -> FactorGraph:
    """A model from a file's text, by the ending of its name.

    Raises:
        ScenarioError: For an unknown ending or a faulty file.
    """
    if name.endswith(".uai"):
        return parse_uai(text, name)
    if name.endswith(".fg"):
        return parse_libdai(text, name)
    reason = f"{name}: expected a factor graph with the ending .uai or .fg"
    raise ScenarioError(reason)


def build(
    parameters: GraphParameters, nodes: Sequence[int], streams: Streams, file_text: str | None = None
) -> GraphProblem:
    """Make the problem. A drawn graph comes from the stream `world/graph`.

    Args:
        parameters: Which model and where it lives.
        nodes: Ids of the nodes that host variables.
        streams: The run's random streams.
        file_text: Content of the model's file, when it comes from one: reading files is the caller's affair.

    Raises:
        ScenarioError: Without nodes or text, for a faulty file, or a form that does not suit the model.
    """
    if not nodes:
        text = "a factor-graph problem needs at least one node to host its variables"
        raise ScenarioError(text)
    graph = _graph(parameters, streams, file_text)
    impossible = [index for index, factor in enumerate(graph.factors) if not factor.table.any()]
    if impossible:
        text = f"factor {impossible[0]} has no value above 0, so no state of the model is possible"
        raise ScenarioError(text)
    count = len(graph.cardinalities)
    places = _places(parameters, count, sorted(nodes))
    # A factor without variables is a constant; it sends nothing, and any node may hold it.
    homes = [places[factor.scope[0]] if factor.scope else min(nodes) for factor in graph.factors]
    hosts = (*places, *homes) if parameters.form == "factor" else tuple(places)
    instance = GraphInstance(graph, parameters.form, hosts)
    instance.vertices()
    return GraphProblem(instance)


def _graph(parameters: GraphParameters, streams: Streams, file_text: str | None) -> FactorGraph:
    if not isinstance(parameters.graph, GraphFile):
        return draw_graph(parameters.graph, streams.generator("world/graph"))
    if file_text is None:
        text = f"the content of {parameters.graph.path} was not given"
        raise ScenarioError(text)
    return parse_graph(file_text, parameters.graph.path)


def _places(parameters: GraphParameters, count: int, nodes: Sequence[int]) -> list[int]:
    if parameters.placement == "round_robin":
        return [nodes[variable % len(nodes)] for variable in range(count)]
    return [nodes[variable * len(nodes) // count] for variable in range(count)]
