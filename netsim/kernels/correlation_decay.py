"""Association probabilities by correlation decay: how much a factor depends on what lies far away falls with distance.

Oh 2010 (A Distributed Deterministic Approximation Algorithm for Data Association), Algorithms 1 to 4. Phi_G(u, t)
approximates P_G(u is in no pair), the probability that a vertex stays alone, by t levels of the recursion

    Phi_G(u, t) = 1 / (1 + sum_{v in N(u)} w_uv Phi_{G without u}(v, t - 1)),   Phi(., 0) = 1                (eq 13)

with w_uv = alpha L_uv. It is exact on a tree at its depth, and anywhere from twice the smaller side. Even t are at or above
the truth, odd t at or below, and both approach it, so that two neighbouring depths give a certified interval.

Algorithm 1 walks along every path. Here what was computed once is kept: a factor depends only on what is left of the graph
within t steps of its vertex, and many paths leave the same.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from netsim.kernels.scaled_product import Product
from netsim.kernels.semiring import FloatArray

Removed = int
"""A set of vertices as the bits of a whole number."""
VertexOrder = Literal["measurements_first", "events_first", "few_neighbours_first", "many_neighbours_first"]
Side = Literal["event", "measurement"]
Estimator = Literal["literal", "two_factor", "normalised"]
_SMALL = 1e-150
"""A product that is smaller is scaled before it goes on, long before it could lose digits."""
PairFunction = Callable[[int, int], float]


@dataclass(frozen=True)
class Chain:
    """A product of factors over a growing set of removed vertices: what Algorithm 4 computes.

    prod_i Phi_{G without removed, v_1 .. v_{i-1}}(v_i, t), an estimate of Z(G without removed and v_1 .. v_n) /
    Z(G without removed) (Oh 2010, Lemma 1).

    Attributes:
        vertices: v_1 to v_n, none of them in `removed`.
        removed: What is missing from the graph beforehand.
    """

    vertices: tuple[int, ...]
    removed: frozenset[int] = frozenset()


class DecayGraph:
    """A data association graph, and the factors Phi computed on it so far.

    Vertices are numbered: measurements 0 to N - 1, events N to N + K - 1.

    Args:
        weights: alpha L_jk, shape (N, K); zero where a pair is not gated.
    """

    def __init__(self, weights: FloatArray) -> None:
        self.weights = np.asarray(weights, dtype=float)
        self.measurements = int(self.weights.shape[0])
        self.events = int(self.weights.shape[1])
        everything = range(self.measurements + self.events)
        self._edges = [tuple(self._edges_of(vertex)) for vertex in everything]
        self._balls = [[1 << vertex] for vertex in everything]
        self._known: dict[tuple[int, int, Removed], float] = {}
        self.operations = 0
        """Elementary operations so far.

        Three for every term of a sum that was not already known, two for every sum, one for every factor of a product. Those
        who compute with the graph add theirs.
        """

    @property
    def exact_depth(self) -> int:
        """No path is longer: measurements and events alternate on it, so that deeper factors are the same."""
        return 2 * min(self.measurements, self.events)

    def event(self, number: int) -> int:
        """The vertex of an event."""
        return self.measurements + number

    def neighbours(self, vertex: int) -> tuple[int, ...]:
        """Those a vertex has an edge with."""
        return tuple(other for other, _ in self._edges[vertex])

    def edges(self, vertex: int) -> tuple[tuple[int, float], ...]:
        """A vertex's neighbours, ascending, with the weights of the edges."""
        return self._edges[vertex]

    def factor(self, vertex: int, depth: int, removed: Iterable[int] = ()) -> float:
        """Phi_{G without removed}(vertex, depth) (Algorithm 1).

        Args:
            vertex: u, not in `removed`.
            depth: t, at least 0.
            removed: Vertices that are missing.
        """
        return self._factor(vertex, depth, mask(removed))

    def chain(self, chain: Chain, depth: int) -> Product:
        """The product of a chain's factors (Algorithm 4)."""
        product, exponent, removed = 1.0, 0, mask(chain.removed)
        for vertex in chain.vertices:
            product *= self._factor(vertex, depth, removed)
            removed |= 1 << vertex
            if product < _SMALL:
                product, shift = math.frexp(product)
                exponent += shift
        self.operations += len(chain.vertices)
        mantissa, shift = math.frexp(product)
        return Product(mantissa, exponent + shift)

    def _edges_of(self, vertex: int) -> list[tuple[int, float]]:
        rows = self.measurements
        line = self.weights[vertex] if vertex < rows else self.weights[:, vertex - rows]
        first = rows if vertex < rows else 0
        return [(first + int(other), float(line[other])) for other in np.flatnonzero(line)]

    def ball(self, vertex: int, depth: int) -> Removed:
        """Vertices within so many steps, itself included."""
        balls = self._balls[vertex]
        while len(balls) <= depth:
            grown = balls[-1]
            for other in members(balls[-1] & ~(balls[-2] if len(balls) > 1 else 0)):
                grown |= mask(self.neighbours(other))
            balls.append(grown)
        return balls[depth]

    def _factor(self, vertex: int, depth: int, removed: Removed) -> float:
        if depth == 0:
            return 1.0
        depth = min(depth, self.exact_depth)
        key = vertex, depth, removed & self.ball(vertex, depth)
        known = self._known.get(key)
        if known is None:
            known = self._known[key] = self._computed(vertex, depth, removed)
        return known

    def _computed(self, vertex: int, depth: int, removed: Removed) -> float:
        total, without = 1.0, removed | 1 << vertex
        self.operations += 2
        for other, weight in self._edges[vertex]:
            if not without >> other & 1:
                self.operations += 3
                total += weight * self._factor(other, depth - 1, without)
        return 1.0 / total


def mask(vertices: Iterable[int]) -> Removed:
    """A set of vertices as the bits of a whole number."""
    bits = 0
    for vertex in vertices:
        bits |= 1 << vertex
    return bits


def members(bits: Removed) -> Iterator[int]:
    """The vertices of a set, ascending."""
    while bits:
        lowest = bits & -bits
        yield lowest.bit_length() - 1
        bits ^= lowest


def vertex_order(graph: DecayGraph, order: VertexOrder) -> tuple[int, ...]:
    """The vertices of a graph in the order in which Algorithm 2 removes them. Ties go to the lower number.

    The paper leaves the order open. At infinite depth it makes no difference; before, the errors of the factors cancel in
    some orders and not in others.
    """
    vertices = range(graph.measurements + graph.events)
    if order == "measurements_first":
        return tuple(vertices)
    if order == "events_first":
        return tuple(vertices[graph.measurements :]) + tuple(vertices[: graph.measurements])
    sign = 1 if order == "few_neighbours_first" else -1
    return tuple(sorted(vertices, key=lambda vertex: sign * len(graph.neighbours(vertex))))


def literal_pair(graph: DecayGraph, measurement: int, event: int, depth: int, order: Sequence[int]) -> float:
    """Algorithm 2 for one pair: the ratio of two products over the same list of vertices (Oh 2010, eqs 10 and 11).

    The list need not be all vertices: whatever holds both ends of the pair leaves a ratio that is exact as t grows, since
    what is left of the graph behind both chains is the same. It can exceed one.

    Args:
        graph: The graph.
        measurement: Row of the weights.
        event: Column of the weights.
        depth: t.
        order: The list, with both ends of the pair in it.
    """
    with_pair, without_pair = literal_chains(graph, measurement, event, order)
    graph.operations += 2
    return literal_ratio(
        float(graph.weights[measurement, event]), graph.chain(with_pair, depth), graph.chain(without_pair, depth)
    )


def literal_chains(graph: DecayGraph, measurement: int, event: int, order: Sequence[int]) -> tuple[Chain, Chain]:
    """The two chains of a pair: over the list, and over the list without the pair in the graph without it."""
    pair = frozenset((measurement, graph.event(event)))
    return Chain(tuple(order)), Chain(tuple(vertex for vertex in order if vertex not in pair), pair)


def literal_ratio(weight: float, whole: Product, without_pair: Product) -> float:
    """Of eq 10: the chains' products are reciprocals of partition functions. At most the largest float."""
    return whole.over(without_pair, weight)


def literal(graph: DecayGraph, depth: int, order: Sequence[int]) -> FloatArray:
    """Algorithm 2: every pair's probability, shape (N, K); a depth of t and a list of all vertices."""
    return _each_pair(graph, lambda j, k: literal_pair(graph, j, k, depth, order))


def two_factor(graph: DecayGraph, depth: int, first: Side = "event") -> FloatArray:
    """Every pair's `two_factor_pair`, shape (N, K)."""
    return _each_pair(graph, lambda j, k: two_factor_pair(graph, j, k, depth, first))


def two_factor_pair(graph: DecayGraph, measurement: int, event: int, depth: int, first: Side = "event") -> float:
    """w_uv Phi_G(u, t) Phi_{G without u}(v, t): of the chains only the pair itself is left.

    Exact as t grows, since P(u and v are a pair) = w_uv Z(G without u, v) / Z(G). Even depths are at or above the truth and
    odd ones at or below, and both approach it.

    Args:
        graph: The graph.
        measurement: Row of the weights.
        event: Column of the weights.
        depth: t.
        first: Which end of the pair u is.
    """
    ends = measurement, graph.event(event)
    pair = Chain(ends if first == "measurement" else ends[::-1])
    graph.operations += 1
    return float(graph.weights[measurement, event]) * float(graph.chain(pair, depth))


def normalised(graph: DecayGraph, depth: int, side: Side = "event") -> FloatArray:
    """Every pair's `normalised_pair`, shape (N, K)."""
    return _each_pair(graph, lambda j, k: normalised_pair(graph, j, k, depth, side))


def normalised_pair(graph: DecayGraph, measurement: int, event: int, depth: int, side: Side = "event") -> float:
    """w_uv Phi_{G without u}(v, t) / (1 + sum_v' w_uv' Phi_{G without u}(v', t)): sums to one with u alone.

    Args:
        graph: The graph.
        measurement: Row of the weights.
        event: Column of the weights.
        depth: t of the factors.
        side: What u is: with `event` the columns sum to one with a missed detection, with `measurement` the rows with a
            false alarm.
    """
    ends = measurement, graph.event(event)
    u, v = ends if side == "measurement" else ends[::-1]
    terms = {other: weight * graph.factor(other, depth, (u,)) for other, weight in graph.edges(u)}
    graph.operations += 3 * len(terms) + 2
    return terms[v] / (1.0 + sum(terms.values()))


def certified_interval(graph: DecayGraph, depth: int) -> tuple[FloatArray, FloatArray]:
    """Bounds of every pair's probability from depths up to t, shape (N, K) each.

    Below: the two-factor form at the last odd depth; above: at the last even one. Either end of the pair may come first, and
    the better bound counts; none is above one.

    Args:
        graph: The graph.
        depth: t, at least 1.
    """
    odd, even = depth - 1 + depth % 2, depth - depth % 2
    below = np.maximum(two_factor(graph, odd), two_factor(graph, odd, "measurement"))
    above = np.minimum(two_factor(graph, even), two_factor(graph, even, "measurement"))
    return below, np.minimum(above, 1.0)


def _each_pair(graph: DecayGraph, pair: PairFunction) -> FloatArray:
    found = np.zeros(graph.weights.shape)
    for j, k in zip(*(numbers.tolist() for numbers in np.nonzero(graph.weights)), strict=True):
        found[j, k] = pair(j, k)
    return found
