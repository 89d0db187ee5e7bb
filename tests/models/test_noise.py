"""Noise: the distribution in dB, steps in any order, each node its own, replay in a circle, and files that are wrong."""

import math
from pathlib import Path

import numpy as np
import pytest

from netsim.errors import ScenarioError
from netsim.models.noise import (
    BLOCK_STEPS,
    Background,
    ConstantNoiseParameters,
    GaussianNoiseParameters,
    NoiseParameters,
    ReplayedNoiseParameters,
    background,
)
from netsim.rng import Streams

NONE = np.zeros(3)


def made(parameters: NoiseParameters, folder: Path, ids: list[int], offset_db: np.ndarray) -> Background:
    return background(parameters, -100.0, offset_db, ids, Streams(4), folder)


def dbm(power_mw: np.ndarray) -> np.ndarray:
    return 10 * np.log10(power_mw)


def steps(noise: Background, numbers: range) -> np.ndarray:
    return np.array([dbm(noise.noise.power_mw(step)) for step in numbers])


def test_constant_noise_has_one_step(tmp_path: Path) -> None:
    noise = made(ConstantNoiseParameters(), tmp_path, [0, 4, 9], np.array([0.0, 2.0, -1.0]))
    assert noise.noise.step_ns is None
    assert dbm(noise.noise.power_mw(0)) == pytest.approx([-100, -98, -101])
    assert noise.typical_dbm.tolist() == noise.quiet_dbm.tolist() == [-100, -98, -101]


def test_gaussian_noise_is_normal_in_db(tmp_path: Path) -> None:
    """20,000 steps of three nodes: mean, deviation and correlation of nodes and of steps inside five standard errors."""
    noise = made(GaussianNoiseParameters(sd_db=4.0, step_s=0.002), tmp_path, [0, 4, 9], np.array([0.0, 2.0, -1.0]))
    assert noise.noise.step_ns == 2_000_000
    seen = steps(noise, range(20_000)) - np.array([-100, -98, -101])
    assert np.all(np.abs(seen.mean(axis=0)) < 5 * 4.0 / math.sqrt(20_000))
    assert np.all(np.abs(seen.std(axis=0) / 4.0 - 1) < 5 / math.sqrt(40_000))
    apart = np.corrcoef(seen.T)[np.triu_indices(3, 1)]
    after = [np.corrcoef(column[:-1], column[1:])[0, 1] for column in seen.T]
    assert np.all(np.abs([*apart, *after]) < 5 / math.sqrt(20_000))
    assert dbm(noise.noise.typical_mw) == pytest.approx([-100, -98, -101])
    assert noise.quiet_dbm.tolist() == [-112, -110, -113]


def test_steps_may_be_asked_in_any_order(tmp_path: Path) -> None:
    parameters = GaussianNoiseParameters()
    one, other = (made(parameters, tmp_path, [0, 4, 9], NONE) for _ in range(2))
    numbers = [0, BLOCK_STEPS - 1, BLOCK_STEPS, 10 * BLOCK_STEPS + 3, 1, 5 * BLOCK_STEPS]
    forward = {step: one.noise.power_mw(step).tolist() for step in numbers}
    assert {step: other.noise.power_mw(step).tolist() for step in sorted(numbers, reverse=True)} == forward
    assert len({tuple(row) for row in forward.values()}) == len(numbers)


def test_each_node_has_its_own_noise_whoever_else_is_there(tmp_path: Path) -> None:
    (tmp_path / "n.txt").write_text("\n".join(str(-90 - number % 17) for number in range(500)))
    for parameters in (GaussianNoiseParameters(), ReplayedNoiseParameters(file="n.txt")):
        three = made(parameters, tmp_path, [0, 4, 9], NONE).noise
        two = made(parameters, tmp_path, [4, 9], NONE[:2]).noise
        for step in (0, 77, 3000):
            assert two.power_mw(step).tolist() == three.power_mw(step)[1:].tolist()


def test_readings_are_replayed_in_a_circle_from_a_place_of_each_node(tmp_path: Path) -> None:
    readings = [-90 - number for number in range(40)]
    (tmp_path / "n.txt").write_text("\n".join(map(str, readings)) + "\n\n")
    noise = made(ReplayedNoiseParameters(file="n.txt"), tmp_path, list(range(30)), np.zeros(30))
    seen = np.round(steps(noise, range(80)))
    for column in seen.T:
        start = readings.index(int(column[0]))
        assert column.tolist() == (readings[start:] + readings[:start]) * 2
    assert len(set(seen[0].tolist())) > 15
    assert noise.noise.step_ns == 1_000_000
    assert noise.typical_dbm[0] == np.median(readings)


def test_readings_can_be_shifted_and_nodes_differ(tmp_path: Path) -> None:
    (tmp_path / "n.txt").write_text("-98\n-97\n-96\n-50\n-99\n")
    noise = made(
        ReplayedNoiseParameters(file="n.txt", median_dbm=-103.0), tmp_path, [0, 1, 2], np.array([0.0, 1.5, -2.0])
    )
    assert noise.typical_dbm.tolist() == [-103.0, -101.5, -105.0]
    assert dbm(noise.noise.typical_mw) == pytest.approx(noise.typical_dbm)
    seen = steps(noise, range(5))
    np.testing.assert_allclose(np.sort(seen, axis=0)[:, 1], np.array([-105, -104, -103, -102, -56]) + 1.5)


@pytest.mark.parametrize(
    ("text", "line", "got"),
    [("-98\nloud\n", 2, "'loud'"), ("", 1, "none"), ("-98\n\n400\n", 3, "'400'"), ("nan\n", 1, "'nan'")],
)
def test_wrong_files_are_refused_with_their_line(tmp_path: Path, text: str, line: int, got: str) -> None:
    (tmp_path / "n.txt").write_text(text)
    with pytest.raises(ScenarioError) as raised:
        made(ReplayedNoiseParameters(file="n.txt"), tmp_path, [0], NONE[:1])
    assert f"n.txt:{line}: " in str(raised.value)
    assert got in str(raised.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"none\.txt.*check the path"):
        made(ReplayedNoiseParameters(file="none.txt"), tmp_path, [0], NONE[:1])


def test_the_library_s_noise(measured_data: Path) -> None:
    noise = made(ReplayedNoiseParameters(file="meyer-heavy.txt"), measured_data, [0, 1, 2], NONE)
    assert noise.typical_dbm.tolist() == [-84.0] * 3
    whole = dbm(noise.noise.readings_mw)  # type: ignore[attr-defined]
    assert len(whole) == 196_608
    assert (whole.mean(), whole.std()) == pytest.approx((-87.40, 9.82), abs=0.005)
    assert np.quantile(whole, 0.99) == pytest.approx(-41.0)
