r"""Tree-reweighted max-product at one vertex (Chen et al. 2006, section 2.3; Wainwright, Jaakkola, Willsky 2005).

Steps 1 and 3 of the algorithm rewrite the compatibilities: in logarithms, with messages $M^T$ of each tree $T$,
$\psi_s \leftarrow \psi_s + \sum_T \mu(T) \sum_{t \in N_T(s)} M^T_{ts}$ and
$\psi_{st} \leftarrow \psi_{st} - \sum_{T \ni st} \mu(T) (M^T_{ts} + M^T_{st})$.
So what a run adds to node potentials and takes from edge potentials is one vector $\theta_{ts}$ for each directed edge, over
what t sees of $x_s$: no potential is ever tabulated. Vertex s keeps $\theta_{ts}$ and nobody else needs it: towards t the
sender s takes its share of the edge potential off before sending, the receiver t takes off its own on arrival. Whatever
values the vectors have, rounded ones too, the product of all potentials stays the same.

Damping $\delta$ adds only that share of the sums: the geometric mean of old and new potentials for 1/2.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.kernels.vertex import Choice, ReweightableVertex

TreeMessages = Mapping[int, FloatArray]
"""On one tree, the message M_ts received from each neighbour there."""


class Reparameterized:
    """A vertex with its share of the rewritten potentials.

    Args:
        vertex: The vertex with the original potentials.
        edge_probability: For each of its neighbours, the probability mu_st that their edge is in a tree.
        tree_probability: Probability mu(T) of each tree.
    """

    def __init__(
        self, vertex: ReweightableVertex, edge_probability: Mapping[int, float], tree_probability: Sequence[float]
    ) -> None:
        self.vertex = vertex
        self._edge = dict(edge_probability)
        self._tree = tuple(tree_probability)
        self._theta = {other: np.zeros(vertex.incoming_size(other)) for other in vertex.neighbours}
        self._possible = {other: np.zeros(vertex.incoming_size(other)) for other in vertex.neighbours}

    @property
    def weights(self) -> dict[int, FloatArray]:
        """What is added to the original node potential, by neighbour; -inf for states found impossible."""
        return {other: theta + self._possible[other] for other, theta in self._theta.items()}

    def message(self, neighbour: int, received: TreeMessages) -> FloatArray:
        """The sender's part of the message to a neighbour on a tree: log domain, normalised.

        Args:
            neighbour: Who it is for.
            received: Messages of the vertex's other neighbours on that tree; the receiver's own is left aside.
        """
        weights = self._with({other: row for other, row in received.items() if other != neighbour})
        power = 1.0 / self._edge[neighbour]
        weights[neighbour] = weights[neighbour] - power * self._theta[neighbour]
        return self.vertex.reweighted(neighbour, weights, power)

    def arrived(self, neighbour: int, sent: FloatArray) -> FloatArray:
        """The message M_ts that a received vector stands for: the receiver's share of the edge potential taken off."""
        return sent - self._theta[neighbour] / self._edge[neighbour]

    def choice(self, received: TreeMessages) -> Choice:
        """The best state by the vertex's max-marginal on a tree."""
        return self.vertex.choice(self._with(received))

    def _with(self, received: TreeMessages) -> dict[int, FloatArray]:
        weights = self.weights
        for other, row in received.items():
            weights[other] = weights[other] + row
        return weights

    def update(self, received: Sequence[TreeMessages], damping: float) -> None:
        """Step 3: rewrite the potentials by the messages of all trees.

        A state that a message rules out is impossible in the whole problem. It is ruled out for good, and its entry kept
        out of the sums: minus infinity could not be taken off the edge potential again.

        Args:
            received: For each tree the messages of the neighbours on it.
            damping: Share of the step taken, in (0, 1]; 1 is the step as printed.
        """
        for probability, messages in zip(self._tree, received, strict=True):
            for other, message in messages.items():
                out = np.isneginf(message)
                self._possible[other][out] = -np.inf
                self._theta[other] = self._theta[other] + damping * probability * np.where(out, 0.0, message)
        for other, theta in self._theta.items():
            self._theta[other] = theta - theta.max()
