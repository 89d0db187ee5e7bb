"""What validation makes of good documents, and unions and open records in bad ones."""

from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from annotated_types import MaxLen, MultipleOf
from pydantic import AfterValidator
from reading_records import Battery, Disk, Gossip, Group, LogDistance, Root, Untagged

from netsim.errors import ScenarioError
from netsim.parameters import Name, Positive, PositiveInt, parameters
from netsim.reading import Unknown, findings, parse, validate
from netsim.reading.shapes import shape_of

OPEN = {("nodes", "*", "algorithm"): lambda name: KNOWN.get(name, Unknown("one of gossip, mine:Own", "see the list"))}
KNOWN: dict[str, type[Any]] = {"gossip": Gossip, "mine:Own": Untagged}


def made(text: str, record_type: type[Any] = Root) -> Any:
    return validate(parse(text, "s.yaml"), record_type, OPEN)


def wrong(text: str, record_type: type[Any] = Root) -> list[str]:
    return [str(finding) for finding in findings(parse(text, "s.yaml"), record_type, OPEN)]


def test_a_whole_document() -> None:
    scenario = made(
        """
        seed: 3
        medium: {type: log-distance, exponent: 2}
        nodes:
        - {count: 2, origin_m: [1, 2.5], tags: [a, b], battery: {low_v: 1e-3}, algorithm: {type: gossip, rounds: 4}}
        - {count: 1, algorithm: {type: "mine:Own"}}
        limit: 5
        weights: {x: 1}
        """
    )
    assert scenario == Root(
        seed=3,
        medium=LogDistance(type="log-distance", exponent=2.0),
        nodes=(
            Group(
                count=2, origin_m=(1.0, 2.5), tags=("a", "b"), battery=Battery(low_v=1e-3), algorithm=Gossip(rounds=4)
            ),
            Group(count=1, algorithm=Untagged()),
        ),
        limit=5,
        weights={"x": 1.0},
    )
    assert isinstance(scenario.nodes[0].origin_m[0], float)
    assert isinstance(scenario.medium.exponent, float)


def test_open_records_are_checked_at_their_exact_path() -> None:
    text = """\
seed: 1
medium: {type: disk, radius_m: 5}
nodes:
- count: 1
  algorithm: {type: gossip, rounds: 0}
- count: 1
  algorithm:
    type: "mine:Own"
    period_ms: 20
- count: 1
  algorithm: {type: rumour}
- count: 1
  algorithm: gossip
- count: 1
  algorithm: {}
- count: 1
  algorithm: null
"""
    assert wrong(text) == [
        "s.yaml:5: nodes[0].algorithm.rounds: expected a whole number > 0, got 0",
        "s.yaml:9: nodes[1].algorithm.period_ms: expected a known key, got the unknown key `period_ms`; "
        "did you mean `period_s`? it is in seconds (1 ms = 0.001 s); write `period_s: 0.02`",
        "s.yaml:11: nodes[2].algorithm.type: expected one of gossip, mine:Own, got `rumour`; see the list",
        "s.yaml:13: nodes[3].algorithm: expected a mapping with the key `type`, got `gossip`",
        "s.yaml:15: nodes[4].algorithm.type: expected a name, got no such key; add `type: ...` here",
    ]


def test_values_from_an_anchor_are_reported_where_they_are_used() -> None:
    text = "seed: 1\nmedium: {type: disk, radius_m: 5}\nnodes:\n- count: &n 0\n- count: *n\n"
    assert wrong(text) == [
        "s.yaml:4: nodes[0].count: expected a whole number > 0, got 0",
        "s.yaml:5: nodes[1].count: expected a whole number > 0, got 0",
    ]


def test_problems_of_reading_and_of_values_come_together_in_order() -> None:
    text = "seed: x\nmedium: {type: disk, radius_m: 5}\nseed: 1\nloss: 2\n"
    assert [line.split(": expected")[0] for line in wrong(text)] == ["s.yaml:1: seed", "s.yaml:3", "s.yaml:4: loss"]


def test_a_finding_of_ones_own_points_at_the_value() -> None:
    document = parse("seed: 1\nnodes:\n- count: 1\n", "s.yaml")
    finding = document.finding(("nodes", 0, "count"), "two nodes", "1", "add one")
    assert str(finding) == "s.yaml:3: nodes[0].count: expected two nodes, got 1; add one"


class Colour(Enum):
    RED = "red"


@parameters
class Tree:
    label: Name
    children: "tuple[Tree, ...]" = ()


def _even(value: int) -> int:
    if value % 2:
        raise ValueError("an even number")
    return value


@parameters
class Odd:
    colour: Colour = Colour.RED
    file: Path = Path("a")
    names: frozenset[str] = frozenset()
    choice: "Name | Disk | tuple[int, ...] | None" = None
    free: Annotated[dict[str, Any], MaxLen(1)] | None = None
    steps: Annotated[int, MultipleOf(5)] = 0
    even: Annotated[int, AfterValidator(_even)] = 0
    tree: Tree | None = None
    list_: list[float] | None = None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("colour: red", Odd()),
        ("file: b/c", Odd(file=Path("b/c"))),
        ("names: [b, a, b]", Odd(names=frozenset("ab"))),
        ("choice: x", Odd(choice="x")),
        ("choice: {type: disk, radius_m: 1}", Odd(choice=Disk(type="disk", radius_m=1.0))),
        ("choice: [1, 2]", Odd(choice=(1, 2))),
        ("free: {a: {b: [1, null]}}", Odd(free={"a": {"b": [1, None]}})),
        ("tree: {label: a, children: [{label: b}]}", Odd(tree=Tree(label="a", children=(Tree(label="b"),)))),
        ("list_: [1, 2e3]", Odd(list_=[1.0, 2000.0])),
        ("{}", Odd()),
    ],
)
def test_every_kind_of_field(text: str, expected: Odd) -> None:
    assert made(text, Odd) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("colour: rad", "colour: expected red, got `rad`; did you mean `red`?"),
        ("steps: 7", "steps: expected a whole number in multiples of 5, got 7"),
        ("even: 7", "even: expected an even number, got 7"),
        ("free: {a: 1, b: 2}",
         "free: expected a mapping from text to anything (at most 1 of them) or null, got {a: 1, b: 2}"),
        ("tree: {label: a, children: [{}]}", "tree.children[0].label: expected text that is not empty, got no such key; add "
         "`label: ...` under `tree.children[0]`"),
        ("choice: {type: disk}", "choice.radius_m: expected a number > 0 (metres): Greatest distance of reception, got no "
         "such key; add `radius_m: ...` under `choice`"),
        ("choice: 5", "choice: expected text that is not empty or a list, each item a whole number or a mapping with the "
         'keys type, radius_m, delay_s or null, got 5; write it in quotes: "5"'),
    ],
)  # fmt: skip
def test_message_for_every_kind_of_field(text: str, message: str) -> None:
    assert wrong(text, Odd) == [f"s.yaml:1: {message}"]


def test_a_file_full_of_errors_names_them_all() -> None:
    text = "".join(f"key_number_{i}: 1\n" for i in range(500))
    assert len(wrong(text, Odd)) == 500


@parameters
class NoTag:
    size: PositiveInt = 1


@parameters
class SameTag:
    type: Literal["disk"]
    size: Positive = 1.0


@pytest.mark.parametrize(
    ("hint", "message"),
    [
        (Disk | NoTag, "records of a union need a field `type"),
        (Disk | SameTag, "records of a union need a field `type"),
        (tuple[int, int] | tuple[int, ...], "cannot tell two kinds of list apart"),
    ],
)
def test_declarations_that_no_file_could_satisfy(hint: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        shape_of(hint)


def test_validate_raises_what_findings_lists() -> None:
    document = parse("seed: x\nmedium: 3\n", "s.yaml")
    with pytest.raises(ScenarioError) as raised:
        validate(document, Root)
    assert list(raised.value.findings) == findings(document, Root)
    assert len(raised.value.findings) == 2
