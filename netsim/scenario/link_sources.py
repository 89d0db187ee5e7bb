"""Where the links of a medium come from: plain range on the ideal medium, path loss on those with physics."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from netsim.models.delivery import DeliveryRatios
from netsim.models.fading import FadingParameters
from netsim.models.hardware import hardware_offsets
from netsim.models.media import IdealMediumParameters, LossMedium
from netsim.models.noise import Background, ConstantNoise, background
from netsim.models.path_loss import Indices, Links, sorted_links
from netsim.models.propagation import Propagation
from netsim.rng import Streams
from netsim.scenario.link_quality import Array, Quality, Receivers
from netsim.scenario.places import Place, positions_m
from netsim.units import dbm_to_mw


@dataclass(frozen=True, slots=True, eq=False)
class LinkSource:
    """All links of a medium, what they are worth, and how they follow the nodes.

    Attributes:
        positions_m: (N, 2) present positions of the nodes, ascending by id; changed in place by `move`.
        links: Makes all links.
        quality: Says what links are worth.
        background: Noise at the nodes.
        fading: What varies from frame to frame.
        delivery: Measured delivery ratios.
        move: Puts nodes (M,) at positions (M, 2) and returns every link from or to one of them; None if they cannot move.
    """

    positions_m: Array
    links: Callable[[], Links]
    quality: Callable[[Links], Quality]
    background: Background
    fading: FadingParameters | None = None
    delivery: DeliveryRatios | None = None
    move: Callable[[Indices, Array], Links] | None = None


def physical_links(places: Sequence[Place], medium: LossMedium, folder: Path, streams: Streams) -> LinkSource:
    """Links by path loss.

    Args:
        places: The nodes, ascending by id.
        medium: The medium.
        folder: What a file of noise readings is relative to.
        streams: The run's random streams.
    """
    ids = [place.id for place in places]
    noise_db = hardware_offsets(ids, medium.hardware_covariance, streams).noise_db
    noise = background(medium.noise, medium.noise_dbm, noise_db, ids, streams, folder)
    receivers = Receivers(places, noise, medium.fading)
    propagation = Propagation(positions_m(places), ids, receivers.tx_power_dbm, receivers.floor_dbm, medium, streams)
    return LinkSource(
        positions_m=propagation.positions_m,
        links=propagation.links,
        quality=receivers.quality,
        background=noise,
        fading=medium.fading,
        move=propagation.move,
    )


def ideal_links(places: Sequence[Place], medium: IdealMediumParameters) -> LinkSource:
    """Links within range."""
    where = positions_m(places)
    range_m = np.inf if medium.range_m is None else medium.range_m
    power_mw = np.array([dbm_to_mw(place.group.tx_power_dbm) for place in places])

    def between(source: Indices, destination: Indices) -> Links:
        offsets = where[source] - where[destination]
        near = (np.hypot(offsets[:, 0], offsets[:, 1]) <= range_m) & (source != destination)
        return Links(source[near], destination[near], np.zeros(np.count_nonzero(near)))

    def links() -> Links:
        everyone = np.arange(len(where))
        return sorted_links([between(np.full(len(where), index), everyone) for index in range(len(where))])

    def move(index: Indices, moved_m: Array) -> Links:
        where[index] = moved_m
        others = np.setdiff1d(np.arange(len(where)), index)
        out = [between(np.full(len(where), each), np.arange(len(where))) for each in index.tolist()]
        back = [between(others, np.full(len(others), each)) for each in index.tolist()]
        return sorted_links([*out, *back])

    def quality(links: Links) -> Quality:
        size = len(links.source)
        prr = np.full(size, 1.0 - medium.loss_probability)
        return Quality(links, power_mw[links.source], np.ones(size, bool), prr)

    silence = np.zeros(len(places))
    none = Background(ConstantNoise(silence), silence - np.inf, silence - np.inf)
    return LinkSource(positions_m=where, links=links, quality=quality, background=none, move=move)
