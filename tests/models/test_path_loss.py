"""Link gains: the equation, reciprocity, keyed shadowing, its statistics, and dense against sparse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.models.path_loss import (
    LogDistanceParameters,
    audible_links,
    link_gains_db,
    path_loss_db,
    static_shadowing_db,
)
from netsim.models.reception import frame_success_probability
from netsim.rng import Streams

STREAMS = Streams(seed=7)
PLAIN = LogDistanceParameters(shadowing_sd_db=0.0)
ASYMMETRIC = LogDistanceParameters(asymmetry_sd_db=2.0)


def field(count: int, side_m: float = 200.0) -> np.ndarray:
    return np.random.default_rng(3).uniform(0.0, side_m, (count, 2))


def test_defaults_are_what_they_say() -> None:
    free_space = 20 * math.log10(4 * math.pi * 2.40e9 / 299_792_458)
    assert LogDistanceParameters().reference_loss_db == pytest.approx(free_space, abs=0.005)
    snr = 10 ** ((-95.0 - LogDistanceParameters().noise_dbm) / 10)
    assert frame_success_probability(snr, 160) == pytest.approx(0.99, abs=1e-3)


@pytest.mark.parametrize(
    ("distance_m", "loss_db"), [(0.0, 40.05), (0.5, 40.05), (1.0, 40.05), (10.0, 70.05), (100.0, 100.05)]
)
def test_loss_by_distance(distance_m: float, loss_db: float) -> None:
    assert path_loss_db(np.array([distance_m]), PLAIN) == pytest.approx([loss_db])


def test_reference_distance_scales() -> None:
    lora = LogDistanceParameters(exponent=2.08, reference_loss_db=127.41, reference_distance_m=40.0)
    assert path_loss_db(np.array([40.0, 400.0, 3.0]), lora) == pytest.approx([127.41, 148.21, 127.41])


@given(st.floats(0.0, 1e4), st.floats(0.0, 1e4))
def test_farther_is_never_louder(a: float, b: float) -> None:
    near, far = path_loss_db(np.sort([a, b]), PLAIN)
    assert near <= far


def test_gains_are_the_equation_pair_by_pair() -> None:
    positions, ids = field(12), [5, 0, 17, 3, 9, 1, 2, 44, 8, 30, 6, 7]
    gains = link_gains_db(positions, ids, ASYMMETRIC, STREAMS)
    for i, a in enumerate(ids):
        for j, b in enumerate(ids):
            if i == j:
                assert gains[i, j] == -math.inf
                continue
            low, high = sorted((a, b))
            shadow = 4.0 * STREAMS.generator(f"node/{high}/shadowing").standard_normal(low + 1)[low]
            half = 2.0 / 2 * STREAMS.generator(f"node/{high}/asymmetry").standard_normal(low + 1)[low]
            loss = 40.05 + 30.0 * math.log10(max(math.dist(positions[i], positions[j]), 1.0))
            assert gains[i, j] == pytest.approx(-loss + shadow + (half if a < b else -half), abs=1e-9)


def test_gains_are_reciprocal_without_asymmetry_and_only_then() -> None:
    symmetric = link_gains_db(field(30), range(30), LogDistanceParameters(), STREAMS)
    asymmetric = link_gains_db(field(30), range(30), ASYMMETRIC, STREAMS)
    upper = np.triu_indices(30, 1)
    assert np.array_equal(symmetric, symmetric.T)
    assert np.all(asymmetric[upper] != asymmetric.T[upper])
    np.testing.assert_allclose((asymmetric + asymmetric.T)[upper] / 2, symmetric[upper], atol=1e-9)


def test_shadowing_depends_on_the_ids_only() -> None:
    """A node with a higher id, another order, or a missing node: the link of two ids stays."""
    full = static_shadowing_db(range(10), STREAMS, 4.0)
    assert np.array_equal(static_shadowing_db(range(9), STREAMS, 4.0), full[:9, :9])
    some = [7, 2, 9, 4]
    assert np.array_equal(static_shadowing_db(some, STREAMS, 4.0), full[np.ix_(some, some)])
    assert np.array_equal(full, full.T)
    assert not np.any(np.diag(full))


def test_gains_contain_that_shadowing() -> None:
    positions, upper = field(20), np.triu_indices(20, 1)
    shadowed = link_gains_db(positions, range(20), LogDistanceParameters(shadowing_sd_db=3.0), STREAMS)
    difference = shadowed[upper] - link_gains_db(positions, range(20), PLAIN, STREAMS)[upper]
    np.testing.assert_allclose(difference, static_shadowing_db(range(20), STREAMS, 3.0)[upper], atol=1e-9)


def test_seed_and_repetition_draw_anew() -> None:
    draws = [static_shadowing_db(range(5), streams, 4.0)[0, 1] for streams in (STREAMS, Streams(8), Streams(7, 1))]
    assert len(set(draws)) == 3
    assert static_shadowing_db(range(5), Streams(7), 4.0)[0, 1] == draws[0]


def test_shadowing_statistics() -> None:
    """44,850 links: mean and deviation inside five standard errors, and a node's links are uncorrelated."""
    links = static_shadowing_db(range(300), STREAMS, 4.0)
    values = links[np.triu_indices(300, 1)]
    assert abs(values.mean()) < 5 * 4.0 / math.sqrt(len(values))
    assert abs(values.std() / 4.0 - 1.0) < 5 / math.sqrt(2 * len(values))
    row_means = links.sum(axis=1) / 299
    assert row_means.std() == pytest.approx(4.0 / math.sqrt(299), rel=5 / math.sqrt(2 * 300))


def test_asymmetry_statistics() -> None:
    gains = link_gains_db(field(300), range(300), ASYMMETRIC, STREAMS)
    difference = gains[np.triu_indices(300, 1)] - gains.T[np.triu_indices(300, 1)]
    assert abs(difference.std() / 2.0 - 1.0) < 5 / math.sqrt(2 * len(difference))


@pytest.mark.parametrize("parameters", [PLAIN, LogDistanceParameters(), ASYMMETRIC])
@pytest.mark.parametrize("floor_dbm", [-200.0, -100.0, -85.0, 0.0])
def test_sparse_links_are_the_dense_ones(parameters: LogDistanceParameters, floor_dbm: float) -> None:
    positions, ids = field(60), np.random.default_rng(1).permutation(90)[:60].tolist()
    power_dbm = np.linspace(-25.0, 5.0, 60)
    links = audible_links(positions, ids, power_dbm, floor_dbm, parameters, STREAMS)
    gains = link_gains_db(positions, ids, parameters, STREAMS)
    source, destination = np.nonzero(power_dbm[:, np.newaxis] + gains >= floor_dbm)
    assert np.array_equal(links.source, source)
    assert np.array_equal(links.destination, destination)
    assert np.array_equal(links.gain_db, gains[source, destination])


@pytest.mark.parametrize("count", [0, 1])
def test_few_nodes_have_no_links(count: int) -> None:
    links = audible_links(field(count), range(count), np.zeros(count), -200.0, LogDistanceParameters(), STREAMS)
    assert [len(column) for column in links] == [0, 0, 0]
    assert link_gains_db(field(count), range(count), LogDistanceParameters(), STREAMS).shape == (count, count)
