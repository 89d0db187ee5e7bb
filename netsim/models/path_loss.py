"""Link gains: path loss by distance, with static shadowing and asymmetry drawn once for each pair of nodes.

The loss over a distance d is PL(d) + X, with X normal, in dB (Rappaport, Wireless Communications, 4.9). Asking twice
changes nothing: X comes from a keyed stream, that of nodes i < j from the stream of j, so that a new node with the highest
id changes no link of the others. A sender's hardware offset adds to the gains of all its links.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from netsim.models.hardware import hardware_offsets
from netsim.models.media import IdealMediumParameters as IdealMediumParameters
from netsim.models.media import LogDistanceParameters as LogDistanceParameters
from netsim.models.media import LossMedium
from netsim.rng import Streams

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Links(NamedTuple):
    """Ordered pairs of nodes that hear each other, by source, then destination; three arrays of one length.

    Attributes:
        source: Index of the sender.
        destination: Index of the listener.
        gain_db: Received over transmitted power.
    """

    source: Indices
    destination: Indices
    gain_db: Array

    def only(self, kept: NDArray[np.bool_]) -> "Links":
        """Some of the links."""
        return Links(self.source[kept], self.destination[kept], self.gain_db[kept])


def path_loss_db(distance_m: Array, parameters: LossMedium) -> Array:
    """Loss over a distance, without shadowing, in dB.

    Args:
        distance_m: Distances of any shape.
        parameters: The medium.
    """
    return parameters.loss_db(distance_m)


def static_shadowing_db(node_ids: Sequence[int], streams: Streams, sd_db: float) -> Array:
    """Shadowing of every pair of nodes, in dB, added to the gain.

    The pair of ids i < j takes draw number i of the stream `node/<j>/shadowing`: it depends on the two ids only.

    Args:
        node_ids: Distinct ids, at least 0, in any order. Drawing takes time in proportion to their sum.
        streams: The run's random streams.
        sd_db: Standard deviation.

    Returns:
        Symmetric (N, N) with zeros on the diagonal, in the order of `node_ids`.
    """
    ids = np.asarray(node_ids, dtype=np.intp)
    shadowing = np.zeros((len(ids), len(ids)))
    for index, lower in pairs(ids):
        draws = sd_db * pair_normals(ids, index, lower, streams, "shadowing")
        shadowing[index, lower] = shadowing[lower, index] = draws
    return shadowing


def link_gains_db(positions_m: Array, node_ids: Sequence[int], parameters: LossMedium, streams: Streams) -> Array:
    """Gain of every ordered pair: received over transmitted power.

    Args:
        positions_m: (N, 2).
        node_ids: Distinct ids of the N nodes; they key the shadowing.
        parameters: The medium.
        streams: The run's random streams.

    Returns:
        (N, N) in dB, row the sender, column the listener; -inf on the diagonal.
    """
    ids = np.asarray(node_ids, dtype=np.intp)
    power_db = hardware_offsets(ids.tolist(), parameters.hardware_covariance, streams).power_db
    gains = np.full((len(ids), len(ids)), -np.inf)
    for index, lower in pairs(ids):
        gains[index, lower], gains[lower, index] = _gains_to_lower(positions_m, ids, index, lower, parameters, streams)
    gains += power_db[:, np.newaxis]
    return gains


def audible_links(
    positions_m: Array,
    node_ids: Sequence[int],
    tx_power_dbm: Array,
    floor_dbm: float | Array,
    parameters: LossMedium,
    streams: Streams,
) -> Links:
    """The ordered pairs in which the listener receives at least `floor_dbm`: what matters of `link_gains_db`.

    It takes memory in proportion to the links found, so it serves fields of many thousand nodes; the time is that of
    drawing the shadowing of all pairs (a pair far apart may be lifted over the floor, so none can be skipped).

    Args:
        positions_m: (N, 2).
        node_ids: Distinct ids of the N nodes; they key the shadowing.
        tx_power_dbm: (N,) transmit powers.
        floor_dbm: Weakest received power that counts; one for all, or (N,) one a listener.
        parameters: The medium.
        streams: The run's random streams.
    """
    ids = np.asarray(node_ids, dtype=np.intp)
    floor_dbm = np.broadcast_to(floor_dbm, len(ids))
    power_db = hardware_offsets(ids.tolist(), parameters.hardware_covariance, streams).power_db
    found = []
    for index, lower in pairs(ids):
        down, up = _gains_to_lower(positions_m, ids, index, lower, parameters, streams)
        down, up = down + power_db[index], up + power_db[lower]
        heard = tx_power_dbm[index] + down >= floor_dbm[lower]
        hears = tx_power_dbm[lower] + up >= floor_dbm[index]
        found.append(Links(np.full(np.count_nonzero(heard), index), lower[heard], down[heard]))
        found.append(Links(lower[hears], np.full(np.count_nonzero(hears), index), up[hears]))
    return sorted_links(found)


def sorted_links(found: Sequence[Links]) -> Links:
    """Links put together, by source, then destination."""
    none = np.empty(0, np.intp)
    rows = [Links(none, none, np.empty(0)), *found]
    source, destination, gain_db = (np.concatenate(column) for column in zip(*rows, strict=True))
    order = np.lexsort((destination, source))
    return Links(source[order], destination[order], gain_db[order])


def pairs(ids: Indices) -> Iterator[tuple[int, Indices]]:
    """For each node, the indices of the nodes with lower ids."""
    order = np.argsort(ids)
    for rank, index in enumerate(order.tolist()):
        yield index, order[:rank]


def pair_normals(ids: Indices, index: int, lower: Indices, streams: Streams, purpose: str) -> Array:
    """Standard normal draws of the pairs of a node with nodes of lower ids, by the ids alone."""
    count = int(ids[lower[-1]]) + 1 if len(lower) else 0
    return streams.generator(f"node/{ids[index]}/{purpose}").standard_normal(count)[ids[lower]]


def _gains_to_lower(
    positions_m: Array, ids: Indices, index: int, lower: Indices, parameters: LossMedium, streams: Streams
) -> tuple[Array, Array]:
    """Gains from a node to those of lower ids, and from them to it."""
    offsets = positions_m[lower] - positions_m[index]
    gain = -path_loss_db(np.hypot(offsets[:, 0], offsets[:, 1]), parameters)
    if parameters.shadowing_sd_db:
        gain = gain + parameters.shadowing_sd_db * pair_normals(ids, index, lower, streams, "shadowing")
    if not parameters.asymmetry_sd_db:
        return gain, gain
    half = 0.5 * parameters.asymmetry_sd_db * pair_normals(ids, index, lower, streams, "asymmetry")
    return gain - half, gain + half
