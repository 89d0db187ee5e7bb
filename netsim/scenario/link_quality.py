"""How good a link is, from its gain: received power, whether it can be decoded at all, packet reception ratio."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from netsim.models.devices import RadioDevice
from netsim.models.fading import FadingParameters, peak_db
from netsim.models.modulation import LoraChirps, Modulation
from netsim.models.noise import Background
from netsim.models.path_loss import Links
from netsim.scenario.places import Place

INTERFERENCE_MARGIN_DB = 10.0
"""Signals this far below the noise still count as interference; ten of them together add 3 dB at most."""
FADING_POINTS = 32
"""Equally likely fading gains over which a packet reception ratio is averaged."""

Array = NDArray[np.float64]


class Quality(NamedTuple):
    """Links with what became of them, five arrays of one length.

    Attributes:
        links: The links.
        power_mw: Received power.
        decodable: Whether a frame might be decoded in a quiet moment.
        prr: Chance that a full-size frame arrives without interference, at typical noise, averaged over fading.
    """

    links: Links
    power_mw: Array
    decodable: NDArray[np.bool_]
    prr: Array

    def only(self, kept: NDArray[np.bool_]) -> "Quality":
        """Some of the links."""
        return Quality(self.links.only(kept), self.power_mw[kept], self.decodable[kept], self.prr[kept])


class Receivers:
    """What decides reception at each node.

    Args:
        places: The nodes, ascending by id.
        background: Noise at the nodes.
        fading: What varies from frame to frame.
    """

    def __init__(self, places: Sequence[Place], background: Background, fading: FadingParameters | None) -> None:
        self.tx_power_dbm = np.array([place.group.tx_power_dbm for place in places])
        self._background = background
        self._fading = fading
        self._peak_db = peak_db(fading)
        self._lock_db = np.array([place.radio.preamble_lock_sinr_db for place in places])
        self._lowest_db = np.array([_lowest_db(place.radio) for place in places])
        self._modulations = [place.radio.modulation for place in places]
        self._bits = 8 * (1 + max((place.radio.max_psdu_byte for place in places), default=0))  # the length octet too

    @property
    def floor_dbm(self) -> Array:
        """(N,) weakest received power that counts in quiet noise, or that fading may lift there."""
        floor: Array = self._background.quiet_dbm + self._lowest_db - self._peak_db
        return floor

    def quality(self, links: Links) -> Quality:
        """What the links are worth."""
        power_dbm = self.tx_power_dbm[links.source] + links.gain_db
        at_best_db = power_dbm + self._peak_db - self._background.quiet_dbm[links.destination]
        power_mw = 10.0 ** (power_dbm / 10.0)
        return Quality(links, power_mw, at_best_db >= self._lock_db[links.destination], self._prr(links, power_mw))

    def _prr(self, links: Links, power_mw: Array) -> Array:
        noise_mw = 10.0 ** (self._background.typical_dbm[links.destination] / 10.0)
        prr = np.empty(len(power_mw))
        kinds: list[Modulation] = []
        kind_of = np.array([_position(kinds, modulation) for modulation in self._modulations], np.intp)
        for number, modulation in enumerate(kinds):
            mine = kind_of[links.destination] == number
            prr[mine] = self._mean_prr(modulation, power_mw[mine], noise_mw[mine])
        return prr

    def _mean_prr(self, modulation: Modulation, signal: Array, noise: Array) -> Array:
        if self._fading is None:
            return self._ratio(modulation, signal, noise)
        share = (np.arange(FADING_POINTS) + 0.5) / FADING_POINTS
        total = np.zeros(len(signal))
        for gain in self._fading.quantile(share).tolist():
            total += self._ratio(modulation, gain * signal, noise)
        return total / FADING_POINTS

    def _ratio(self, modulation: Modulation, signal: Array, noise: Array) -> Array:
        log_success = modulation.log_bit_success(signal, np.zeros(len(signal)), noise)
        ratio: Array = np.exp(self._bits * log_success)
        return ratio


def _lowest_db(radio: RadioDevice) -> float:
    """Lowest ratio to the noise at which a signal can be decoded or disturb one that is.

    LoRa decodes signals far below the noise, and interference a few decibels below those still spoils them.
    """
    modulation = radio.modulation
    decodable_db = radio.preamble_lock_sinr_db
    if isinstance(modulation, LoraChirps):
        decodable_db = modulation.threshold_db - modulation.capture_db
    return min(-INTERFERENCE_MARGIN_DB, decodable_db)


def _position(kinds: list[Modulation], modulation: Modulation) -> int:
    """Position of an equal modulation in a list, appended if there is none."""
    if modulation not in kinds:
        kinds.append(modulation)
    return kinds.index(modulation)
