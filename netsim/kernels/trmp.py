"""Tree-reweighted max-product in one place: the reference that a distributed run must equal.

Chen, Wainwright, Cetin, Willsky 2006, section 2.3; Wainwright, Jaakkola, Willsky, IEEE Trans. Information Theory 51 (2005).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from netsim.kernels.reparameterization import Reparameterized
from netsim.kernels.semiring import FloatArray
from netsim.kernels.spanning_trees import (
    Forest,
    components,
    covering_forests,
    diameter,
    edge_probabilities,
    neighbours_in,
)
from netsim.kernels.vertex import Choice, ReweightableVertex

TreeSchedule = Literal["two_pass", "flooding"]
"""How max-product runs on a tree: from the leaves inward and back out, one message a directed edge; or in parallel
rounds, as many as the longest path has edges."""

MARGIN = 1e-9
"""Least margin of a best state that counts as the only one."""

Received = dict[int, FloatArray]


@dataclass(frozen=True, slots=True)
class ComponentResult:
    """Outcome for one connected component of the model.

    Attributes:
        vertices: Its vertices, ascending.
        proved: Whether all trees agree on the only best state of every vertex: then it is the MAP state.
        iterations: Iterations done; the last one agreed if `proved`.
        messages: Max-product messages passed on trees.
        states: The decided state of each vertex; where not proved, the best one by the averaged max-marginals.
    """

    vertices: tuple[int, ...]
    proved: bool
    iterations: int
    messages: int
    states: Mapping[int, tuple[int, ...]]


def run_trmp(
    vertices: Iterable[ReweightableVertex],
    *,
    forests: Sequence[Forest] | None = None,
    damping: float = 0.5,
    iterations: int = 100,
    schedule: TreeSchedule = "two_pass",
) -> tuple[ComponentResult, ...]:
    """Run it on every component until its trees agree.

    Args:
        vertices: All vertices of the model.
        forests: Spanning forests that cover every edge, equally probable; found by `covering_forests` if None.
        damping: See `Reparameterized.update`.
        iterations: Most iterations.
        schedule: How messages are passed on each tree.

    Returns:
        One result a component, in the order of their lowest vertices.
    """
    by_id = {vertex.id: vertex for vertex in vertices}
    edges = sorted({(v.id, other) for v in by_id.values() for other in v.neighbours if v.id < other})
    found = []
    for members in components(by_id, edges):
        inside = [edge for edge in edges if edge[0] in members]
        trees = covering_forests(inside) if forests is None else _within(forests, set(members))
        run = _Component({member: by_id[member] for member in members}, trees, schedule)
        found.append(run.solve(damping, iterations))
    return tuple(found)


def _within(forests: Sequence[Forest], members: set[int]) -> tuple[Forest, ...]:
    kept = (frozenset(edge for edge in forest if edge[0] in members) for forest in forests)
    return tuple(forest for forest in kept if forest)


class _Component:
    """One connected component with its spanning trees."""

    def __init__(
        self, vertices: Mapping[int, ReweightableVertex], trees: Sequence[Forest], schedule: TreeSchedule
    ) -> None:
        probability = edge_probabilities(trees)
        share = [1.0 / len(trees) for _ in trees]
        self._near = [neighbours_in(tree) for tree in trees]
        self._rounds = [diameter(tree) for tree in trees] if schedule == "flooding" else None
        self._messages = 0
        self._members = {
            vertex.id: Reparameterized(
                vertex,
                {other: probability[min(vertex.id, other), max(vertex.id, other)] for other in vertex.neighbours},
                share,
            )
            for vertex in vertices.values()
        }

    def solve(self, damping: float, iterations: int) -> ComponentResult:
        agreed: dict[int, Choice] | None = None
        done = 0
        most = iterations if self._near else 1  # without edges, nothing would change
        while agreed is None and done < most:
            done += 1
            received = [self._on_tree(tree) for tree in range(len(self._near))]
            agreed = self._agreed(received)
            if agreed is None:
                for vertex, member in self._members.items():
                    member.update([tree[vertex] for tree in received], damping)
        choices = agreed or {v: member.vertex.choice(member.weights) for v, member in self._members.items()}
        states = {vertex: choice.state for vertex, choice in choices.items()}
        return ComponentResult(tuple(self._members), agreed is not None, done, self._messages, states)

    def _agreed(self, received: Sequence[Mapping[int, Received]]) -> dict[int, Choice] | None:
        """The state of every vertex, if all trees have the same only best one."""
        agreed = {}
        for vertex, member in self._members.items():
            choices = [member.choice(tree[vertex]) for tree in received] or [member.choice({})]
            if not agree(choices, MARGIN):
                return None
            agreed[vertex] = choices[0]
        return agreed

    def _on_tree(self, tree: int) -> dict[int, Received]:
        """Messages received by every vertex once max-product has converged on a tree."""
        received: dict[int, Received] = {vertex: {} for vertex in self._members}
        if self._rounds is None:
            for source, destination in two_pass_order(self._near[tree]):
                self._pass(received, received[source], source, destination)
            return received
        for _ in range(self._rounds[tree]):
            before = {vertex: dict(messages) for vertex, messages in received.items()}
            for source, others in self._near[tree].items():
                for destination in others:
                    self._pass(received, before[source], source, destination)
        return received

    def _pass(self, received: dict[int, Received], known: Received, source: int, destination: int) -> None:
        sent = self._members[source].message(destination, known)
        received[destination][source] = self._members[destination].arrived(source, sent)
        self._messages += 1


def agree(choices: Sequence[Choice], margin: float) -> bool:
    """Whether the choices of a vertex on all trees are one and the same, and each the only best state."""
    return all(choice.margin > margin and choice.state == choices[0].state for choice in choices)


def two_pass_order(near: Mapping[int, Sequence[int]]) -> list[tuple[int, int]]:
    """Directed edges of a tree in an order in which each message has all it needs: inward first, then outward."""
    if not near:
        return []
    start = min(near)
    outward: list[tuple[int, int]] = []
    reached, queue = {start}, [start]
    for vertex in queue:
        for other in near[vertex]:
            if other not in reached:
                reached.add(other)
                queue.append(other)
                outward.append((vertex, other))
    return [(other, vertex) for vertex, other in reversed(outward)] + outward
