"""Ways of mobile nodes: where a node is at every time, and what a file of ways must look like."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.models.waypoints import Path, Waypoint, WaypointMobility, path_through, read_waypoints

S = 10**9


def way(*points):
    return [Waypoint(at_s=at_s, x_m=x_m, y_m=y_m) for at_s, x_m, y_m in points]


def test_straight_lines_at_even_speed_and_then_rest():
    path = path_through((0.0, 0.0), way((10, 20, 0), (15, 20, 10)))
    at = {0: (0, 0), 2.5: (5, 0), 10: (20, 0), 12.5: (20, 5), 15: (20, 10), 1000: (20, 10)}
    assert {time_s: path.at(int(time_s * S)) for time_s in at} == at
    assert path.end_ns == 15 * S


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 10**6), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)), min_size=1, max_size=6),
    st.integers(0, 10**7),
)
def test_a_node_never_leaves_the_box_of_its_leg(points, time_ns):
    times = [0]
    for gap, _, _ in points:
        times.append(times[-1] + gap)
    path = Path(tuple(times), ((0.0, 0.0), *((x, y) for _, x, y in points)))
    leg = max(index for index, begin in enumerate(times) if begin <= time_ns)
    ends = path.points_m[leg : leg + 2]
    for axis in (0, 1):
        low, high = min(end[axis] for end in ends), max(end[axis] for end in ends)
        assert low - 1e-9 <= path.at(time_ns)[axis] <= high + 1e-9


def test_a_file_of_ways(tmp_path):
    file = tmp_path / "ways.csv"
    file.write_text("node,at_s,x_m,y_m\n3,1,0,0\n4,2,5,5\n\n3,2.5,1,1\n", encoding="utf-8")
    assert read_waypoints(file) == {3: tuple(way((1, 0, 0), (2.5, 1, 1))), 4: tuple(way((2, 5, 5)))}


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("", "1: expected the header `node,at_s,x_m,y_m`, got ``"),
        ("id,t,x,y\n", "1: expected the header `node,at_s,x_m,y_m`, got `id,t,x,y`"),
        ("node,at_s,x_m,y_m\n1,2,3\n", "2: expected 4 columns, got 3"),
        ("node,at_s,x_m,y_m\nn1,2,3,4\n", "2: node: expected the id of a node, got `n1`"),
        (
            "node,at_s,x_m,y_m\n1,2,3,4\n1,2,3,4\n",
            "3: at_s: expected a time above 2 s, got `2`; order the rows of a node",
        ),
        ("node,at_s,x_m,y_m\n1,0,3,4\n", "2: at_s: expected a time above 0 s, got `0`"),
        ("node,at_s,x_m,y_m\n1,2,nan,4\n", "2: x_m: expected a number of metres, got `nan`"),
        ("node,at_s,x_m,y_m\n1,inf,1,4\n", "2: at_s: expected a time above 0 s, got `inf`"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_line(tmp_path, text, finding):
    file = tmp_path / "ways.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        read_waypoints(file)
    assert f"{file}:{finding}" in str(caught.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ScenarioError, match="expected a CSV file of waypoints"):
        read_waypoints(tmp_path / "none.csv")


@pytest.mark.parametrize("settings", [{}, {"points": tuple(way((1, 0, 0))), "file": "a.csv"}])
def test_points_or_a_file(settings):
    with pytest.raises(ValueError, match="either points or a file"):
        WaypointMobility(**settings)


def test_points_in_order():
    with pytest.raises(ValueError, match="order of their times"):
        WaypointMobility(points=tuple(way((2, 0, 0), (1, 0, 0))))
