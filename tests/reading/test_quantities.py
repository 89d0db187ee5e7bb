import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.reading.quantities import convert, number_text, parse_quantity, split_key, unit_of
from netsim.reading.remedies import edit_distance, nearest


@pytest.mark.parametrize(
    ("key", "stem", "name"),
    [
        ("radius_m", "radius", "metres"),
        ("speed_m_per_s", "speed", "metres per second"),
        ("rate_per_s", "rate", "per second"),
        ("energy_nj_per_bit", "energy", "nanojoules per bit"),
        ("density_per_km2", "density", "per square kilometre"),
        ("tx_power_dbm", "tx_power", "dBm"),
        ("bitrate_bps", "bitrate", "bits per second"),
    ],
)
def test_unit_of_a_key(key: str, stem: str, name: str) -> None:
    found, unit = split_key(key)
    assert unit is not None
    assert (found, unit.name) == (stem, name)


@pytest.mark.parametrize("key", ["m", "count", "max_per_group", "edge_a", "", "_"])
def test_keys_without_unit(key: str) -> None:
    assert split_key(key) == (key, None)


@pytest.mark.parametrize(
    ("value", "source", "target", "expected"),
    [
        (0.005, "km", "m", 5.0),
        (10.0, "ms", "s", 0.01),
        (1.0, "min", "ms", 60000.0),
        (1.0, "mw", "dbm", 0.0),
        (20.0, "dbm", "mw", 100.0),
        (0.0, "mw", "dbm", None),
        (36.0, "km_per_h", "m_per_s", 10.0),
        (250.0, "kbit_per_s", "bps", 250000.0),
        (1.0, "mah", "ah", 0.001),
        (2.0, "byte", "bit", 16.0),
        (1.0, "m", "s", None),
        (180.0, "deg", "rad", float(f"{math.pi:.12g}")),
        (1e300, "dbm", "w", None),
    ],
)
def test_conversion(value: float, source: str, target: str, expected: float | None) -> None:
    have, want = unit_of(source), unit_of(target)
    assert have is not None
    assert want is not None
    assert convert(value, have, want) == expected


@pytest.mark.parametrize(
    ("text", "value", "suffix"),
    [
        ("5 m", 5.0, "m"),
        ("10ms", 10.0, "ms"),
        ("-3 dBm", -3.0, "dbm"),
        ("1e3 m/s", 1000.0, "m_per_s"),
        ("2 µs", 2.0, "us"),
    ],
)
def test_quantity(text: str, value: float, suffix: str) -> None:
    found = parse_quantity(text)
    assert found is not None
    assert (found[0], found[1].suffix) == (value, suffix)


@pytest.mark.parametrize("text", ["5", "m", "", "5 apples", "5 m of rope", "1e3"])
def test_no_quantity(text: str) -> None:
    assert parse_quantity(text) is None


def test_numbers_are_written_shortly() -> None:
    assert [number_text(value) for value in (5.0, 0.01, 1e20, -2.0)] == ["5", "0.01", "1e+20", "-2"]


def slow_distance(first: str, second: str) -> int:
    """The optimal string alignment distance by its recursion."""
    if not first or not second:
        return len(first) + len(second)
    best = min(
        slow_distance(first[:-1], second) + 1,
        slow_distance(first, second[:-1]) + 1,
        slow_distance(first[:-1], second[:-1]) + (first[-1] != second[-1]),
    )
    if len(first) > 1 and len(second) > 1 and first[-2:] == second[-1] + second[-2]:
        best = min(best, slow_distance(first[:-2], second[:-2]) + 1)
    return best


@given(st.text("abc", max_size=5), st.text("abc", max_size=5))
def test_edit_distance_equals_its_recursion(first: str, second: str) -> None:
    assert edit_distance(first, second) == slow_distance(first, second)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("cuont", "count"),
        ("Count", "count"),
        ("log_distance", "log-distance"),
        ("zzz", None),
        ("x" * 100, None),
        ("", None),
    ],
)
def test_nearest(name: str, expected: str | None) -> None:
    assert nearest(name, ["count", "log-distance", "radius_m"]) == expected
