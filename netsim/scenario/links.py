"""The radio neighbourhood of a run: who hears whom how well, and what nodes are told of it; kept up where nodes move."""

import operator
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from netsim.api import Neighbour
from netsim.errors import ScenarioError
from netsim.models.delivery import DeliveryRatios
from netsim.models.fading import Fading
from netsim.models.media import IdealMediumParameters, TraceMediumParameters
from netsim.models.noise import Noise
from netsim.models.path_loss import Indices, Links
from netsim.rng import Streams
from netsim.scenario.link_quality import Array, Quality
from netsim.scenario.link_sources import LinkSource, ideal_links, physical_links
from netsim.scenario.load import LoadedScenario
from netsim.scenario.places import Place
from netsim.scenario.trace_links import trace_links
from netsim.sim.air import Link
from netsim.trace.events import LinkTable

_Item = TypeVar("_Item")

LOWEST_PRR = 0.1
"""Nodes with a better link than this are told of each other as neighbours."""
LOSSLESS_FROM_PRR = 0.5
"""With perfect reception, better links than this lose nothing and the others do not exist."""


@dataclass(slots=True, eq=False)
class Air:
    """Every path between nodes, and the neighbours each node knows of.

    Attributes:
        paths: For each node the nodes its signal reaches, ascending; as of the last `relocate`.
        neighbours: For each node its neighbours, ascending; as of the last `relocate`.
        positions_m: Where each node is, as of the last `relocate`.
        table: The links at the start as an event for the trace.
        noise: Background noise at the nodes, ascending by id.
        fading: What varies from frame to frame; None for nothing.
        delivery: Measured delivery ratios to be replayed; None where physics decides.
        version: How often nodes were relocated: what was computed from the links of another version is stale.
    """

    paths: dict[int, list[Link]]
    neighbours: dict[int, tuple[Neighbour, ...]]
    positions_m: dict[int, tuple[float, float]]
    table: LinkTable
    noise: Noise
    fading: Fading | None = None
    delivery: DeliveryRatios | None = None
    version: int = field(default=0, init=False)
    _links: "_LinkLists | None" = field(default=None)

    @property
    def can_relocate(self) -> bool:
        """Whether links follow nodes that move; not where they come from a file."""
        return self._links is not None

    def relocate(self, moved: Mapping[int, tuple[float, float]]) -> Mapping[int, list[Link]]:
        """Nodes moved: bring `paths` and `neighbours` up to date.

        What was drawn for a pair of nodes (shadowing, asymmetry) or for a node (hardware) stays. After the first move of a
        node, the time is in proportion to moved nodes times nodes.

        Args:
            moved: New position (x_m, y_m) by node id.

        Returns:
            The new list of links of every sender whose list changed.

        Raises:
            ScenarioError: If not `can_relocate`.
        """
        if self._links is None:
            message = "the trace medium has the links of its file: its nodes cannot move"
            raise ScenarioError(message)
        self.positions_m.update(moved)
        self.version += 1
        return self._links.relocate(self, moved)


def air_between(places: Sequence[Place], loaded: LoadedScenario, streams: Streams) -> Air:
    """Compute the neighbourhood of a scenario's medium.

    Raises:
        ScenarioError: For files that are missing or wrong, or that do not fit the scenario's nodes.
    """
    medium = loaded.scenario.medium
    if isinstance(medium, IdealMediumParameters):
        source = ideal_links(places, medium)
    elif isinstance(medium, TraceMediumParameters):
        source = trace_links(places, medium, loaded, streams)
    else:
        source = physical_links(places, medium, loaded.folder, streams)
    perfect = not isinstance(medium, IdealMediumParameters) and medium.reception == "perfect"
    lists = _LinkLists(places, source, perfect)
    quality = lists.quality(source.links())
    paths: dict[int, list[Link]] = {place.id: [] for place in places}
    neighbours: dict[int, list[Neighbour]] = {place.id: [] for place in places}
    for sender, link, neighbour in lists.rows(quality):
        paths[sender].append(link)
        if neighbour is not None:
            neighbours[sender].append(neighbour)
    return Air(
        paths,
        {number: tuple(known) for number, known in neighbours.items()},
        {place.id: (place.x_m, place.y_m) for place in places},
        _table(places, quality),
        source.background.noise,
        source.fading,
        None if perfect else source.delivery,
        lists if source.move is not None else None,
    )


def _table(places: Sequence[Place], quality: Quality) -> LinkTable:
    ids = [place.id for place in places]
    shown = quality.only(quality.prr >= LOWEST_PRR)
    return LinkTable(
        source=[ids[index] for index in shown.links.source.tolist()],
        destination=[ids[index] for index in shown.links.destination.tolist()],
        gain_db=shown.links.gain_db.astype(np.float32),
        prr=shown.prr.astype(np.float32),
    )


class _LinkLists:
    """Turns the links of a source into the lists that media and nodes work with, at the start and after moves."""

    def __init__(self, places: Sequence[Place], source: LinkSource, perfect: bool) -> None:
        self._ids = [place.id for place in places]
        self._index = {place.id: index for index, place in enumerate(places)}
        self._source = source
        self._perfect = perfect

    def quality(self, links: Links) -> Quality:
        """What the links are worth; with perfect reception only those that are good enough, and without loss."""
        quality = self._source.quality(links)
        if not self._perfect:
            return quality
        kept = quality.only(quality.prr >= LOSSLESS_FROM_PRR)
        return kept._replace(prr=np.ones(len(kept.prr)), decodable=np.ones(len(kept.prr), bool))

    def rows(self, quality: Quality) -> Iterator[tuple[int, Link, Neighbour | None]]:
        """Sender, link and, if it is good enough to be told of, neighbour."""
        where, links, ids = self._source.positions_m, quality.links, self._ids
        distance_m = np.hypot(*(where[links.source] - where[links.destination]).T)
        columns = (links.source, links.destination, quality.power_mw, quality.decodable, quality.prr, distance_m)
        for sender, listener, power, strong, ratio, distance in zip(*(c.tolist() for c in columns), strict=True):
            known = Neighbour(ids[listener], distance, ratio) if ratio >= LOWEST_PRR else None
            yield ids[sender], Link(ids[listener], power, strong, ratio), known

    def relocate(self, air: Air, moved: Mapping[int, tuple[float, float]]) -> dict[int, list[Link]]:
        """See `Air.relocate`."""
        if self._source.move is None or not moved:
            return {}
        index: Indices = np.array([self._index[node] for node in moved], np.intp)
        positions_m: Array = np.array(list(moved.values()), dtype=float).reshape(-1, 2)
        links: defaultdict[int, dict[int, Link]] = defaultdict(dict)
        known: defaultdict[int, dict[int, Neighbour]] = defaultdict(dict)
        for sender, link, neighbour in self.rows(self.quality(self._source.move(index, positions_m))):
            links[sender][link.destination] = link
            if neighbour is not None:
                known[sender][neighbour.id] = neighbour
        changed: dict[int, list[Link]] = {}
        for sender in self._ids:
            new_links: Sequence[Link] = list(links[sender].values())
            new_known: Sequence[Neighbour] = tuple(known[sender].values())
            if sender not in moved:
                new_links = _replaced(air.paths[sender], _destination, moved, links[sender])
                new_known = _replaced(air.neighbours[sender], _number, moved, known[sender])
            if new_links is not air.paths[sender] and new_links != air.paths[sender]:
                changed[sender] = air.paths[sender] = list(new_links)
            air.neighbours[sender] = tuple(new_known)
        return changed


_destination: Callable[[Link], int] = operator.attrgetter("destination")
_number: Callable[[Neighbour], int] = operator.attrgetter("id")


def _replaced(
    items: Sequence[_Item], key: Callable[[_Item], int], moved: Iterable[int], fresh: Mapping[int, _Item]
) -> Sequence[_Item]:
    """Items ascending by key, in which those of the nodes that moved are the fresh ones; the same object if none differs."""
    result = items
    for node in moved:
        new, place = fresh.get(node), bisect_left(result, node, key=key)
        old = result[place] if place < len(result) and key(result[place]) == node else None
        if new == old:
            continue
        result = [*result[:place], *([] if new is None else [new]), *result[place + (old is not None) :]]
    return result
