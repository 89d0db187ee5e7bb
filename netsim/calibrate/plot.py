"""A picture of a calibration; matplotlib is loaded when it is called for."""

from pathlib import Path
from typing import Any

import numpy as np

from netsim.calibrate.found import Calibration
from netsim.calibrate.links import link_means
from netsim.calibrate.reception import half_success_snr_db, reception_rows
from netsim.errors import NetsimError
from netsim.models.reception import frame_success_probability

BLUE, ORANGE, GREY, RED = "#2166ac", "#e08214", "#737373", "#b2182b"
MOST_POINTS = 20_000


def plot_calibration(found: Calibration, path: Path) -> None:
    """Write a picture: reception against received power, and gain against distance where distances are known.

    Raises:
        NetsimError: If matplotlib is not installed, there is nothing to show, or the file cannot be written.
    """
    try:
        import matplotlib as mpl

        mpl.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError as error:
        message = "--plot needs matplotlib: pip install matplotlib"
        raise NetsimError(message) from error
    panels = [
        panel
        for panel, there in ((draw_reception, found.prr or found.floor_dbm), (draw_path_loss, found.path_loss))
        if there
    ]
    if not panels:
        message = "nothing was fitted, so there is nothing to plot"
        raise NetsimError(message)
    figure, axes = plt.subplots(1, len(panels), figsize=(6.6 * len(panels), 4.4), squeeze=False, layout="constrained")
    for axis, panel in zip(axes[0], panels, strict=True):
        panel(found, axis)
        axis.grid(alpha=0.25)
        axis.spines[["top", "right"]].set_visible(False)
    try:
        figure.savefig(path, dpi=150)
    except (OSError, ValueError) as error:
        message = f"cannot write {path}: {error}"
        raise NetsimError(message) from error
    finally:
        plt.close(figure)


def draw_reception(found: Calibration, axis: Any) -> None:
    """Rows, means in bins, the fitted curve, and the 802.15.4 curve at the equivalent noise."""
    rows = reception_rows(found.log, link_means(found.log))
    heard = np.isfinite(rows.power_dbm)
    power, ratio = rows.power_dbm[heard], rows.ratio[heard]
    step = max(1, len(power) // MOST_POINTS)
    axis.plot(power[::step], ratio[::step], ".", ms=2, color=GREY, alpha=0.25, rasterized=True, label="measured")
    low, high = float(power.min()) - 1.0, float(power.max())
    if found.floor_dbm is not None:
        axis.axvline(found.floor_dbm, color=RED, lw=1, label=f"receivers report no less than {found.floor_dbm:.0f} dBm")
    if found.prr:
        fit = found.prr[0]
        low, high = max(low, fit.half_dbm - 12.0), min(high, fit.half_dbm + 25.0)
        fine = np.linspace(low, high, 500)
        axis.plot(fine, fit.prr(fine), color=BLUE, lw=2, label=f"{fit.curve}, 50 % at {fit.half_dbm:.1f} dBm")
        snr_db = fine - fit.half_dbm + half_success_snr_db(found.frame_byte)
        formula = np.asarray(frame_success_probability(10.0 ** (snr_db / 10.0), 8 * (found.frame_byte + 1)))
        label = f"802.15.4 formula, noise {found.noise_dbm:.1f} dBm"
        axis.plot(fine, fit.ceiling * formula, "--", color=ORANGE, label=label)
    axis.set(xlabel="mean received power (dBm)", ylabel="packet reception ratio", xlim=(low, high))
    axis.legend(frameon=False, loc="lower right", markerscale=5)


def draw_path_loss(found: Calibration, axis: Any) -> None:
    """Gains, the two fits, and where unseen links are."""
    loss = found.path_loss
    if loss is None:
        return
    seen = np.isfinite(loss.gain_db)
    axis.semilogx(loss.distance_m[seen], loss.gain_db[seen], ".", ms=4, color=GREY, alpha=0.6, label="links seen")
    if (~seen).any():
        low = float(np.nanmin(loss.gain_db))
        axis.plot(loss.distance_m[~seen], np.full(np.count_nonzero(~seen), low - 2.0), "|", color=GREY, ms=6,
                  label="links unseen")  # fmt: skip
    fine = np.geomspace(float(loss.distance_m.min()), float(loss.distance_m.max()), 100)
    fit = loss.fit
    axis.plot(fine, -fit.reference_loss_db - 10.0 * fit.exponent * np.log10(fine), color=BLUE, lw=2,
              label=f"exponent {fit.exponent:.2f}, unseen links considered")  # fmt: skip
    if loss.plain is not None:
        plain = -loss.plain.reference_loss_db - 10.0 * loss.plain.exponent * np.log10(fine)
        axis.plot(fine, plain, "--", color=ORANGE, label=f"exponent {loss.plain.exponent:.2f}, seen links only")
    axis.set(xlabel="distance (m)", ylabel="gain (dB)")
    axis.legend(frameon=False)
