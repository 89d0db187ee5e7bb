"""Gates: what they mean, against Python's own arithmetic, and what they refuse."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.study.gate import Judgement, parse_gate, relative

FIRST = {"association_error": 0.2, "energy_j": 10.0, "deaths": 0, "none": None, "word": "n03", "by_j.radio.listen": 4.0}
LATER = {"association_error": 0.25, "energy_j": 9.0, "deaths": 2, "none": 1.0, "word": "n03", "by_j.radio.listen": 5.0}


def failed(expression: str) -> bool:
    return parse_gate(expression).judge(LATER, FIRST).failed


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("energy_j < energy_j_first", True),
        ("energy_j_diff == -1", True),
        ("energy_j_rel <= -0.1", True),
        ("error_rel > 0.2", True),
        ("error_rel > 0.3", False),
        ("error == association_error and error_first == 0.2", True),
        ("error_diff > 0.04 and energy_j > 9", False),
        ("not energy_j > 9", True),
        ("not (energy_j > 9 or deaths < 1)", True),
        ("deaths_rel > 1e9", True),
        ("by_j.radio.listen_rel > 0.2 and by_j.radio.listen_first == 4", True),
        ("0 < deaths <= 2", True),
        ("2 * energy_j - 3 / 2 >= +16.5", True),
        ("-energy_j < -8", True),
    ],
)
def test_it_says_what_it_means(expression: str, expected: bool) -> None:
    assert failed(expression) is expected


def test_what_is_not_needed_need_not_be_there() -> None:
    """As Python's own `and` and `or`; what decides is told alone."""
    alive = {"deaths": 0, "first_death_s": None, "energy_j": 2.0}
    dying = {"deaths": 1, "first_death_s": 2.0, "energy_j": 2.0}
    gate = parse_gate("deaths > 0 and first_death_s < 3")
    assert gate.judge(alive, alive) == Judgement(gate.expression, False, {"deaths": 0.0}, ("deaths",))
    assert gate.judge(dying, alive).failed
    either = parse_gate("deaths == 0 or first_death_s < 1")
    assert either.judge(alive, alive).failed
    assert not either.judge(dying, alive).failed
    assert not parse_gate("deaths > 0 and 1 / deaths > 2").judge(alive, alive).failed
    assert not parse_gate("deaths > 0 and converged_round > 2").judge(alive, alive).failed  # a metric that others have
    with pytest.raises(ScenarioError, match="expected first_death_s to be a number"):
        parse_gate("first_death_s < 3 and deaths > 0").judge(alive, alive)


def test_the_values_are_told() -> None:
    judgement = parse_gate("error_rel > 0.2 and energy_j > energy_j_first").judge(LATER, FIRST)
    assert judgement.values == {"error_rel": pytest.approx(0.25), "energy_j": 9.0, "energy_j_first": 10.0}


NUMBER = st.floats(-1e6, 1e6).map(lambda value: round(value, 3))


@given(NUMBER, NUMBER, NUMBER)
def test_it_reckons_as_python_does(a: float, b: float, c: float) -> None:
    judged = parse_gate(f"x * {abs(c)!r} - x_first / 4 > x_diff + 1").judge({"x": a}, {"x": b})
    assert judged.failed == (a * abs(c) - b / 4 > (a - b) + 1)


@given(NUMBER, NUMBER)
def test_a_relative_difference_is_zero_or_infinite_where_the_first_is_zero(a: float, b: float) -> None:
    assert relative(0.0, 0.0) == 0.0
    if a:
        assert relative(a, 0.0) == math.copysign(math.inf, a)
        assert relative(b, a) == (b - a) / abs(a)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("enery_j > 1", "expected the name of a metric, got `enery_j`; did you mean energy_j"),
        ("enery_j_rel > 1", "did you mean energy_j_rel"),
        ("zzz > 1", r"metrics\.json names the metrics"),
        ("none >= 1 and none_first > 1", "expected none to be a number, but in the first run it is no value"),
        ("word > 1", "expected word to be a number, but in the later run it is 'n03'"),
        ("energy_j", "expected a comparison by < <= > >= == or !=, got `energy_j`"),
        ("error_diff > 0.06 or deaths", "expected a comparison by"),
        ("energy_j + 1", "expected a comparison by"),
        ("energy_j > 1 if deaths else 2", "expected a comparison by"),
        ("energy_j > abs(1)", r"expected numbers, names and \+ - \* /, got `abs\(1\)`"),
        ("__import__('os').system('true') == 0", "expected numbers, names"),
        ("energy_j ** 2 > 1", "expected numbers, names"),
        ("energy_j > True", "expected numbers, names"),
        ("energy_j > '1'", "expected numbers, names"),
        ("energy_j in (1, 2)", "expected a comparison by"),
        ("energy_j is 1", "expected a comparison"),
        ("energy_j > [x for x in 'a'][0]", "expected numbers, names"),
        ("energy_j >", r"expected a comparison such as error_rel > 0\.02"),
        ("", "expected a comparison such as"),
        ("energy_j > 1; deaths", "expected a comparison such as"),
        ("deaths < 0 and enery_j > 1", "expected the name of a metric, got `enery_j`"),
        ("1 / deaths_first > 2", "it divides by zero"),
        ("energy_j > " + "(" * 400 + "1" + ")" * 400, "expected a comparison such as"),
        ("energy_j > 1 or " * 100, "expected at most 1000 characters"),
    ],
)
def test_what_it_refuses(expression: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        failed(expression)


def test_error_needs_an_error_metric() -> None:
    with pytest.raises(ScenarioError, match="`error` stands for the problem's error, but the runs have no such metric"):
        parse_gate("error > 1").judge({"energy_j": 1.0}, {"energy_j": 1.0})
    gate = parse_gate("error > 0.5")
    assert gate.judge({"marginal_error_linf": 0.6}, {"marginal_error_linf": 0.1}).failed
