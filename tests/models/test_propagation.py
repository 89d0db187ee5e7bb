"""Moving nodes: links after any moves are those of a fresh start there, exactly, and what was drawn stays with the pair."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.models.media import LogDistanceParameters, LossMedium, UnitDiskParameters
from netsim.models.path_loss import Links
from netsim.models.propagation import Propagation
from netsim.rng import Streams

IDS = [0, 2, 3, 7, 8, 11, 19, 20]
MEDIA: list[LossMedium] = [
    LogDistanceParameters(shadowing_sd_db=4.0, asymmetry_sd_db=1.5, hardware_covariance=((3.7, -3.3), (-3.3, 6.0))),
    LogDistanceParameters(shadowing_sd_db=0.0),
    UnitDiskParameters(radius_m=40.0, asymmetry_sd_db=1.0),
]
FLOOR_DBM = np.linspace(-95.0, -80.0, len(IDS))
POWER_DBM = np.linspace(-3.0, 0.0, len(IDS))


def propagation(positions_m: np.ndarray, medium: LossMedium) -> Propagation:
    return Propagation(positions_m, IDS, POWER_DBM, FLOOR_DBM, medium, Streams(3))


def start() -> np.ndarray:
    return np.random.default_rng(5).uniform(0, 90, (len(IDS), 2))


def touching(links: Links, index: list[int]) -> Links:
    return links.only(np.isin(links.source, index) | np.isin(links.destination, index))


def equal(a: Links, b: Links) -> bool:
    return all(np.array_equal(mine, theirs) for mine, theirs in zip(a, b, strict=True))


moves = st.lists(
    st.dictionaries(
        st.integers(0, len(IDS) - 1), st.tuples(st.floats(0, 90), st.floats(0, 90)), min_size=1, max_size=4
    ),
    min_size=1,
    max_size=4,
)


@pytest.mark.parametrize("medium", MEDIA)
@settings(max_examples=40, deadline=None)
@given(steps=moves)
def test_after_any_moves_links_are_those_of_a_fresh_start_there(
    medium: LossMedium, steps: list[dict[int, tuple[float, float]]]
) -> None:
    moving, where = propagation(start(), medium), start()
    for step in steps:
        index, to = np.array(list(step), np.intp), np.array(list(step.values()))
        where[index] = to
        found = moving.move(index, to)
        fresh = propagation(where, medium).links()
        assert equal(found, touching(fresh, list(step)))
        assert equal(moving.links(), fresh)


def test_going_away_and_coming_back_changes_nothing() -> None:
    moving = propagation(start(), MEDIA[0])
    before = touching(moving.links(), [2, 5])
    moving.move(np.array([2, 5]), np.array([[1e4, 1e4], [2e4, 0.0]]))
    assert len(touching(moving.links(), [2, 5]).source) == 0
    assert equal(moving.move(np.array([2, 5]), start()[[2, 5]]), before)


def test_the_caller_s_positions_stay_his() -> None:
    mine = start()
    propagation(mine, MEDIA[0]).move(np.array([0]), np.array([[1.0, 1.0]]))
    assert np.array_equal(mine, start())
