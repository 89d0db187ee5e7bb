"""Records of a graphical model that lives on the nodes: what a node knows of it, and the whole of it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from netsim.kernels.factor_graph import Factor, FactorGraph, vertices_of
from netsim.kernels.vertex import Vertex

Form = Literal["pairwise", "factor"]
"""Which vertices exchange messages: variables alone, or variables and factors."""


@dataclass(frozen=True, slots=True)
class GraphKnowledge:
    """What a node knows: the vertices it hosts, and where their neighbours are.

    Attributes:
        node: Its id.
        vertices: The vertices it hosts, ascending, with their own potentials only.
        hosts: Node of each of them and of each of their neighbours.
    """

    node: int
    vertices: tuple[Vertex, ...]
    hosts: Mapping[int, int]


@dataclass(frozen=True, eq=False)
class GraphInstance:
    """A model and its placement.

    Attributes:
        graph: The model.
        form: Which vertices exchange messages.
        hosts: Node of each vertex, by vertex id.
    """

    graph: FactorGraph
    form: Form
    hosts: tuple[int, ...]

    def vertices(self) -> list[Vertex]:
        """All vertices, ascending."""
        return vertices_of(self.graph, self.form)

    def to_json(self) -> str:
        """The instance as JSON; floats survive the round trip bit for bit."""
        factors = [{"scope": factor.scope, "table": factor.table.ravel().tolist()} for factor in self.graph.factors]
        content = {
            "cardinalities": self.graph.cardinalities,
            "factors": factors,
            "form": self.form,
            "hosts": self.hosts,
        }
        return json.dumps(content, allow_nan=False)

    @staticmethod
    def from_json(text: str) -> "GraphInstance":
        """The inverse of `to_json`."""
        content = json.loads(text)
        cards = tuple(content["cardinalities"])
        factors = (
            Factor(tuple(f["scope"]), np.array(f["table"], dtype=float).reshape([cards[v] for v in f["scope"]]))
            for f in content["factors"]
        )
        return GraphInstance(FactorGraph(cards, tuple(factors)), content["form"], tuple(content["hosts"]))
