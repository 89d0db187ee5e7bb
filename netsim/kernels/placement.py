"""Which node hosts a variable of a graphical model, and who would host it next.

A variable that belongs to no one sensor (a target's, a subregion's) can live on any of some candidate nodes; it then
exchanges messages with variables on other nodes, over routes that cost hops and joules. A placement is given as an order
of preference for every variable: its host first, then who takes over when those before it are gone.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from netsim.kernels.semiring import FloatArray

HostingRule = Literal["nearest", "least_communication", "least_energy", "load_balanced"]
"""How hosts are chosen (see `place`)."""

ENTRY_BYTE = 8
"""Bytes of a number in a message: what is sent with float64, and in proportion what is sent with less."""
HEADER_BYTE = 8
"""Bytes in front of the numbers of one message between two variables: round, source, destination, count."""


class RouteCosts(Protocol):
    """What the routes between nodes cost; 0 from a node to itself, infinite where there is no route."""

    def hops(self, source: int, destination: int) -> float:
        """Transmissions it takes to get from one node to another if none is lost."""
        ...

    def joule_per_byte(self, source: int, destination: int) -> float:
        """Joules that senders and receivers along the route draw for a byte's time on the air, repetitions included."""
        ...


@dataclass(frozen=True, slots=True)
class Lodger:
    """A variable that looks for a host.

    Attributes:
        position_m: Where it is in the field: a target's prior mean, a subregion's centroid.
        candidates: Nodes that can host it, each once; empty for a variable that needs no host.
        byte_by_node: Expected bytes of the message it sends to a variable on each node in a round; as many come back.
    """

    position_m: tuple[float, float]
    candidates: tuple[int, ...]
    byte_by_node: Mapping[int, float]


def message_byte(entries: float) -> float:
    """Expected size of a message of so many entries, in bytes."""
    return HEADER_BYTE + ENTRY_BYTE * entries


def place(
    rule: HostingRule,
    lodgers: Sequence[Lodger],
    positions_m: Mapping[int, tuple[float, float]],
    costs: RouteCosts | None = None,
) -> tuple[tuple[int, ...], ...]:
    """Order each variable's candidates by preference; the first is its host.

    `nearest`: by distance. `least_communication`: by the sum over the nodes it talks to of bytes times hops, both ways.
    `least_energy`: the same with joules a byte in the place of hops. Candidates from which fewer bytes can be delivered
    at all come after all others. `load_balanced`: the largest number of these variables on any node is the least
    possible, and among such placements the sum of distances is the least possible; the other candidates follow by how
    many variables they host. Equals are ordered by distance, then by node id. The order of candidates given plays no
    part.

    Args:
        rule: The criterion.
        lodgers: The variables.
        positions_m: Position of every candidate.
        costs: Routes; needed by `least_communication` and `least_energy` alone.

    Raises:
        ValueError: If a rule that needs costs has none.
    """
    distances_m = [_distances_m(lodger, positions_m) for lodger in lodgers]
    if rule == "load_balanced":
        return _balanced(lodgers, distances_m)
    cost = _criterion(rule, costs)
    return tuple(
        tuple(sorted(away_m, key=lambda node: (*cost(lodger, node), away_m[node], node)))
        for lodger, away_m in zip(lodgers, distances_m, strict=True)
    )


Cost = tuple[float, ...]


def _criterion(rule: HostingRule, costs: RouteCosts | None) -> Callable[[Lodger, int], Cost]:
    """What candidates are compared by before distance and id."""
    if rule == "nearest":
        return lambda lodger, node: ()
    if costs is None:
        message = f"the placement rule {rule} needs the costs of routes, got none"
        raise ValueError(message)
    between = costs.hops if rule == "least_communication" else costs.joule_per_byte
    return lambda lodger, node: communication_cost(lodger, node, between)


def communication_cost(lodger: Lodger, host: int, between: Callable[[int, int], float]) -> tuple[float, float]:
    """What a variable's messages of a round cost on one host, both directions.

    Args:
        lodger: The variable.
        host: The host under consideration; what it exchanges with variables there costs nothing.
        between: Cost of a byte from one node to another, infinite without a route.

    Returns:
        Bytes that cannot be delivered, and bytes times cost of those that can.
    """
    stranded = total = 0.0
    for node, size_byte in sorted(lodger.byte_by_node.items()):
        if node == host:
            continue
        for cost in (between(host, node), between(node, host)):
            stranded += size_byte if cost == np.inf else 0.0
            total += size_byte * cost if cost < np.inf else 0.0
    return stranded, total


def _distances_m(lodger: Lodger, positions_m: Mapping[int, tuple[float, float]]) -> dict[int, float]:
    if not lodger.candidates:
        return {}
    places_m = np.array([positions_m[node] for node in lodger.candidates])
    away_m = np.linalg.norm(places_m - np.array(lodger.position_m), axis=1)
    return dict(zip(lodger.candidates, away_m.tolist(), strict=True))


def _balanced(lodgers: Sequence[Lodger], distances_m: Sequence[Mapping[int, float]]) -> tuple[tuple[int, ...], ...]:
    """See `place`."""
    homeless = [index for index, lodger in enumerate(lodgers) if lodger.candidates]
    chosen = dict(zip(homeless, balanced_hosts([distances_m[index] for index in homeless]), strict=True))
    load: dict[int, int] = {}
    for host in chosen.values():
        load[host] = load.get(host, 0) + 1
    return tuple(
        tuple(sorted(away_m, key=lambda node: (node != chosen[index], load.get(node, 0), away_m[node], node)))
        for index, away_m in enumerate(distances_m)
    )


def balanced_hosts(costs: Sequence[Mapping[int, float]]) -> list[int]:
    """Hosts such that the fullest has as few variables as possible, and of these the cheapest choice.

    Exact: a bipartite assignment in which every node stands for as many places as it may have variables, solved for the
    least number of places that lets everyone in (Kuhn 1955, Munkres 1957; here by scipy's modified Jonker-Volgenant
    algorithm, Crouse 2016).

    Args:
        costs: For each variable its candidate nodes, at least one, with what each costs.

    Returns:
        A node for each variable.
    """
    if not costs:
        return []
    nodes = sorted({node for each in costs for node in each})
    column = {node: index for index, node in enumerate(nodes)}
    table = np.full((len(costs), len(nodes)), np.inf)
    for row, each in enumerate(costs):
        table[row, [column[node] for node in each]] = list(each.values())
    places = _fewest_places(np.isfinite(table))
    return [nodes[index] for index in _cheapest(table, places)]


def _fewest_places(can: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> int:
    """The least number of places a node that lets every row in, by bisection: more places never let fewer in."""
    from scipy.sparse import csr_array  # imported where needed: it would slow every start
    from scipy.sparse.csgraph import maximum_bipartite_matching

    low, high = -(-len(can) // can.shape[1]), len(can)
    while low < high:
        middle = (low + high) // 2
        matched = maximum_bipartite_matching(csr_array(np.tile(can, (1, middle))), perm_type="column")
        low, high = (low, middle) if (matched >= 0).all() else (middle + 1, high)
    return low


def _cheapest(table: FloatArray, places: int) -> list[int]:
    """The column of each row in the cheapest assignment with so many rows a column."""
    from scipy.optimize import linear_sum_assignment  # imported where needed: it would slow every start

    _, columns = linear_sum_assignment(np.tile(table, (1, places)))
    return [int(column) % table.shape[1] for column in columns]
