"""Bounds on association probabilities from a part of the graph, and how narrow they can still become.

Bounds that hold whatever edges are missing follow from the recursion of Oh 2010, eq 13, taken for both ends of an interval:

    upper(u, t) = 1 / (1 + sum_v w_uv lower(v, t - 1)),   lower(u, t) = 1 / (1 + sum_v w_uv upper(v, t - 1)),

with upper(., 0) = 1 and lower(., 0) = 0; and lower(u, .) = 0 where u may have edges that are not known, as every further
edge makes Phi smaller and nothing bounds their number. Where everything is known these are Phi at the last even and odd
depths.
"""

from collections.abc import Iterable

from netsim.kernels.correlation_decay import DecayGraph, mask

Two = tuple[float, float]


class TwoEnds:
    """Two recursions that use each other.

        first(u, t) = 1 / (1 + sum_v w_uv second(v, t - 1)), 0 for some u;   first(., 0) = 0
        second(u, t) = 1 / (1 + sum_v w_uv first(v, t - 1)), 0 for some u;   second(., 0) = 1

    What was computed once is kept, as in `DecayGraph`.

    Args:
        graph: The graph.
        first_zero: Vertices with first(u, .) = 0.
        second_zero: Vertices with second(u, .) = 0.
    """

    def __init__(self, graph: DecayGraph, first_zero: Iterable[int], second_zero: Iterable[int]) -> None:
        self._graph = graph
        self._first_zero, self._second_zero = frozenset(first_zero), frozenset(second_zero)
        self._known: dict[tuple[int, int, int], Two] = {}
        self.operations = 0
        """See `DecayInterval.operations`."""

    def factor(self, vertex: int, depth: int, removed: int = 0) -> Two:
        """First and second of a vertex that is not in `removed` (bits, see `correlation_decay.mask`)."""
        if depth == 0:
            return 0.0, 1.0
        depth = min(depth, self._graph.exact_depth + 1)  # no deeper path, and both ends are the truth
        key = vertex, depth, removed & self._graph.ball(vertex, depth)
        if key not in self._known:
            self._known[key] = self._computed(vertex, depth, removed)
        return self._known[key]

    def _computed(self, vertex: int, depth: int, removed: int) -> Two:
        first_total = second_total = 1.0
        without = removed | 1 << vertex
        self.operations += 4
        for other, weight in self._graph.edges(vertex):
            if not without >> other & 1:
                first, second = self.factor(other, depth - 1, without)
                first_total += weight * first
                second_total += weight * second
                self.operations += 6
        first = 0.0 if vertex in self._first_zero else 1.0 / second_total
        return first, 0.0 if vertex in self._second_zero else 1.0 / first_total

    def pair(self, measurement: int, event: int, depth: int) -> tuple[Two, Two]:
        """First and second of a pair, with the measurement as u and with the event.

        beta_uv = w_uv P(v) / (1 + sum_v' w_uv' P(v')), P(v) = P_{G without u}(v is in no pair), with first for P(v) and
        second for the others, and the other way round.
        """
        ends = measurement, self._graph.event(event)
        return self._from_end(*ends, depth), self._from_end(*ends[::-1], depth)

    def _from_end(self, u: int, v: int, depth: int) -> Two:
        removed = mask((u,))
        own_first = own_second = others_first = others_second = 0.0
        self.operations += 10
        for other, weight in self._graph.edges(u):
            first, second = self.factor(other, depth, removed)
            self.operations += 6
            if other == v:
                own_first, own_second = weight * first, weight * second
            else:
                others_first, others_second = others_first + weight * first, others_second + weight * second
        found_first = 0.0 if u in self._first_zero else own_first / (1.0 + own_first + others_second)
        return found_first, 0.0 if u in self._second_zero else own_second / (1.0 + own_second + others_first)


class DecayInterval:
    """Bounds on association probabilities that hold whatever the missing edges are.

    Args:
        graph: What is known.
        incomplete: Vertices that may have edges which are not in it.
    """

    def __init__(self, graph: DecayGraph, incomplete: Iterable[int] = ()) -> None:
        self._ends = TwoEnds(graph, incomplete, ())

    @property
    def operations(self) -> int:
        """Elementary operations so far.

        Six for every term of a sum that was not known yet, four for every sum; the last sums of a pair are never kept: six
        for every term, and 22 for the rest of both.
        """
        return self._ends.operations

    def factor(self, vertex: int, depth: int, removed: int = 0) -> Two:
        """Lower and upper bound of P_{G without removed}(the vertex is in no pair).

        Args:
            vertex: Not in `removed`.
            depth: t, at least 0.
            removed: Missing vertices, as bits (see `correlation_decay.mask`).
        """
        return self._ends.factor(vertex, depth, removed)

    def pair(self, measurement: int, event: int, depth: int) -> Two:
        """Bounds of the pair's probability, from either end; the better ones count.

        beta_uv rises with P(v) and falls with all the others (see `TwoEnds.pair`). The bounds are never wider than the
        two-factor form w_uv Phi_G(u, t + 1) Phi_{G without u}(v, t), in which P(v) appears twice.

        Args:
            measurement: Row of the weights.
            event: Column of the weights.
            depth: t of the factors.
        """
        (low, high), (other_low, other_high) = self._ends.pair(measurement, event, depth)
        self._ends.operations += 2
        return max(low, other_low), min(high, other_high)


class LeastWidth:
    """How narrow the interval of a pair can become at best when some of the missing edges become known, and others do not.

    Of the interval at the end, on a graph with all that is known now and more, the lower ends are at most `second` and the
    upper ends at least `first` of

        first(u) = 1 / (1 + sum_v w_uv second(v)), 0 where edges of u may yet become known,
        second(u) = 1 / (1 + sum_v w_uv first(v)), 0 where edges of u will stay unknown:

    by induction over the depth, since known edges stay. No answer and no depth makes an interval narrower than the
    difference of what follows from these for the pair.

    Args:
        graph: What is known.
        pending: Vertices of which more edges may become known.
        closed: Vertices of which some edges never will, so that their lower end stays 0.
    """

    def __init__(self, graph: DecayGraph, pending: Iterable[int], closed: Iterable[int]) -> None:
        self._ends = TwoEnds(graph, pending, closed)

    @property
    def operations(self) -> int:
        """Elementary operations so far, counted as in `DecayInterval`."""
        return self._ends.operations

    def pair(self, measurement: int, event: int, depth: int) -> float:
        """Least width of the pair's interval; 0 where nothing is certain about it.

        Args:
            measurement: Row of the weights.
            event: Column of the weights.
            depth: Levels of the recursion; deeper ones find more.
        """
        (upper, lower), (other_upper, other_lower) = self._ends.pair(measurement, event, depth)
        self._ends.operations += 3
        return max(0.0, min(upper, other_upper) - max(lower, other_lower))
