"""Spanning trees grown in the network, until every edge of the graphical model is in one.

The first tree elects its root: every vertex starts a wave under its own number, a lower one extinguishes a higher one, and
only the lowest comes back whole (the echo algorithm with extinction: Chang 1982; Tel, Introduction to Distributed
Algorithms, 2000, section 7.3). A vertex's parent is who first told it. The answers that run back together tell the root how
many edges no tree has yet and which vertex has most of them: there the next tree begins. Its wave passes such edges first
and the others only after a pause, so that each tree covers what is left.
"""

from dataclasses import dataclass, field

from netsim.algorithms.trmp_messages import Body, Echo, Entry, Go, Next, Wave


@dataclass(frozen=True, slots=True)
class Place:
    """A vertex's place in a tree: its parent there, None at the root, and its children, ascending."""

    parent: int | None
    children: tuple[int, ...]

    @property
    def neighbours(self) -> tuple[int, ...]:
        """Parent and children, ascending."""
        return tuple(sorted((*self.children, *(() if self.parent is None else (self.parent,)))))


@dataclass(slots=True)
class _Growing:
    """One wave as a vertex sees it: who started it, who told first, who has spoken, what the children said."""

    initiator: int
    parent: int | None
    heard: set[int] = field(default_factory=set)
    echoes: dict[int, Echo] = field(default_factory=dict)


class TreeBuilder:
    """One vertex's part in growing the trees.

    Args:
        vertex: Its number.
        neighbours: Its neighbours in the model.
    """

    def __init__(self, vertex: int, neighbours: tuple[int, ...]) -> None:
        self._vertex = vertex
        self._neighbours = neighbours
        self._waves: dict[int, _Growing] = {}
        self._places: dict[int, Place] = {}
        self._begun: set[int] = set()
        self._known_diameters: tuple[int, ...] = ()
        self.diameters: tuple[int, ...] | None = None
        self.component_size = 1

    @property
    def places(self) -> tuple[Place, ...]:
        """The vertex's place in each tree."""
        return tuple(self._places[tree] for tree in sorted(self._places))

    @property
    def is_done(self) -> bool:
        """Whether all trees stand and inference may begin."""
        return self.diameters is not None

    def start(self) -> list[Entry]:
        """Begin the first tree."""
        return self._initiate(0)

    def take(self, source: int, body: Body) -> list[Entry]:
        """Answer a message of a neighbour."""
        match body:
            case Wave():
                return self._on_wave(source, body)
            case Next(root, diameters):
                tree = len(diameters)
                if tree in self._begun:
                    return []  # a copy
                self._begun.add(tree)
                entries = self._down(tree - 1, body)
                return entries + (self._initiate(tree, diameters) if root == self._vertex else [])
            case Go(diameters):
                if self.is_done:
                    return []
                self.diameters = diameters
                return self._down(len(diameters) - 1, body)
        return []

    def _initiate(self, tree: int, diameters: tuple[int, ...] = ()) -> list[Entry]:
        self._known_diameters = diameters
        self._waves[tree] = _Growing(self._vertex, None)
        return self._spread(tree) + self._complete(tree)

    def _on_wave(self, source: int, wave: Wave) -> list[Entry]:
        growing = self._waves.get(wave.tree)
        entries: list[Entry] = []
        if growing is None or (wave.tree == 0 and wave.initiator < growing.initiator):
            growing = self._waves[wave.tree] = _Growing(wave.initiator, source)
            entries = self._spread(wave.tree)
        elif wave.initiator != growing.initiator or source in growing.heard:
            return []  # extinguished, or a copy
        growing.heard.add(source)
        if wave.echo is not None:
            growing.echoes[source] = wave.echo
        return entries + self._complete(wave.tree)

    def _spread(self, tree: int) -> list[Entry]:
        """Tell all neighbours but the one who told; those behind an edge that has a tree already a little later."""
        growing = self._waves[tree]
        wave = Wave(tree, growing.initiator, None)
        covered = self._covered(tree)
        return [Entry(self._vertex, o, wave, o in covered) for o in self._neighbours if o != growing.parent]

    def _covered(self, before: int) -> set[int]:
        """Neighbours behind edges of the trees before this one."""
        return {other for tree, place in self._places.items() if tree < before for other in place.neighbours}

    def _complete(self, tree: int) -> list[Entry]:
        """Once all neighbours have spoken: answer the parent, or at the root decide what comes next."""
        growing = self._waves[tree]
        if len(growing.heard) < len(self._neighbours):
            return []
        self._places[tree] = Place(growing.parent, tuple(sorted(growing.echoes)))
        echo = self._summed(tree, growing)
        if growing.parent is not None:
            return [Entry(self._vertex, growing.parent, Wave(tree, growing.initiator, echo))]
        return self._decide(tree, echo)

    def _summed(self, tree: int, growing: _Growing) -> Echo:
        open_here = len(self._neighbours) - len(self._covered(tree + 1))
        echoes = list(growing.echoes.values())
        best = min([(-open_here, self._vertex), *((-echo.most_uncovered, echo.next_root) for echo in echoes)])
        heights = sorted((echo.height + 1 for echo in echoes), reverse=True)
        return Echo(
            vertices=1 + sum(echo.vertices for echo in echoes),
            uncovered=open_here + sum(echo.uncovered for echo in echoes),
            most_uncovered=-best[0],
            next_root=best[1],
            height=max(heights, default=0),
            longest=max([sum(heights[:2]), *(echo.longest for echo in echoes)]),
        )

    def _decide(self, tree: int, echo: Echo) -> list[Entry]:
        diameters = (*self._known_diameters, echo.longest)
        self.component_size = echo.vertices
        if echo.uncovered:
            return self.take(self._vertex, Next(echo.next_root, diameters))
        return self.take(self._vertex, Go(diameters))

    def _down(self, tree: int, body: Body) -> list[Entry]:
        return [Entry(self._vertex, child, body) for child in self._places[tree].children]
