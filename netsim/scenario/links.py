"""The radio neighbourhood at the start of a run: who hears whom how well, and what nodes are told of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from netsim.api import Neighbour
from netsim.models.delivery import DeliveryRatios
from netsim.models.fading import Fading
from netsim.models.noise import ConstantNoise, Noise
from netsim.models.path_loss import IdealMediumParameters, LogDistanceParameters, audible_links
from netsim.models.reception import frame_success_probability
from netsim.rng import Streams
from netsim.scenario.places import Place, positions_m
from netsim.sim.air import Link
from netsim.trace.events import LinkTable
from netsim.units import dbm_to_mw

INTERFERENCE_MARGIN_DB = 10.0
"""Signals this far below the noise still count as interference; ten of them together add 3 dB at most."""
LOWEST_PRR = 0.1
"""Nodes with a better link than this are told of each other as neighbours."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Air:
    """Every path between nodes, and the neighbours each node knows of.

    Attributes:
        paths: For each node the nodes its signal reaches, ascending.
        neighbours: For each node its neighbours, ascending.
        table: The links as an event for the trace.
        noise: Background noise at the nodes, ascending by id.
        fading: What varies from frame to frame; None for nothing.
        delivery: Measured delivery ratios to be replayed; None where physics decides.
    """

    paths: dict[int, list[Link]]
    neighbours: dict[int, tuple[Neighbour, ...]]
    table: LinkTable
    noise: Noise
    fading: Fading | None = None
    delivery: DeliveryRatios | None = None


def air_between(
    places: Sequence[Place], medium: IdealMediumParameters | LogDistanceParameters, streams: Streams
) -> Air:
    """Compute the neighbourhood of a scenario's medium."""
    if isinstance(medium, IdealMediumParameters):
        return _ideal(places, medium)
    return _log_distance(places, medium, streams)


def _ideal(places: Sequence[Place], medium: IdealMediumParameters) -> Air:
    distance_m = _distances(places)
    reach = distance_m <= (np.inf if medium.range_m is None else medium.range_m)
    np.fill_diagonal(reach, False)
    source, destination = np.nonzero(reach)
    prr = np.full(len(source), 1.0 - medium.loss_probability)
    power_mw = np.array([dbm_to_mw(places[index].group.tx_power_dbm) for index in source.tolist()])
    return _air(
        places,
        source,
        destination,
        np.zeros(len(source)),
        power_mw,
        np.ones(len(source), bool),
        prr,
        np.zeros(len(places)),
    )


def _log_distance(places: Sequence[Place], medium: LogDistanceParameters, streams: Streams) -> Air:
    tx_power_dbm = np.array([place.group.tx_power_dbm for place in places])
    floor_dbm = medium.noise_dbm - INTERFERENCE_MARGIN_DB
    ids = [place.id for place in places]
    links = audible_links(positions_m(places), ids, tx_power_dbm, floor_dbm, medium, streams)
    power_dbm = tx_power_dbm[links.source] + links.gain_db
    snr_db = power_dbm - medium.noise_dbm
    lock_db = np.array([place.radio.preamble_lock_sinr_db for place in places])
    bits = 8 * (1 + max((place.radio.max_psdu_byte for place in places), default=0))  # the length octet too
    prr = np.asarray(frame_success_probability(10.0 ** (snr_db / 10.0), bits))
    return _air(
        places,
        links.source,
        links.destination,
        links.gain_db,
        10.0 ** (power_dbm / 10.0),
        snr_db >= lock_db[links.destination],
        prr,
        np.full(len(places), dbm_to_mw(medium.noise_dbm)),
    )


def _air(
    places: Sequence[Place],
    source: NDArray[np.intp],
    destination: NDArray[np.intp],
    gain_db: Array,
    power_mw: Array,
    decodable: NDArray[np.bool_],
    prr: Array,
    noise_mw: Array,
) -> Air:
    ids = [place.id for place in places]
    where = positions_m(places)
    distance_m = np.hypot(*(where[source] - where[destination]).T)
    paths: dict[int, list[Link]] = {number: [] for number in ids}
    neighbours: dict[int, list[Neighbour]] = {number: [] for number in ids}
    rows = zip(
        source.tolist(),
        destination.tolist(),
        power_mw.tolist(),
        decodable.tolist(),
        prr.tolist(),
        distance_m.tolist(),
        strict=True,
    )
    for sender, listener, power, strong, ratio, distance in rows:
        paths[ids[sender]].append(Link(ids[listener], power, strong, ratio))
        if ratio >= LOWEST_PRR:
            neighbours[ids[sender]].append(Neighbour(ids[listener], distance, ratio))
    shown = prr >= LOWEST_PRR
    table = LinkTable(
        source=[ids[index] for index in source[shown]],
        destination=[ids[index] for index in destination[shown]],
        gain_db=gain_db[shown].astype(np.float32),
        prr=prr[shown].astype(np.float32),
    )
    return Air(paths, {number: tuple(links) for number, links in neighbours.items()}, table, ConstantNoise(noise_mw))


def _distances(places: Sequence[Place]) -> Array:
    where = positions_m(places)
    difference = where[:, None, :] - where[None, :, :]
    distance: Array = np.hypot(difference[..., 0], difference[..., 1])
    return distance
