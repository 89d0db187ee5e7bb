"""A hosted vertex in distributed tree-reweighted max-product: first its part in growing trees, then in inference."""

from collections.abc import Callable

from netsim.algorithms.trmp_inference import Plan, TreeReweighted
from netsim.algorithms.trmp_messages import Abandon, Claim, Entry, Go, Heard, Next, Wave
from netsim.algorithms.trmp_trees import TreeBuilder
from netsim.kernels.vertex import ReweightableVertex


class HostedVertex:
    """One hosted vertex: it grows trees first, then infers; what comes early waits.

    Args:
        vertex: The vertex.
        plan: From the trees' longest paths to what inference goes by.
    """

    def __init__(self, vertex: ReweightableVertex, plan: Callable[[tuple[int, ...]], Plan]) -> None:
        self.vertex = vertex
        self.builder = TreeBuilder(vertex.id, vertex.neighbours)
        self.inference: TreeReweighted | None = None
        self.is_abandoned = False
        self._plan = plan
        self._early: list[Entry] = []

    def start(self) -> list[Entry]:
        """Begin; an isolated vertex is done at once."""
        return self._onward(self.builder.start())

    def take(self, entry: Entry) -> list[Entry]:
        """Answer a message of a neighbour."""
        body = entry.body
        if self.is_abandoned or isinstance(body, Claim | Heard):
            return []  # the latter are between a host and a sensor, not between vertices
        if isinstance(body, Abandon):
            return self.abandon()
        if isinstance(body, Wave | Next | Go):
            return self._onward(self.builder.take(entry.source, body))
        if self.inference is None:
            self._early.append(entry)
            return []
        return self.inference.take(entry.source, body)

    def abandon(self) -> list[Entry]:
        """Give up, and let all neighbours know; nothing where the last verdict has come already, which stays true."""
        if self.is_finished:
            return []
        self.is_abandoned = True
        return [Entry(self.vertex.id, other, Abandon()) for other in self.vertex.neighbours]

    def _onward(self, entries: list[Entry]) -> list[Entry]:
        """Begin inference as soon as all trees stand."""
        diameters = self.builder.diameters
        if self.inference is not None or diameters is None:
            return entries
        self.inference = TreeReweighted(self.vertex, self.builder.places, self._plan(diameters))
        entries = entries + self.inference.begin()
        early, self._early = self._early, []
        for entry in early:
            entries += self.take(entry)
        return entries

    @property
    def is_finished(self) -> bool:
        """Whether nothing is left to be done: the last verdict is known, or it gave up."""
        return self.is_abandoned or (self.inference is not None and self.inference.verdict is not None)

    def spent(self) -> int:
        """Operations since this was asked last."""
        if self.inference is None:
            return 0
        spent, self.inference.operations = self.inference.operations, 0
        return spent
