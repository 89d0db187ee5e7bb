"""Reception against received power: the fit, what strong links lose, what the receivers cannot show."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from netsim.calibrate.found import Calibration
from netsim.calibrate.links import FLOOR_ROOM_DB, LinkMeans, floor_dbm
from netsim.calibrate.log import TestbedLog
from netsim.kernels.prr_fit import CurveName, PrrFit, fit_prr
from netsim.models.reception import frame_success_probability

Floats = NDArray[np.float64]

STRONG_LINKS_LOSE = 0.02
"""From this loss of strong links on it is said that something else than noise loses frames."""
STRONG_DB = 10.0
"""Links so far above the 50 % point and the floor are strong."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """What reception is fitted to: the log's rows, or links where a row is one frame."""

    power_dbm: Floats
    received: Floats
    sent: Floats
    link: NDArray[np.intp]
    channel: NDArray[np.intp]

    @property
    def ratio(self) -> Floats:
        """Share received."""
        ratio: Floats = self.received / self.sent
        return ratio

    def fit(self, kept: NDArray[np.bool_], curve: CurveName) -> PrrFit:
        """A curve through some of the rows; raises ValueError as `fit_prr` does."""
        return fit_prr(self.power_dbm[kept], self.received[kept], self.sent[kept], self.link[kept], curve)


def reception_rows(log: TestbedLog, links: LinkMeans) -> Rows:
    """The rows that show reception against received power."""
    if log.per_frame:
        return Rows(links.rssi_dbm, links.received, links.sent, links.link, links.channel)
    return Rows(log.rssi_dbm, log.received, log.sent, log.link, log.channel)


def fit_reception(found: Calibration, links: LinkMeans) -> None:
    """Fit the curve and note what limits it."""
    rows = reception_rows(found.log, links)
    _note_unheard(found, links)
    found.floor_dbm = floor_dbm(rows.power_dbm, rows.ratio)
    kept = np.isfinite(rows.power_dbm)
    if found.floor_dbm is not None:
        at = kept & (rows.power_dbm <= found.floor_dbm + FLOOR_ROOM_DB)
        kept &= ~at
        found.notes.append(
            f"The receivers report no power below {found.floor_dbm:.1f} dBm: {np.count_nonzero(at):,} of {len(at):,} rows "
            f"are there, and receive from {rows.ratio[at].min():.0%} to {rows.ratio[at].max():.0%}. They do not count in "
            "the fit of reception, and in that of path loss only as no stronger."
        )
    curves: list[CurveName] = ["logistic", "erf"]
    try:
        fits = [rows.fit(kept, curve) for curve in curves]
    except ValueError as error:
        found.notes.append(f"No fit of reception against received power: it needs {error}.")
        _note_bound(found)
        return
    best = min(fits, key=lambda fit: fit.deviance)
    _note_strong(found, rows, best)
    _fit_channels(found, rows, kept, best.curve)
    if _is_below_floor(best, found.floor_dbm):
        _note_bound(found)
        return
    found.prr = tuple(sorted(fits, key=lambda fit: fit.deviance))
    found.noise_dbm = best.half_dbm - half_success_snr_db(found.frame_byte)
    found.noise_se_db = best.half_se_db


def _note_bound(found: Calibration) -> None:
    if found.floor_dbm is not None:
        most_dbm = found.floor_dbm - half_success_snr_db(found.frame_byte)
        found.notes.append(
            "The 50 % point of reception lies below what the receivers report, so neither it nor the noise can be told from "
            f"this log; the noise is at most {most_dbm:.1f} dBm, if their readings are right."
        )


def _is_below_floor(fit: PrrFit, floor: float | None) -> bool:
    return floor is not None and fit.half_dbm - 0.5 * fit.width_db < floor


def _note_strong(found: Calibration, rows: Rows, best: PrrFit) -> None:
    """How much strong links lose, with the channels apart."""
    at_least = max(best.half_dbm, found.floor_dbm or -np.inf) + STRONG_DB
    strong = np.isfinite(rows.power_dbm) & (rows.power_dbm >= at_least)
    for number in np.unique(rows.channel[strong]).tolist():
        here = strong & (rows.channel == number)
        found.strong_ratio[number] = float(rows.received[here].sum() / rows.sent[here].sum())
    lost = 1.0 - float(rows.received[strong].sum() / rows.sent[strong].sum()) if strong.any() else 0.0
    if lost > STRONG_LINKS_LOSE:
        found.notes.append(
            f"Links at {at_least:.0f} dBm and more lose {lost:.1%} of their frames: not to noise, but to interference of "
            "other networks or full queues. A medium without them does not have that."
        )


def _fit_channels(found: Calibration, rows: Rows, kept: NDArray[np.bool_], curve: CurveName) -> None:
    channels = np.unique(rows.channel).tolist()
    for number in channels if len(channels) > 1 else []:
        found.by_channel[number] = None
        try:
            fit = rows.fit(kept & (rows.channel == number), curve)
        except ValueError:
            continue
        if not _is_below_floor(fit, found.floor_dbm):
            found.by_channel[number] = fit


def _note_unheard(found: Calibration, links: LinkMeans) -> None:
    listed = len(np.unique(links.link))
    nodes = len(found.log.names)
    pairs = nodes * (nodes - 1)
    unheard = int(np.count_nonzero(links.received == 0))
    if unheard:
        found.notes.append(
            f"{unheard} links received nothing, so they have no power and do not count in the fit of reception."
        )
    if listed < pairs:
        found.notes.append(
            f"The log lists {listed} of the {pairs} ordered pairs of its {nodes} nodes; such a log usually leaves out "
            "links that received nothing."
        )
    found.notes.append(
        "Mean powers are over received frames only: below the 50 % point they are too high, which makes the curve steeper "
        "there than it is."
    )


def half_success_snr_db(frame_byte: int) -> float:
    """Signal to noise ratio at which half of the frames survive, by IEEE 802.15.4-2006 E.4.1.8.

    Args:
        frame_byte: Length of the PSDU; the length octet before it counts too.
    """
    bits = 8 * (frame_byte + 1)
    return float(
        brentq(lambda snr_db: frame_success_probability(float(10.0 ** (snr_db / 10.0)), bits) - 0.5, -10.0, 10.0)
    )
