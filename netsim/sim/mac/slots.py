"""Who sends in which slot: a colouring in which no two nodes within two hops of each other have the same slot."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import networkx as nx

from netsim.errors import ScenarioError


@dataclass(frozen=True, slots=True)
class SlotPlan:
    """The slots that concern one node. Slots are counted from time 0; they repeat after `frame_slots`.

    Attributes:
        own: Slot in which it sends, 0 to frame_slots - 1.
        frame_slots: Slots of a frame.
        heard: Slots in which a neighbour of it sends; its own is never among them.
    """

    own: int
    frame_slots: int
    heard: frozenset[int]

    def next_own(self, index: int) -> int:
        """The first own slot from slot `index` on."""
        return index + (self.own - index) % self.frame_slots

    def next_heard(self, index: int) -> int | None:
        """The first slot from `index` on in which a neighbour sends; None if there is no neighbour."""
        return min((index + (slot - index) % self.frame_slots for slot in self.heard), default=None)


def slot_plans(neighbours: Mapping[int, Collection[int]], frame_slots: int | None = None) -> dict[int, SlotPlan]:
    """Give every node a slot that nobody within two hops has, greedily, nodes with most conflicts first.

    Two senders one hop apart would deafen each other, two hops apart they would collide at the node between. The
    colouring is networkx' `greedy_color`, largest first, ties in the order of ids: at most one colour more than the
    greatest number of nodes within two hops of one.

    Args:
        neighbours: For each node those it hears or is heard by; one direction is enough.
        frame_slots: Slots of a frame; as few as the colouring needs by default.

    Raises:
        ScenarioError: If the colouring needs more slots than that.
    """
    hears = nx.Graph()
    hears.add_nodes_from(sorted(neighbours))
    hears.add_edges_from((node, other) for node in sorted(neighbours) for other in sorted(neighbours[node]))
    conflicts = nx.Graph()
    conflicts.add_nodes_from(hears)
    for node in hears:
        around = sorted(hears[node])
        conflicts.add_edges_from((node, other) for other in around)
        conflicts.add_edges_from((a, b) for place, a in enumerate(around) for b in around[:place])
    colours: dict[int, int] = nx.coloring.greedy_color(conflicts, strategy="largest_first")
    needed = max(colours.values(), default=0) + 1
    if frame_slots is not None and frame_slots < needed:
        message = f"at least {needed} slots, as many as nodes within two hops of each other need, got {frame_slots}"
        raise ScenarioError(message)
    length = needed if frame_slots is None else frame_slots
    return {node: SlotPlan(colours[node], length, frozenset(colours[other] for other in hears[node])) for node in hears}
