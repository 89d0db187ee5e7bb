"""Loss laws of the media, golden values and laws; and what their records refuse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.models.fading import RayleighFading
from netsim.models.media import (
    FreeSpaceParameters,
    LogDistanceParameters,
    LossMedium,
    TraceMediumParameters,
    TwoSlopeParameters,
    UnitDiskParameters,
)
from netsim.models.noise import ConstantNoiseParameters, GaussianNoiseParameters, ReplayedNoiseParameters
from netsim.models.path_loss import audible_links, link_gains_db
from netsim.rng import Streams

MICA2 = ((3.7, -3.3), (-3.3, 6.0))
STANDARD = TwoSlopeParameters(breakpoint_loss_db=58.5)
MEDIA: list[LossMedium] = [
    UnitDiskParameters(radius_m=40.0),
    FreeSpaceParameters(),
    LogDistanceParameters(),
    TwoSlopeParameters(),
    STANDARD,
]


def loss(medium: LossMedium, distance_m: float) -> float:
    return float(medium.loss_db(np.array([distance_m]))[0])


def test_a_disk_has_an_edge() -> None:
    disk = UnitDiskParameters(radius_m=30.0, received_power_dbm=-55.0)
    assert [loss(disk, d) for d in (0.0, 12.0, 30.0, 30.0001)] == [55.0, 55.0, 55.0, math.inf]


@pytest.mark.parametrize(
    ("frequency_hz", "distance_m", "expected"),
    [(2.405e9, 1.0, 40.0703), (2.405e9, 100.0, 80.0703), (868e6, 1000.0, 91.2187), (2.405e9, 0.0, 40.0703)],
)
def test_free_space(frequency_hz: float, distance_m: float, expected: float) -> None:
    """32.4478 + 20 log10(f in MHz) + 20 log10(d in km), the form of ITU-R P.525."""
    assert loss(FreeSpaceParameters(frequency_hz=frequency_hz), distance_m) == pytest.approx(expected, abs=1e-3)
    itu = 32.4478 + 20 * math.log10(frequency_hz / 1e6) + 20 * math.log10(max(distance_m, 1.0) / 1000)
    assert expected == pytest.approx(itu, abs=1e-3)


@pytest.mark.parametrize(("distance_m", "expected"), [(0.5, 40.2), (1, 40.2), (8, 58.26), (80, 91.26)])
def test_two_slopes_meet(distance_m: float, expected: float) -> None:
    assert loss(TwoSlopeParameters(), distance_m) == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize(("distance_m", "expected"), [(1, 40.2), (4, 52.24), (8.001, 58.502), (80, 91.5)])
def test_two_slopes_of_the_standard(distance_m: float, expected: float) -> None:
    """IEEE 802.15.4 for 2.4 GHz, as INET has it: 40.2 + 20 log10(d) to 8 m, 58.5 + 33 log10(d / 8) beyond."""
    assert loss(STANDARD, distance_m) == pytest.approx(expected, abs=1e-2)


@pytest.mark.parametrize("medium", MEDIA)
@given(a=st.floats(0.0, 1e4), b=st.floats(0.0, 1e4))
def test_farther_is_never_louder(medium: LossMedium, a: float, b: float) -> None:
    near, far = medium.loss_db(np.sort([a, b]))
    assert near <= far


@pytest.mark.parametrize("medium", MEDIA)
def test_sparse_links_are_the_dense_ones(medium: LossMedium) -> None:
    rng, ids = np.random.default_rng(4), [3, 0, 9, 4, 12, 7, 8, 1]
    made = type(medium)(hardware_covariance=MICA2, shadowing_sd_db=3.0, asymmetry_sd_db=1.0)
    positions, power_dbm, floor_dbm = rng.uniform(0, 80, (8, 2)), np.linspace(-10, 0, 8), rng.uniform(-90, -60, 8)
    links = audible_links(positions, ids, power_dbm, floor_dbm, made, Streams(2))
    gains = link_gains_db(positions, ids, made, Streams(2))
    source, destination = np.nonzero(power_dbm[:, None] + gains >= floor_dbm)
    assert (links.source.tolist(), links.destination.tolist()) == (source.tolist(), destination.tolist())
    assert np.array_equal(links.gain_db, gains[source, destination])


@pytest.mark.parametrize("covariance", [((1.0, 0.5), (0.4, 1.0)), ((1.0, 2.0), (2.0, 1.0)), ((-1.0, 0.0), (0.0, 1.0))])
def test_what_is_no_covariance_is_refused(covariance: tuple[tuple[float, float], tuple[float, float]]) -> None:
    for kind in (UnitDiskParameters, FreeSpaceParameters, LogDistanceParameters, TwoSlopeParameters):
        with pytest.raises(ValueError, match="positive semidefinite"):
            kind(hardware_covariance=covariance)
        kind(hardware_covariance=((1.0, 1.0), (1.0, 1.0)))


def test_settings_that_would_be_ignored_are_refused() -> None:
    replayed = ReplayedNoiseParameters(file="noise.txt")
    with pytest.raises(ValueError, match=r"noise\.median_dbm"):
        LogDistanceParameters(noise_dbm=-90.0, noise=replayed)
    with pytest.raises(ValueError, match="breakpoint_m"):
        TwoSlopeParameters(breakpoint_m=0.5)
    for extra in ({"fading": RayleighFading()}, {"noise": GaussianNoiseParameters()}, {"noise": replayed}):
        with pytest.raises(ValueError, match="format k7"):
            TraceMediumParameters(file="x", format="k7", **extra)
        TraceMediumParameters(file="x", format="tossim", **extra)
    TraceMediumParameters(file="x", format="k7", noise=ConstantNoiseParameters())
