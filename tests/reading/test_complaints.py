"""A complaint about several settings shows those that it names."""

from dataclasses import dataclass

import pytest

from netsim.reading.complaints import concerned


@dataclass(frozen=True)
class Window:
    """A record with scalars and a short list."""

    low_m: float = 0.0
    high_m: float = 1.0
    covariance_m2: tuple[float, float, float] = (1.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("given", "complaint", "shown"),
    [
        ({"low_m": 5}, "low_m below high_m", "low_m: 5, high_m: 1.0"),
        ({"covariance_m2": [1, 2, 1], "low_m": 5}, "covariance_m2 positive definite", "covariance_m2: [1, 2, 1]"),
        ({"low_m": 5}, "covariance_m2 positive definite", "covariance_m2: [1.0, 0.0, 1.0]"),
        ({"low_m": 5}, "something else", "{low_m: 5}"),
    ],
)
def test_what_a_complaint_is_about(given: dict[str, object], complaint: str, shown: str) -> None:
    assert concerned(Window, given, complaint) == shown
