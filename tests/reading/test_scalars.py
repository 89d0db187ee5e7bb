import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.reading import parse
from netsim.reading.scalars import scalar_value, show, show_scalar

# The examples of YAML 1.2.2, section 10.3.2, and what YAML 1.1 would have taken for something else.
CORE = {
    "": None,
    "~": None,
    "null": None,
    "Null": None,
    "True": True,
    "FALSE": False,
    "yes": "yes",
    "on": "on",
    "0": 0,
    "-19": -19,
    "+12": 12,
    "010": 10,
    "0o7": 7,
    "0x3A": 58,
    "0b1": "0b1",
    "1_000": "1_000",
    "12:30": "12:30",
    "0.": 0.0,
    "-0.0": -0.0,
    ".5": 0.5,
    "+12e03": 12000.0,
    "-2E+05": -200000.0,
    "1e-3": 0.001,
    "1e400": math.inf,
    ".inf": math.inf,
    "-.Inf": -math.inf,
    "nan": "nan",
    "1e": "1e",
    "2024-01-01": "2024-01-01",
    "١": "١",
}


@pytest.mark.parametrize(("text", "value"), CORE.items())
def test_core_schema(text: str, value: object) -> None:
    made = scalar_value(text)
    assert made == value
    assert type(made) is type(value)


def test_nan() -> None:
    made = scalar_value(".NaN")
    assert isinstance(made, float)
    assert math.isnan(made)


@pytest.mark.parametrize(("text", "value"), [("9" * 5000, math.inf), ("-" + "9" * 5000, -math.inf)])
def test_huge_integers_do_not_take_for_ever(text: str, value: float) -> None:
    assert scalar_value(text) == value


@given(
    st.one_of(
        st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(st.characters(codec="utf-8"))
    )
)
def test_what_is_shown_reads_as_the_same_value(value: object) -> None:
    text = show_scalar(value)
    made = parse(f"a: {text}", "f").plain()["a"]
    assert made == value
    assert type(made) is type(value)


@given(st.recursive(st.integers() | st.text(), lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)))
def test_what_is_shown_is_short(value: object) -> None:
    assert len(show(value)) <= 60
