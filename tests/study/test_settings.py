"""In what nested documents differ."""

from netsim.study.settings import Setting, differing


def test_only_what_differs_is_told_where_it_stands() -> None:
    first = {"a": 1, "b": {"c": [1, 2], "d": None}, "m": {"type": "x", "p": 1}, "list": [1], "gone": True}
    second = {"a": 1, "b": {"c": [1, 3], "d": "e"}, "m": {"type": "y", "q": 1}, "list": [1, 2]}
    assert differing([first, second]) == [
        Setting("b.c[1]", ("2", "3")),
        Setting("b.d", ("null", "e")),
        Setting("m", ("type: x", "type: y")),
        Setting("list", ("[1]", "[1, 2]")),
        Setting("gone", ("true", "(none)")),
    ]
    assert differing([first, first]) == []


def test_numbers_and_truth_values_are_not_the_same() -> None:
    assert differing([{"a": 1}, {"a": True}, {"a": 1}]) == [Setting("a", ("1", "true", "1"))]


def test_long_values_are_cut() -> None:
    told = differing([{"a": "b" * 100}, {"a": "c"}])
    assert told == [Setting("a", ("b" * 57 + "...", "c"))]
