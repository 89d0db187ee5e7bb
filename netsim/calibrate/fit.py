"""What a log says of the air: reception against received power, path loss, shadowing, asymmetry, change in time.

A mean received power is a mean over received frames: a link that loses most of them looks better than it is, and one that
loses all has none. Links that receive less than half of what strong links do therefore count, in the fit of path loss, as
known to be below the 50 % point and no more; where the log lists only links it heard, the fit allows for those it does not
list (see `netsim.kernels.censored_path_loss`).
"""

import numpy as np

from netsim.calibrate.found import Calibration, Options
from netsim.calibrate.links import distances, link_means, mean_variances, variation, with_unlisted
from netsim.calibrate.log import TestbedLog
from netsim.calibrate.loss import fit_loss
from netsim.calibrate.reception import fit_reception
from netsim.errors import ScenarioError

DEFAULT_FRAME_BYTE = 100


def calibrate(log: TestbedLog, options: Options | None = None) -> Calibration:
    """Fit everything the log allows.

    Raises:
        ScenarioError: If no row is of the wanted channel, or a node of the log has no position in a file that is given.
    """
    options = options or Options()
    log = _of_channel(log, options.channel)
    found = Calibration(log, options.frame_byte or log.frame_byte or DEFAULT_FRAME_BYTE)
    if options.frame_byte is None and log.frame_byte is None:
        found.notes.append(f"The log does not say how long the frames were: taken as {DEFAULT_FRAME_BYTE} bytes.")
    if log.corrected:
        found.notes.append(log.corrected)
    links = link_means(log)
    fit_reception(found, links)
    found.variation = variation(log)
    variances = mean_variances(log, links)
    links = with_unlisted(links, len(log.names)) if options.positions else links
    distance_m = distances(log, links, options.positions)
    if np.isfinite(distance_m).any():
        if variances is not None:
            variances = np.append(variances, np.zeros(len(links.link) - len(variances)))
        fit_loss(found, links, distance_m, options, variances)
    else:
        found.notes.append("Neither distances nor positions: path loss, shadowing and asymmetry are left out.")
    return found


def _of_channel(log: TestbedLog, channel: int | None) -> TestbedLog:
    if channel is None:
        return log
    kept = log.channel == channel
    if not kept.any():
        there = ", ".join(map(str, np.unique(log.channel[log.channel > 0]).tolist())) or "none"
        message = f"{log.path}: no row of channel {channel}; channels in the log: {there}"
        raise ScenarioError(message)
    return log.only(kept)
