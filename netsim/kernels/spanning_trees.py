"""Spanning forests that together cover every edge of a graph, as tree-reweighted max-product needs."""

from collections.abc import Iterable, Mapping, Sequence

Edge = tuple[int, int]
"""Two vertices, the lower one first."""
Forest = frozenset[Edge]
"""Edges of one spanning tree for each component."""


def components(vertices: Iterable[int], edges: Iterable[Edge]) -> tuple[tuple[int, ...], ...]:
    """The connected components, each ascending, in the order of their lowest vertices."""
    parent = {vertex: vertex for vertex in vertices}
    for first, second in edges:
        _join(parent, first, second)
    members: dict[int, list[int]] = {}
    for vertex in sorted(parent):
        members.setdefault(_root(parent, vertex), []).append(vertex)
    return tuple(sorted(map(tuple, members.values())))


def covering_forests(edges: Iterable[Edge]) -> tuple[Forest, ...]:
    """Few spanning forests of which each edge is in at least one.

    Every forest is a spanning forest of least weight, where an edge weighs the number of forests it is in already
    (Kruskal 1956): as many edges as possible are covered for the first time, and no edge is left out for ever.

    Args:
        edges: The graph's edges, each once.
    """
    uses = dict.fromkeys(sorted(edges), 0)
    forests: list[Forest] = []
    while 0 in uses.values():
        parent = {vertex: vertex for edge in uses for vertex in edge}
        chosen = [edge for edge in sorted(uses, key=lambda edge: (uses[edge], edge)) if _join(parent, *edge)]
        forests.append(frozenset(chosen))
        for edge in chosen:
            uses[edge] += 1
    return tuple(forests)


def edge_probabilities(forests: Sequence[Forest]) -> dict[Edge, float]:
    """Probability of each edge to be in a forest drawn uniformly among these."""
    count: dict[Edge, int] = {}
    for forest in forests:
        for edge in forest:
            count[edge] = count.get(edge, 0) + 1
    return {edge: uses / len(forests) for edge, uses in count.items()}


def neighbours_in(forest: Forest) -> Mapping[int, tuple[int, ...]]:
    """For each vertex of a forest its neighbours there, ascending."""
    found: dict[int, list[int]] = {}
    for first, second in sorted(forest):
        found.setdefault(first, []).append(second)
        found.setdefault(second, []).append(first)
    return {vertex: tuple(sorted(others)) for vertex, others in found.items()}


def diameter(forest: Forest) -> int:
    """Edges of the longest path in any tree of the forest."""
    near = neighbours_in(forest)
    longest = 0
    for tree in components(near, forest):
        end, _ = _farthest(near, tree[0])
        longest = max(longest, _farthest(near, end)[1])
    return longest


def _farthest(near: Mapping[int, Sequence[int]], start: int) -> Edge:
    """A vertex farthest from `start` within its tree, and how far that is."""
    steps = {start: 0}
    queue = [start]
    for vertex in queue:
        for other in near[vertex]:
            if other not in steps:
                steps[other] = steps[vertex] + 1
                queue.append(other)
    return queue[-1], steps[queue[-1]]


def _root(parent: dict[int, int], vertex: int) -> int:
    while parent[vertex] != vertex:
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


def _join(parent: dict[int, int], first: int, second: int) -> bool:
    """Unite the sets of two vertices; False if they are in one already."""
    one, other = _root(parent, first), _root(parent, second)
    parent[max(one, other)] = min(one, other)
    return one != other
