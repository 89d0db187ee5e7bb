"""The formulas of Table 2 by hand, and how they grow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.kernels.table2 import Cost, centralised, distributed


def test_a_step_by_hand():
    """100 cells, 3 neighbours, 800 bits over 20 m; five sensors 10 m to 50 m from the centre."""
    assert distributed(100, 3, 800.0, 20.0) == Cost(300.0, 800.0, pytest.approx(10e-12 * 800 * 400))
    centre = centralised(100, 800.0, np.array([10.0, 20.0, 30.0, 40.0, 50.0]))
    assert centre == Cost(500.0, 4000.0, pytest.approx(10e-12 * 800 * 5500))
    total = distributed(100, 3, 800.0, 20.0) + centre
    assert (total.operations, total.bit) == (800.0, 4800.0)


@given(st.integers(1, 500), st.floats(1.0, 1e4), st.lists(st.floats(0.1, 300.0), min_size=1, max_size=40))
def test_the_centre_pays_for_every_sensor_what_a_single_one_would(cells, bit, distances_m):
    whole = centralised(cells, bit, np.array(distances_m))
    parts = [centralised(cells, bit, np.array([distance_m])) for distance_m in distances_m]
    assert whole.operations == sum(part.operations for part in parts)
    assert whole.bit == pytest.approx(sum(part.bit for part in parts))
    assert whole.joules == pytest.approx(sum(part.joules for part in parts))
    assert centralised(cells, bit, 2.0 * np.array(distances_m)).joules == pytest.approx(4.0 * whole.joules)
