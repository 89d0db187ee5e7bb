"""What a calibration is asked and what it finds."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from netsim.calibrate.links import Variation
from netsim.calibrate.log import TestbedLog
from netsim.kernels.censored_path_loss import CensoredPathLossFit
from netsim.kernels.path_loss_fit import PathLossFit
from netsim.kernels.prr_fit import PrrFit
from netsim.models.node_files import PlacedNode

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Options:
    """What the log does not say.

    Attributes:
        positions: Where the nodes stand; matched with the log by name, else by id.
        channel: Only rows of this channel count; by default all.
        frame_byte: Length of the frames (PSDU); by default what the log says, else 100.
        tx_power_dbm: Transmit power of rows that do not say theirs; by default 0.
    """

    positions: Sequence[PlacedNode] = ()
    channel: int | None = None
    frame_byte: int | None = None
    tx_power_dbm: float | None = None


@dataclass(frozen=True, slots=True)
class PathLoss:
    """Path loss and what goes with it.

    Attributes:
        fit: Maximum likelihood, unseen links considered.
        plain: Least squares through the links seen, for comparison; None where it cannot be computed.
        shadowing_sd_db: Of a pair: the deviation about the line without the shares of the asymmetry and (a log
            of frames) of sampling noise.
        asymmetry_sd_db: Of the difference of two directions; None without a pair seen both ways. Of a log of
            frames, without sampling noise.
        asymmetry_se_db: Its standard error.
        pairs: Pairs seen both ways.
        limit_dbm: Received power below which a link counts as unseen.
        distance_m: For the plot: of every link.
        gain_db: For the plot: of every link, NaN where unseen.
    """

    fit: CensoredPathLossFit
    plain: PathLossFit | None
    shadowing_sd_db: float
    asymmetry_sd_db: float | None
    asymmetry_se_db: float
    pairs: int
    limit_dbm: float
    distance_m: Floats
    gain_db: Floats


@dataclass(slots=True)
class Calibration:
    """Everything found.

    Attributes:
        log: The rows that counted.
        frame_byte: Length of the frames that the noise was computed for.
        prr: Fits of reception against received power, the best first; empty if there is none.
        noise_dbm: Noise at which the 802.15.4 formula has its 50 % point where the best fit has it.
        noise_se_db: Its standard error.
        floor_dbm: Least power that the receivers report, where many links lie there; None if none does.
        by_channel: The fit of each channel, where the log has several; None where there is none.
        strong_ratio: By channel, what links receive that are well above both the 50 % point and the floor.
        path_loss: Path loss and shadowing; None without distances.
        variation: How received powers change; None if nothing is repeated.
        notes: What was left out and why, what to be careful about.
    """

    log: TestbedLog
    frame_byte: int
    prr: tuple[PrrFit, ...] = ()
    noise_dbm: float | None = None
    noise_se_db: float = 0.0
    floor_dbm: float | None = None
    by_channel: dict[int, PrrFit | None] = field(default_factory=dict)
    strong_ratio: dict[int, float] = field(default_factory=dict)
    path_loss: PathLoss | None = None
    variation: Variation | None = None
    notes: list[str] = field(default_factory=list)
