"""Whatever stands in a file, reading ends soon, with a record or with a `ScenarioError`."""

from io import StringIO

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reading_records import Root
from ruamel.yaml import YAML

from netsim.errors import Finding, ScenarioError
from netsim.reading import apply_override, parse, validate

GOOD = """\
seed: 1
medium: &air {type: disk, radius_m: 5e-1}
nodes:
- count: 3
  origin_m: [0, 1.5]
  tags: ["a b", 'c']
  battery: {low_v: 1.0}   # a remark
note: |
  several
  lines
weights: {a: 1, b: .5}
"""
PIECES = [
    ":",
    "- ",
    "\t",
    "\n",
    "  ",
    "{",
    "}",
    "[",
    "]",
    "&air ",
    "*air",
    "<<: *air",
    "!!int ",
    "? ",
    "|",
    ">",
    "'",
    '"',
]
PIECES += [
    "#",
    "---\n",
    "...\n",
    "%YAML 1.1\n",
    "\\",
    ",",
    "null",
    ".nan",
    "1e400",
    "9" * 400,
    "\x00",
    "\ufeff",
    "é",
    "@",
    "~: 1\n",
]


def refusal(text: str, *overrides: str) -> list[Finding] | None:
    """The findings, or None for a good text; any other error passes through and fails the test."""
    try:
        document = parse(text, "f.yaml")
        for override in overrides:
            document = apply_override(document, override)
        validate(document, Root)
    except ScenarioError as error:
        return list(error.findings)
    return None


def check(found: list[Finding] | None) -> None:
    assert found is None or found
    for finding in found or ():
        assert finding.line >= (0 if finding.file == "--set" else 1)
        assert finding.expected
        assert finding.got
        assert len(str(finding)) < 2000


def survives(text: str) -> None:
    check(refusal(text))


def bomb() -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    return "\n".join(lines)


def deep_aliases() -> str:
    return "\n".join(["a0: &a0 [x]", *(f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 60))])


HOSTILE = {
    "aliases of aliases": (bomb(), "at most 200000 values"),
    "nesting by aliases": (deep_aliases(), "at most 40 levels"),
    "nested lists": ("[" * 100_000, "at most 40 levels"),
    "nested mappings": ("{" * 100_000, "at most 40 levels"),
    "nested block lists": ("- " * 100_000, "at most 40 levels"),
    "nested keys": ("? " * 100_000, "at most 40 levels"),
    "nested by indentation": ("".join(" " * i + "a:\n" for i in range(500)), "at most 40 levels"),
    "an alias to itself": ("a: &a {b: *a}", "an anchor"),
    "a huge number": (GOOD + f"loss: {'9' * 100_000}", "a number >= 0 and <= 1"),
    "a huge hexadecimal number": (GOOD + f"retries: 0x{'f' * 5000}", "a whole number >= 0"),
    "a huge key": (GOOD + f"? {'k' * 50_000}\n: 1\n", "one of seed"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_text_is_refused(name: str) -> None:
    text, reason = HOSTILE[name]
    with pytest.raises(ScenarioError) as raised:
        validate(parse(text, "f.yaml"), Root)
    assert reason in str(raised.value)


def test_forty_levels_are_enough_and_allowed() -> None:
    assert parse("[" * 40 + "]" * 40, "f").plain() == eval("[" * 40 + "]" * 40)
    with pytest.raises(ScenarioError):
        parse("[" * 41 + "]" * 41, "f")


def test_aliases_of_moderate_size_are_copied() -> None:
    made = parse("a: &x {b: [1]}\nc: *x\n", "f").plain()
    assert made == {"a": {"b": [1]}, "c": {"b": [1]}}
    assert made["a"] is not made["c"]


@settings(max_examples=200, deadline=None)
@given(st.text())
def test_any_text(text: str) -> None:
    survives(text)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.sampled_from(PIECES) | st.sampled_from(["a", "seed", "medium", "1", "-"]), max_size=25))
def test_any_row_of_special_characters(pieces: list[str]) -> None:
    survives("".join(pieces))


@settings(max_examples=250, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, len(GOOD)), st.sampled_from(PIECES), st.integers(0, 3)), min_size=1, max_size=3)
)
def test_damaged_files(damages: list[tuple[int, str, int]]) -> None:
    text = GOOD
    for place, piece, cut in damages:
        text = text[:place] + piece + text[place + cut :]
    survives(text)


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text("ab1:#-'\"\n ", max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text("ab", max_size=2) | st.integers(), inner, max_size=3)
    ),
    max_leaves=6,
)


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(["seed", "medium", "medium.type", "medium.radius_m", "nodes", "nodes[0].count", "weights"]),
    anything,
)
def test_any_value_anywhere(path: str, value: object) -> None:
    stream = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = True
    yaml.width = 10_000
    yaml.dump([value], stream)
    check(refusal(GOOD, f"{path}={stream.getvalue().strip()[1:-1]}"))


@settings(max_examples=200, deadline=None)
@given(st.text("abn.[]0=:{,} ", max_size=20))
def test_any_override(text: str) -> None:
    check(refusal(GOOD, text))
