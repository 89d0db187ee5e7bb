"""Hardware offsets: the covariance that was asked for, one draw a node by its id, and the asymmetry that follows."""

import math

import numpy as np
import pytest

from netsim.kernels.path_loss_fit import asymmetry_sd_db
from netsim.models.hardware import hardware_offsets
from netsim.models.media import LogDistanceParameters
from netsim.models.path_loss import link_gains_db
from netsim.rng import Streams

MICA2 = ((3.7, -3.3), (-3.3, 6.0))


def test_the_covariance_is_what_was_asked_for() -> None:
    """4000 nodes: each entry inside five standard errors, sqrt((c_ii c_jj + c_ij^2) / N)."""
    drawn = np.cov(np.vstack(hardware_offsets(range(4000), MICA2, Streams(5))))
    for i in range(2):
        for j in range(2):
            error = math.sqrt((MICA2[i][i] * MICA2[j][j] + MICA2[i][j] ** 2) / 4000)
            assert abs(drawn[i, j] - MICA2[i][j]) < 5 * error


def test_a_draw_belongs_to_its_node() -> None:
    all_of_them = hardware_offsets(range(10), MICA2, Streams(5))
    some = hardware_offsets([7, 2], MICA2, Streams(5))
    assert some.noise_db.tolist() == all_of_them.noise_db[[7, 2]].tolist()
    assert some.power_db.tolist() == all_of_them.power_db[[7, 2]].tolist()
    assert hardware_offsets([7], MICA2, Streams(6)).power_db != some.power_db[0]


@pytest.mark.parametrize("covariance", [((0.0, 0.0), (0.0, 4.0)), ((4.0, 0.0), (0.0, 0.0)), ((4.0, -4.0), (-4.0, 4.0))])
def test_edges_of_what_is_a_covariance(covariance: tuple[tuple[float, float], tuple[float, float]]) -> None:
    offsets = hardware_offsets(range(50), covariance, Streams(1))
    assert bool(np.any(offsets.noise_db)) == (covariance[0][0] > 0)
    assert bool(np.any(offsets.power_db)) == (covariance[1][1] > 0)
    if covariance[0][1]:
        np.testing.assert_allclose(offsets.power_db, -offsets.noise_db)


def test_nobody_differs_without_one() -> None:
    assert not np.any(np.concatenate(hardware_offsets(range(5), None, Streams(1))))
    assert [len(each) for each in hardware_offsets([], MICA2, Streams(1))] == [0, 0]


def test_the_sender_s_power_is_in_all_its_gains_and_makes_them_asymmetric() -> None:
    positions = np.random.default_rng(1).uniform(0, 100, (40, 2))
    plain = LogDistanceParameters(shadowing_sd_db=4.0)
    uneven = LogDistanceParameters(shadowing_sd_db=4.0, hardware_covariance=MICA2)
    upper = np.triu_indices(40, 1)
    gains = link_gains_db(positions, range(40), uneven, Streams(3))
    power = hardware_offsets(range(40), MICA2, Streams(3)).power_db
    expected = link_gains_db(positions, range(40), plain, Streams(3)) + power[:, None]
    assert np.array_equal(gains, expected)
    np.testing.assert_allclose(gains[upper] - gains.T[upper], (power[:, None] - power[None, :])[upper], atol=1e-9)
    assert asymmetry_sd_db(gains) == pytest.approx(math.sqrt(2.0 * power.var(ddof=1)))
