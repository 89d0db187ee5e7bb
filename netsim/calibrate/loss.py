"""Path loss, shadowing and asymmetry from the links of a log."""

import numpy as np
from numpy.typing import NDArray

from netsim.calibrate.found import Calibration, Options, PathLoss
from netsim.calibrate.links import FLOOR_ROOM_DB, LinkMeans, asymmetry
from netsim.kernels.censored_path_loss import fit_censored_path_loss
from netsim.kernels.path_loss_fit import fit_path_loss

Floats = NDArray[np.float64]

MOST_EXPONENT = 10.0
"""The schema's bound."""


def fit_loss(
    found: Calibration, links: LinkMeans, distance_m: Floats, options: Options, variances: Floats | None = None
) -> None:
    """Path loss from the links; those below the 50 % point count as unseen.

    Args:
        found: Where it goes.
        links: The links.
        distance_m: Of each link.
        options: What the user gave.
        variances: Of the links' mean powers, by the sampling of frames; None where unknown.
    """
    power_dbm = links.tx_power_dbm
    if np.isnan(power_dbm).any():
        assumed = 0.0 if options.tx_power_dbm is None else options.tx_power_dbm
        if options.tx_power_dbm is None:
            found.notes.append("The log does not say the transmit power: taken as 0 dBm.")
        power_dbm = np.where(np.isnan(power_dbm), assumed, power_dbm)
    seen, limit_dbm = _seen(found, links)
    seen &= np.isfinite(distance_m)
    if not seen.any():
        found.notes.append("No link with a known distance received half of its frames: no fit of path loss.")
        return
    gain_db = np.where(seen, links.rssi_dbm - power_dbm, np.nan)
    has_unseen = bool(options.positions) or bool((np.isfinite(distance_m) & (links.received == 0)).any())
    kept = np.isfinite(distance_m) & (seen | has_unseen)
    try:
        fit = fit_censored_path_loss(
            distance_m[kept], gain_db[kept], (limit_dbm - power_dbm)[kept], links.pair[kept], truncated=not has_unseen
        )
    except ValueError as error:
        found.notes.append(f"No fit of path loss: it needs {error}.")
        return
    sd_db, se_db, pairs = asymmetry(links, gain_db, variances)
    sampling_db2 = None if variances is None else float(np.mean(variances[seen]))
    own = fit.sd_db**2 - 0.25 * (sd_db or 0.0) ** 2 - (sampling_db2 or 0.0)
    found.notes.append(_sampling_note(sampling_db2))
    try:
        plain = fit_path_loss(distance_m[seen], gain_db[seen])
    except ValueError:
        plain = None
    if not 0.0 < fit.exponent <= MOST_EXPONENT:
        found.notes.append(f"The fitted exponent is {fit.exponent:.2f}: the log's distances do not explain its powers.")
    found.path_loss = PathLoss(
        fit, plain, max(0.0, own) ** 0.5, sd_db, se_db, pairs, limit_dbm, distance_m[kept], gain_db[kept]
    )


def _sampling_note(sampling_db2: float | None) -> str:
    if sampling_db2 is None:
        return (
            "The log does not say how power varied from frame to frame: the sampling noise of a link's mean counts as "
            "shadowing and as a difference of directions, which come out too large by it."
        )
    return (
        f"A link's mean varies by {sampling_db2**0.5:.2f} dB (root mean square) because it is over a few frames: that is "
        "taken off the shadowing and off the difference of directions, as if frames varied independently."
    )


def _seen(found: Calibration, links: LinkMeans) -> tuple[NDArray[np.bool_], float]:
    """Which links' powers can be trusted, and the power below which they cannot.

    A link below the 50 % point is unseen: its mean is over its luckier frames. One that loses as much although it lies well
    above, beyond the curve's width, loses to something else than noise, and its power is sound.
    """
    floor = -np.inf if found.floor_dbm is None else found.floor_dbm + FLOOR_ROOM_DB
    power_dbm = np.where(np.isfinite(links.rssi_dbm), links.rssi_dbm, -np.inf)
    if not found.prr:
        good = (power_dbm > floor) & (links.received >= 0.5 * links.sent)
        return good, max(floor, float(links.rssi_dbm[good].min())) if good.any() else 0.0
    best = found.prr[0]
    half = links.received >= 0.5 * best.ceiling * links.sent
    limit_dbm = max(best.half_dbm, floor)
    seen = (half & (power_dbm >= limit_dbm)) | (power_dbm >= limit_dbm + best.width_db)
    return seen, limit_dbm
