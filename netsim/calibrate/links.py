"""A log by links: means, distances, directions, change in time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from netsim.calibrate.log import TestbedLog
from netsim.errors import ScenarioError
from netsim.models.node_files import PlacedNode

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LEAST_REPEATS = 3
LEAST_RATIO = 0.9
"""Only links that receive at least so much tell how power varies: of the others the weak frames are missing."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkMeans:
    """One row a link, transmit power and channel.

    Attributes:
        link: Number of the ordered pair.
        pair: Number of the unordered pair.
        source: Index of the sender.
        destination: Index of the listener.
        channel: Channel; 0 where unknown.
        tx_power_dbm: Transmit power; NaN where unknown.
        rssi_dbm: Mean over the frames received; NaN where none was.
        received: Frames received.
        sent: Frames sent.
        distance_m: As the log has it; NaN where it does not.
    """

    link: Ints
    pair: Ints
    source: Ints
    destination: Ints
    channel: Ints
    tx_power_dbm: Floats
    rssi_dbm: Floats
    received: Floats
    sent: Floats
    distance_m: Floats


@dataclass(frozen=True, slots=True)
class Variation:
    """How the received power of a link changes.

    Attributes:
        between: `frames` where a row is one frame; else `measurements`, which are means over many.
        median_sd_db: Median over links of the standard deviation.
        ninetieth_sd_db: Its 90 % quantile over links.
        links: How many links (and channels) were repeated often and well enough.
    """

    between: Literal["frames", "measurements"]
    median_sd_db: float
    ninetieth_sd_db: float
    links: int


def link_means(log: TestbedLog) -> LinkMeans:
    """Sum a log up by link, transmit power and channel."""
    first, group = _groups(log)
    received = np.bincount(group, log.received).astype(float)
    heard = np.isfinite(log.rssi_dbm)
    weight = np.where(heard, log.received, 0.0)
    total = np.bincount(group, weight * np.where(heard, log.rssi_dbm, 0.0))
    mean = np.full(len(first), np.nan)
    np.divide(total, np.bincount(group, weight), out=mean, where=np.bincount(group, weight) > 0)
    source, destination = log.source[first], log.destination[first]
    low, high = np.minimum(source, destination), np.maximum(source, destination)
    return LinkMeans(
        link=log.link[first],
        pair=low * len(log.names) + high,
        source=source,
        destination=destination,
        channel=log.channel[first],
        tx_power_dbm=log.tx_power_dbm[first],
        rssi_dbm=mean,
        received=received,
        sent=np.bincount(group, log.sent).astype(float),
        distance_m=log.distance_m[first],
    )


def _groups(log: TestbedLog) -> tuple[Ints, Ints]:
    """First row of each link, transmit power and channel; and to which of them each row belongs."""
    power = np.where(np.isnan(log.tx_power_dbm), 1e9, log.tx_power_dbm)
    keys = np.column_stack([log.link, log.channel, power])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def with_unlisted(links: LinkMeans, nodes: int) -> LinkMeans:
    """The links, and those between a sender and a listener of the log that it does not list: nothing was received there."""
    senders = np.unique(
        np.column_stack([links.source, links.channel, np.nan_to_num(links.tx_power_dbm, nan=1e9)]), axis=0
    )
    listed = set(zip(links.source.tolist(), links.destination.tolist(), links.channel.tolist(), strict=True))
    listeners = np.unique(links.destination).tolist()
    rows = [
        (int(source), listener, int(channel), power if power < 1e9 else np.nan)
        for source, channel, power in senders.tolist()
        for listener in listeners
        if listener != source and (int(source), listener, int(channel)) not in listed
    ]
    if not rows:
        return links
    source, destination, channel = (np.array([row[place] for row in rows], np.intp) for place in range(3))
    nothing, unknown = np.zeros(len(rows)), np.full(len(rows), np.nan)
    return LinkMeans(
        link=np.append(links.link, source * nodes + destination),
        pair=np.append(links.pair, np.minimum(source, destination) * nodes + np.maximum(source, destination)),
        source=np.append(links.source, source),
        destination=np.append(links.destination, destination),
        channel=np.append(links.channel, channel),
        tx_power_dbm=np.append(links.tx_power_dbm, np.array([row[3] for row in rows])),
        rssi_dbm=np.append(links.rssi_dbm, unknown),
        received=np.append(links.received, nothing),
        sent=np.append(links.sent, nothing),
        distance_m=np.append(links.distance_m, unknown),
    )


FLOOR_ROOM_DB = 0.5
FLOOR_SHARE = 0.01
FLOOR_SPREAD = 0.3


def floor_dbm(power_dbm: Floats, ratio: Floats) -> float | None:
    """The least power a receiver reports, where it reports none less: None unless that shows.

    It shows by many rows at exactly the lowest power, some of which receive much and some little. Their power is at most
    that; nothing more is known of it.
    """
    heard = np.isfinite(power_dbm)
    if not heard.any():
        return None
    lowest = float(power_dbm[heard].min())
    at = heard & (power_dbm <= lowest + 0.011)
    if np.count_nonzero(at) < max(10, FLOOR_SHARE * np.count_nonzero(heard)):
        return None
    low, high = np.quantile(ratio[at], [0.1, 0.9])
    return lowest if high - low >= FLOOR_SPREAD else None


def distances(log: TestbedLog, links: LinkMeans, positions: Sequence[PlacedNode]) -> Floats:
    """The distance of each link: from positions, if there are any, else as the log has it.

    Raises:
        ScenarioError: If a node of the log has no position, or two nodes stand at one place.
    """
    if not positions:
        return links.distance_m
    places = {str(node.id): (node.x_m, node.y_m) for node in positions if node.id is not None}
    places |= {node.name: (node.x_m, node.y_m) for node in positions if node.name}
    missing = [name for name in log.names if name not in places]
    if missing:
        shown = ", ".join(missing[:10]) + (", ..." if len(missing) > 10 else "")
        message = (
            f"{log.path}: expected a position for each of its {len(log.names)} nodes, none for {shown}; "
            "name or number the nodes in the file of positions as in the log"
        )
        raise ScenarioError(message)
    where = np.array([places[name] for name in log.names])
    distance_m: Floats = np.hypot(*(where[links.source] - where[links.destination]).T)
    if (distance_m <= 0.0).any():
        at = int(np.argmin(distance_m))
        pair = f"{log.names[links.source[at]]} and {log.names[links.destination[at]]}"
        message = f"{log.path}: expected nodes at different places, got {pair} at the same"
        raise ScenarioError(message)
    return distance_m


def mean_variances(log: TestbedLog, links: LinkMeans) -> Floats | None:
    """Variance (dB^2) of each link's mean power that the spread of its own frames explains; None unless a row is a frame.

    A link's variance over its frames by their number; a link with one frame is taken to vary as the others do on average.
    Frames are taken to vary independently.

    Args:
        log: The log.
        links: Its sums, of `link_means`.
    """
    if not log.per_frame:
        return None
    group = _groups(log)[1]
    heard = np.isfinite(log.rssi_dbm)
    squares = np.bincount(group[heard], (log.rssi_dbm[heard] - links.rssi_dbm[group[heard]]) ** 2, len(links.rssi_dbm))
    freedom = np.maximum(links.received - 1.0, 0.0)
    if not freedom.any():
        return None
    usual = float(squares.sum() / freedom.sum())
    within = np.where(freedom > 0.0, squares / np.maximum(freedom, 1.0), usual)
    variances: Floats = within / np.maximum(links.received, 1.0)
    return variances


def asymmetry(links: LinkMeans, gain_db: Floats, variances: Floats | None = None) -> tuple[float | None, float, int]:
    """Standard deviation of the difference of two directions about 0, its standard error, and the number of pairs.

    Args:
        links: The links.
        gain_db: Their gains; NaN where unseen. Pairs with one direction unseen do not count, which makes the deviation a
            little too small.
        variances: Of the gains, by the sampling of frames (`mean_variances`): taken off; by default nothing is.
    """
    known = np.zeros(len(gain_db)) if variances is None else variances
    forward = {}
    differences: dict[int, list[float]] = {}
    for row in np.flatnonzero(np.isfinite(gain_db)).tolist():
        power = float(links.tx_power_dbm[row])
        key = (int(links.channel[row]), power if power == power else None)
        forward[int(links.source[row]), int(links.destination[row]), key] = (float(gain_db[row]), float(known[row]))
    for (source, destination, key), gain in forward.items():
        back = forward.get((destination, source, key)) if source < destination else None
        if back is not None:
            differences.setdefault(source * 1_000_003 + destination, []).append(
                (gain[0] - back[0]) ** 2 - gain[1] - back[1]
            )
    if not differences:
        return None, 0.0, 0
    squares = np.array([float(np.mean(found)) for found in differences.values()])
    variance, count = max(0.0, float(squares.mean())), len(squares)
    spread = float(squares.std(ddof=1)) / count**0.5 if count > 1 else 0.0
    # Near 0 the error of the root is no longer half the relative error of the square: it is at most the error's own root.
    error = spread**0.5 if 4.0 * variance <= spread else 0.5 * spread / variance**0.5
    return variance**0.5, error, count


def variation(log: TestbedLog) -> Variation | None:
    """How power changes between the frames, or the measurements, of one link and channel; None without repetitions."""
    group = _groups(log)[1]
    ratio = np.bincount(group, log.received) / np.bincount(group, log.sent)
    heard = np.isfinite(log.rssi_dbm)
    count = np.bincount(group, heard)
    rssi = np.where(heard, log.rssi_dbm, 0.0)
    mean = np.bincount(group, rssi) / np.maximum(count, 1)
    squares = np.bincount(group, np.where(heard, (rssi - mean[group]) ** 2, 0.0))
    steady = (count >= LEAST_REPEATS) & (ratio >= LEAST_RATIO)
    if not steady.any():
        return None
    sd = np.sqrt(squares[steady] / (count[steady] - 1))
    return Variation(
        "frames" if log.per_frame else "measurements",
        float(np.median(sd)),
        float(np.quantile(sd, 0.9)),
        int(np.count_nonzero(steady)),
    )
