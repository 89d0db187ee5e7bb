"""Link gains: log-distance path loss with static shadowing, drawn once for each pair of nodes.

The loss over a distance d is PL(d) = PL(d0) + 10 n log10(d / d0) + X, with X normal, in dB (Rappaport, Wireless
Communications, 4.9). Asking twice changes nothing: X comes from a keyed stream, that of nodes i < j from the
stream of j, so that a new node with the highest id changes no link of the others.
"""

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np
from annotated_types import Gt, Le
from numpy.typing import NDArray

from netsim.parameters import NonNegative, Positive, Probability, parameters
from netsim.rng import Streams

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@parameters
class LogDistanceParameters:
    """A shared medium with log-distance path loss, static shadowing, noise and interference."""

    type: Literal["log-distance"] = "log-distance"
    """Selects this medium."""
    exponent: Annotated[float, Gt(0), Le(10)] = 3.0
    """Path-loss exponent n: 2 in free space, 2 to 4 outdoors near the ground; 3 is the default of TOSSIM and ns-3."""
    reference_loss_db: float = 40.05
    """Loss at the reference distance; the default is free space at 2.40 GHz over 1 m, 20 log10(4 pi d f / c)."""
    reference_distance_m: Positive = 1.0
    """Reference distance d0; nearer nodes are treated as if they were this far apart."""
    shadowing_sd_db: NonNegative = 4.0
    """Standard deviation of the static shadowing of a pair of nodes; 4 dB in Castalia, 0 for a plain disk."""
    asymmetry_sd_db: NonNegative = 0.0
    """Standard deviation of the difference between a link's two directions; 0 makes all links symmetric."""
    noise_dbm: float = -95.4
    """Effective noise power at the receiver.

    The thermal noise in 2 MHz is -111.0 dBm (kTB at 290 K). The default adds 15.6 dB for noise figure and
    implementation loss, so that the 802.15.4 error formula meets the sensitivity of the CC2420 data sheet (1 % loss of
    20-byte frames at -95 dBm). ns-3's -106.987 dBm is kTB in 5 MHz without any noise figure: its links reach 2.4 times
    as far (n = 3).
    """


@parameters
class IdealMediumParameters:
    """A medium without physics: every frame arrives at every node in range after a delay, unless lost at random."""

    type: Literal["ideal"] = "ideal"
    """Selects this medium."""
    delay_s: NonNegative = 1e-4
    """From the end of a frame's airtime to its reception."""
    range_m: Positive | None = None
    """How far a frame is heard; by default everywhere."""
    loss_probability: Probability = 0.0
    """Chance that a listener misses a frame, each on its own."""


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


def path_loss_db(distance_m: Array, parameters: LogDistanceParameters) -> Array:
    """Loss over a distance, without shadowing, in dB.

    Args:
        distance_m: Distances of any shape; below the reference distance they count as the reference distance.
        parameters: Exponent and reference.
    """
    ratio = np.maximum(distance_m / parameters.reference_distance_m, 1.0)
    loss: Array = parameters.reference_loss_db + 10.0 * parameters.exponent * np.log10(ratio)
    return loss


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
    for index, lower in _pairs(ids):
        draws = sd_db * _pair_normals(ids, index, lower, streams, "shadowing")
        shadowing[index, lower] = shadowing[lower, index] = draws
    return shadowing


def link_gains_db(
    positions_m: Array, node_ids: Sequence[int], parameters: LogDistanceParameters, streams: Streams
) -> Array:
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
    gains = np.full((len(ids), len(ids)), -np.inf)
    for index, lower in _pairs(ids):
        gains[index, lower], gains[lower, index] = _gains_to_lower(positions_m, ids, index, lower, parameters, streams)
    return gains


def audible_links(
    positions_m: Array,
    node_ids: Sequence[int],
    tx_power_dbm: Array,
    floor_dbm: float,
    parameters: LogDistanceParameters,
    streams: Streams,
) -> Links:
    """The ordered pairs in which the listener receives at least `floor_dbm`: what matters of `link_gains_db`.

    It takes memory in proportion to the links found, so it serves fields of many thousand nodes; the time is that of
    drawing the shadowing of all pairs (a pair far apart may be lifted over the floor, so none can be skipped).

    Args:
        positions_m: (N, 2).
        node_ids: Distinct ids of the N nodes; they key the shadowing.
        tx_power_dbm: (N,) transmit powers.
        floor_dbm: Weakest received power that counts.
        parameters: The medium.
        streams: The run's random streams.
    """
    ids = np.asarray(node_ids, dtype=np.intp)
    none = np.empty(0, np.intp)
    found = [Links(none, none, np.empty(0))]
    for index, lower in _pairs(ids):
        down, up = _gains_to_lower(positions_m, ids, index, lower, parameters, streams)
        heard, hears = tx_power_dbm[index] + down >= floor_dbm, tx_power_dbm[lower] + up >= floor_dbm
        found.append(Links(np.full(np.count_nonzero(heard), index), lower[heard], down[heard]))
        found.append(Links(lower[hears], np.full(np.count_nonzero(hears), index), up[hears]))
    source, destination, gain_db = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.lexsort((destination, source))
    return Links(source[order], destination[order], gain_db[order])


def _pairs(ids: Indices) -> Iterator[tuple[int, Indices]]:
    """For each node, the indices of the nodes with lower ids."""
    order = np.argsort(ids)
    for rank, index in enumerate(order.tolist()):
        yield index, order[:rank]


def _pair_normals(ids: Indices, index: int, lower: Indices, streams: Streams, purpose: str) -> Array:
    """Standard normal draws of the pairs of a node with nodes of lower ids, by the ids alone."""
    count = int(ids[lower[-1]]) + 1 if len(lower) else 0
    return streams.generator(f"node/{ids[index]}/{purpose}").standard_normal(count)[ids[lower]]


def _gains_to_lower(
    positions_m: Array, ids: Indices, index: int, lower: Indices, parameters: LogDistanceParameters, streams: Streams
) -> tuple[Array, Array]:
    """Gains from a node to those of lower ids, and from them to it."""
    offsets = positions_m[lower] - positions_m[index]
    gain = -path_loss_db(np.hypot(offsets[:, 0], offsets[:, 1]), parameters)
    if parameters.shadowing_sd_db:
        gain = gain + parameters.shadowing_sd_db * _pair_normals(ids, index, lower, streams, "shadowing")
    if not parameters.asymmetry_sd_db:
        return gain, gain
    half = 0.5 * parameters.asymmetry_sd_db * _pair_normals(ids, index, lower, streams, "asymmetry")
    return gain - half, gain + half
