"""The link generator with TOSSIM's parameters against the file that TOSSIM's generator made: 15 x 15 nodes, 10 m apart.

Both are one draw of a random layout, so they are compared by the spread of our draws over seeds. The fit is over all ordered
pairs: a sender's output power (variance 6 dB^2) then counts as shadowing, which gives sqrt(4^2 + 6) = 4.69 dB.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from netsim.kernels.path_loss_fit import asymmetry_sd_db, fit_path_loss
from netsim.models.gain_file import read_gains
from netsim.models.hardware import hardware_offsets
from netsim.models.media import LogDistanceParameters
from netsim.models.path_loss import link_gains_db
from netsim.rng import Streams

MICA2 = ((3.7, -3.3), (-3.3, 6.0))
TOSSIM = LogDistanceParameters(
    exponent=3.0, reference_loss_db=55.0, shadowing_sd_db=4.0, noise_dbm=-105.0, hardware_covariance=MICA2
)
ROW, COLUMN = np.divmod(np.arange(225), 15)
POSITIONS_M = 10.0 * np.column_stack([COLUMN, ROW]).astype(float)
SEEDS = range(20)
STATISTICS = ("exponent", "loss at 1 m", "shadowing sd", "asymmetry sd", "noise mean", "noise sd", "noise with power")


def statistics(gains_db: np.ndarray, noise_dbm: np.ndarray) -> np.ndarray:
    source, destination = np.nonzero(np.isfinite(gains_db))
    distance_m = np.hypot(*(POSITIONS_M[source] - POSITIONS_M[destination]).T)
    fit = fit_path_loss(distance_m, gains_db[source, destination])
    finite = np.where(np.isfinite(gains_db), gains_db, 0.0)
    power_db = (finite - finite.T).sum(axis=1) / 225
    together = np.cov(noise_dbm, power_db)[0, 1]
    return np.array(
        [
            fit.exponent,
            fit.reference_loss_db,
            fit.shadowing_sd_db,
            asymmetry_sd_db(gains_db),
            noise_dbm.mean(),
            noise_dbm.std(ddof=1),
            together,
        ]
    )


@cache
def generated() -> np.ndarray:
    """(seeds, statistics) of our generator."""
    rows = []
    for seed in SEEDS:
        gains = link_gains_db(POSITIONS_M, range(225), TOSSIM, Streams(seed))
        noise = TOSSIM.noise_dbm + hardware_offsets(range(225), MICA2, Streams(seed)).noise_db
        rows.append(statistics(gains, noise))
    return np.array(rows)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("exponent", 3.0),
        ("loss at 1 m", 55.0),
        ("shadowing sd", (4.0**2 + 6.0) ** 0.5),
        ("asymmetry sd", (2 * 6.0) ** 0.5),
        ("noise mean", -105.0),
        ("noise sd", 3.7**0.5),
        ("noise with power", -3.3),
    ],
)
def test_the_generator_gives_what_it_was_given(name: str, expected: float) -> None:
    """The mean over twenty seeds inside four of its standard errors."""
    found = generated()[:, STATISTICS.index(name)]
    assert abs(found.mean() - expected) < 4 * found.std(ddof=1) / len(SEEDS) ** 0.5


@pytest.mark.parametrize("name", STATISTICS)
def test_the_file_lies_within_the_spread_of_the_generator(measured_data: Path, name: str) -> None:
    """A prediction interval at 99.9 %: t of 19 degrees times the deviation over seeds, sqrt(1 + 1/20) wider."""
    read = read_gains(measured_data / "15-15-medium-mica2-grid.txt")
    gains = np.full((225, 225), -np.inf)
    gains[read.source, read.destination] = read.gain_db
    noise = np.array([read.noise[node][0] for node in range(225)])
    number = STATISTICS.index(name)
    ours, theirs = generated()[:, number], statistics(gains, noise)[number]
    assert abs(theirs - ours.mean()) < 3.883 * ours.std(ddof=1) * (1 + 1 / len(SEEDS)) ** 0.5
