"""Joint associations one by one, and what follows from their weights: sums for graphs of a few pairs."""

import numpy as np
from hypothesis import strategies as st


def matchings(weights):
    """Every set of pairs (measurement, event) that share no end, with its weight."""
    w = np.asarray(weights, float)

    def of_rows(first, taken):
        if first == len(w):
            yield (), 1.0
            return
        for pairs, weight in of_rows(first + 1, taken):
            yield pairs, weight
        for k in np.flatnonzero(w[first]).tolist():
            if k not in taken:
                for pairs, weight in of_rows(first + 1, taken | {k}):
                    yield ((first, k), *pairs), w[first, k] * weight

    yield from of_rows(0, frozenset())


def partition(weights):
    """Z, eq 9."""
    return sum(weight for _, weight in matchings(weights))


def probabilities(weights):
    """beta, eq 2, shape (N, K)."""
    found = np.zeros(np.shape(weights))
    for pairs, weight in matchings(weights):
        for pair in pairs:
            found[pair] += weight
    return found / partition(weights)


def without(weights, *vertices):
    """Without vertices: measurements 0 to N - 1, events N to N + K - 1."""
    found = np.array(weights, float)
    for vertex in vertices:
        if vertex < len(found):
            found[vertex] = 0.0
        else:
            found[:, vertex - len(found)] = 0.0
    return found


def random_weights(seed, measurements, events, share=0.6, spread=1.5):
    """Log-normal weights on a random share of the pairs."""
    rng = np.random.default_rng(seed)
    drawn = np.exp(spread * rng.standard_normal((measurements, events)))
    return np.where(rng.random((measurements, events)) < share, drawn, 0.0)


def random_tree(seed, measurements, events):
    """Weights whose edges are a spanning tree, of at least one measurement and event."""
    rng = np.random.default_rng(seed)
    found = np.zeros((measurements, events))
    joined, left = ([0], [0]), [(0, j) for j in range(1, measurements)] + [(1, k) for k in range(1, events)]
    found[0, 0] = np.exp(rng.standard_normal())
    for number in rng.permutation(len(left)):
        side, vertex = left[number]
        other = rng.choice(joined[1 - side])
        found[(vertex, other) if side == 0 else (other, vertex)] = np.exp(1.5 * rng.standard_normal())
        joined[side].append(vertex)
    return found


GRAPHS = st.builds(
    random_weights, st.integers(0, 2**32 - 1), st.integers(0, 5), st.integers(0, 4), st.sampled_from([0.3, 0.6, 1.0])
)
TREES = st.builds(random_tree, st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(1, 5))
