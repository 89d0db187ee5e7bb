"""One vertex's part in tree-reweighted max-product: messages on all trees, a vote, and the next iteration or the end.

Chen, Wainwright, Cetin, Willsky 2006, section 2.3, steps 1 to 3. The vote runs up the first tree, every vertex adding its
own to its children's; the root's verdict runs back down.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from netsim.algorithms.trmp_messages import Entry, TreeMessage, Verdict, Vote
from netsim.algorithms.trmp_trees import Place
from netsim.kernels.reparameterization import Reparameterized
from netsim.kernels.semiring import FloatArray
from netsim.kernels.trmp import agree
from netsim.kernels.vertex import Choice, ReweightableVertex

Numbered = tuple[int, int]
"""A tree and a round on it, 0 with the two-pass schedule."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What all vertices of a component know when inference begins.

    Attributes:
        rounds: For each tree the rounds of flooding that it takes; None for the two-pass schedule.
        damping: Share of each step taken.
        iterations: Most iterations.
        margin: Least margin of a best state that counts as the only one.
    """

    rounds: tuple[int, ...] | None
    damping: float
    iterations: int
    margin: float


class TreeReweighted:
    """The vertex once all trees stand.

    Args:
        vertex: The vertex with its potentials.
        places: Its place in each tree.
        plan: What is common to all.
    """

    def __init__(self, vertex: ReweightableVertex, places: Sequence[Place], plan: Plan) -> None:
        self._id = vertex.id
        self._place = places[0]
        self._near = [place.neighbours for place in places]
        self._plan = plan
        uses = {other: sum(other in near for near in self._near) for other in vertex.neighbours}
        edge = {other: count / len(places) for other, count in uses.items()}
        self._member = Reparameterized(vertex, edge, [1.0 / len(places) for _ in places])
        self._cost = vertex.operations() // max(1, len(vertex.neighbours))
        self._early: dict[int, list[tuple[int, TreeMessage]]] = {}
        self._votes: dict[int, dict[int, bool]] = {}
        self._received: dict[Numbered, dict[int, FloatArray]] = {}
        self._sent: set[tuple[int, int, int]] = set()
        self._mine: bool | None = None
        self._has_voted = False
        self._goes_on = False
        self._choices: list[Choice] = []
        self.iteration = 0
        self.verdict: Verdict | None = None
        self.operations = 0

    @property
    def is_root(self) -> bool:
        """Whether this vertex gives the verdicts."""
        return self._place.parent is None

    @property
    def choice(self) -> Choice:
        """The vertex's state: the agreed one if proved, else the best by the averaged max-marginals."""
        if self.verdict is not None and self.verdict.proved:
            return self._choices[0]
        return self._member.choice({})

    @property
    def weights(self) -> Mapping[int, FloatArray]:
        """What is added to the vertex's node potential, by neighbour: all that the others have told."""
        return self._member.weights

    def begin(self) -> list[Entry]:
        """Begin the first iteration."""
        return self._on(self._begin())

    def _on(self, entries: list[Entry]) -> list[Entry]:
        """Begin as many iterations as can be begun: what has come early may complete one after the other."""
        while self._goes_on:
            self._goes_on = False
            entries += self._begin()
        return entries

    def _begin(self) -> list[Entry]:
        """Begin the next iteration with what has come for it already."""
        self.iteration += 1
        self._received, self._sent = {}, set()
        self._mine, self._has_voted = None, False
        for source, message in self._early.pop(self.iteration, []):
            self._store(source, message)
        return self._go_on()

    def take(self, source: int, body: TreeMessage | Vote | Verdict) -> list[Entry]:
        """Answer a message of a neighbour."""
        return self._on(self._taken(source, body))

    def _taken(self, source: int, body: TreeMessage | Vote | Verdict) -> list[Entry]:
        match body:
            case TreeMessage(iteration) if iteration > self.iteration:
                self._early.setdefault(iteration, []).append((source, body))
            case TreeMessage(iteration) if iteration == self.iteration and self.verdict is None:
                self._store(source, body)
                return self._go_on()
            case Vote(iteration, agrees):
                self._votes.setdefault(iteration, {})[source] = agrees
                return self._vote()
            case Verdict():
                return self._judged(body)
        return []

    def _store(self, source: int, message: TreeMessage) -> None:
        known = self._received.setdefault((message.tree, message.round), {})
        if source not in known:
            known[source] = self._member.arrived(source, message.log_message)

    def _go_on(self) -> list[Entry]:
        """Send whatever has what it needs; vote once everything has come."""
        entries: list[Entry] = []
        for tree, near in enumerate(self._near):
            entries += self._two_pass(tree, near) if self._plan.rounds is None else self._flooding(tree, near)
        if self._mine is None and all(len(self._last(tree)) == len(near) for tree, near in enumerate(self._near)):
            self._choices = [self._member.choice(self._last(tree)) for tree in range(len(self._near))]
            self.operations += self._cost * len(self._near)
            self._mine = agree(self._choices, self._plan.margin)
            entries += self._vote()
        return entries

    def _last(self, tree: int) -> dict[int, FloatArray]:
        """What has come on a tree in its last round."""
        return self._received.get((tree, 0 if self._plan.rounds is None else self._plan.rounds[tree]), {})

    def _two_pass(self, tree: int, near: Sequence[int]) -> list[Entry]:
        known = self._received.get((tree, 0), {})
        ready = [other for other in near if all(u in known for u in near if u != other)]
        return [self._message(tree, 0, other, known) for other in ready if (tree, 0, other) not in self._sent]

    def _flooding(self, tree: int, near: Sequence[int]) -> list[Entry]:
        entries = []
        for number in range(1, (self._plan.rounds or ())[tree] + 1):
            known = self._received.get((tree, number - 1), {})
            if number > 1 and len(known) < len(near):
                break
            due = [other for other in near if (tree, number, other) not in self._sent]
            entries += [self._message(tree, number, other, known) for other in due]
        return entries

    def _message(self, tree: int, number: int, other: int, known: Mapping[int, FloatArray]) -> Entry:
        self._sent.add((tree, number, other))
        self.operations += self._cost
        message = self._member.message(other, known)
        return Entry(self._id, other, TreeMessage(self.iteration, tree, number, message))

    def _vote(self) -> list[Entry]:
        """Once the vertex and all its children have made up their minds: tell the parent, or judge."""
        votes = self._votes.get(self.iteration, {})
        if self._mine is None or self._has_voted or len(votes) < len(self._place.children):
            return []
        self._has_voted = True
        agrees = self._mine and all(votes.values())
        if self._place.parent is not None:
            return [Entry(self._id, self._place.parent, Vote(self.iteration, agrees))]
        is_last = self.iteration >= self._plan.iterations or not self._near[0]  # alone, nothing would change
        return self._judged(Verdict(self.iteration, agrees, agrees or is_last))

    def _judged(self, verdict: Verdict) -> list[Entry]:
        """Pass the verdict on; stop, or rewrite the potentials (step 3) and go on."""
        if verdict.iteration != self.iteration or self.verdict is not None:
            return []  # a copy
        entries = [Entry(self._id, child, verdict) for child in self._place.children]
        if not verdict.proved:
            self._member.update([self._last(tree) for tree in range(len(self._near))], self._plan.damping)
        if verdict.stop:
            self.verdict = verdict
        self._goes_on = not verdict.stop
        return entries
