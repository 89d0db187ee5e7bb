"""Sensors: what a reading costs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.models.sensors import SensorParameters, sensor_device


def test_default_is_the_mica2_sensor_board() -> None:
    sensor = sensor_device(SensorParameters())
    assert sensor.power_mw == pytest.approx(0.7 * 3.0)
    assert sensor.sample_time_ns == 10_000_000
    assert sensor.energy_per_sample_j == pytest.approx(2.1e-5)


@given(st.floats(0.0, 1e3), st.floats(0.0, 10.0))
def test_energy_is_power_times_time(power_mw: float, sample_time_s: float) -> None:
    sensor = sensor_device(SensorParameters(power_mw=power_mw, sample_time_s=sample_time_s))
    assert sensor.energy_per_sample_j == pytest.approx(power_mw * 1e-3 * sample_time_s, rel=1e-9, abs=1e-9 * power_mw)
