from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from reading_records import Disk, Root

from netsim.errors import ScenarioError
from netsim.reading import Document, apply_override, overlay, parse, read_document, read_record, validate
from netsim.reading.document import Node

BASE = "seed: 1\nmedium:\n  type: disk\n  radius_m: 5\nnodes:\n- count: 1\n- count: 2\n"


def write(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)
    return folder / f"{next(iter(files))}.yaml"


def error(path: Path, *overrides: str) -> str:
    with pytest.raises(ScenarioError) as raised:
        read_document(path, overrides)
    return str(raised.value).replace(f"{path.parent}/", "")


def test_a_file_lies_over_the_one_it_extends_and_positions_follow(tmp_path: Path) -> None:
    top = write(tmp_path, top="extends: base.yaml\nmedium:\n  delay_s: 1\nnodes:\n- count: 7\n", base="\n" + BASE)
    document = read_document(top)
    assert document.plain() == {
        "seed": 1,
        "medium": {"type": "disk", "radius_m": 5, "delay_s": 1},
        "nodes": [{"count": 7}],
    }
    places = {
        path: document.where(path) for path in [("seed",), ("medium",), ("medium", "radius_m"), ("nodes", 0, "count")]
    }
    base, over = str(tmp_path / "base.yaml"), str(top)
    assert places == {
        ("seed",): (base, 2),
        ("medium",): (over, 2),
        ("medium", "radius_m"): (base, 5),
        ("nodes", 0, "count"): (over, 5),
    }
    assert document.where(("medium", "nowhere", "at all")) == (over, 2)


def test_a_section_of_another_type_is_replaced_whole(tmp_path: Path) -> None:
    top = write(tmp_path, top="extends: base.yaml\nmedium: {type: log-distance}\n", base=BASE)
    assert read_document(top).plain()["medium"] == {"type": "log-distance"}


def test_a_chain_through_folders(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    write(tmp_path, low=BASE)
    write(tmp_path / "inner", mid="extends: ../low.yaml\nseed: 2\n")
    top = write(tmp_path, top="extends: inner/mid.yaml\nloss: 0.5\n")
    scenario = read_record(top, Root)
    assert (scenario.seed, scenario.loss, scenario.medium) == (2, 0.5, Disk(type="disk", radius_m=5.0))


@pytest.mark.parametrize(
    ("link", "message"),
    [
        (
            "top.yaml",
            "top.yaml:2: extends: expected a file that does not extend this one, got top.yaml -> top.yaml; break",
        ),
        (
            "two.yaml",
            "two.yaml:1: extends: expected a file that does not extend this one, got top.yaml -> two.yaml -> top",
        ),
        (
            "none.yaml",
            "top.yaml:2: extends: expected an existing file, got `none.yaml` (looked for none.yaml); the path is",
        ),
        (
            "[a, b]",
            "top.yaml:2: extends: expected the name of a YAML file, got [a, b]; write one path, relative to this",
        ),
        (
            "",
            "top.yaml:2: extends: expected the name of a YAML file, got nothing; write one path, relative to this file",
        ),
        (
            '"a\\0b"',
            "top.yaml:2: extends: expected an existing file, got `a\0b` (looked for a\0b); the path is relative to",
        ),
    ],
)
def test_a_base_that_cannot_be_used(tmp_path: Path, link: str, message: str) -> None:
    top = write(tmp_path, top=f"seed: 1\nextends: {link}\n", two="extends: top.yaml\n")
    assert error(top).startswith(message)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a: 1\nb: \xff\n", "f.yaml:2: expected UTF-8 text, got the byte 0xff; save the file as UTF-8"),
        (
            b"# " + b"x" * 1_000_000,
            "f.yaml:1: expected at most 1000000 bytes, got a larger file; make the file smaller",
        ),
    ],
)
def test_a_file_that_is_no_text(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "f.yaml").write_bytes(content)
    assert error(tmp_path / "f.yaml") == message


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    message = "f.yaml:1: expected a file that can be read, got No such file or directory; check the path"
    assert error(tmp_path / "f.yaml") == message
    assert error(tmp_path / "f.yaml" / "\0").endswith("check the path")


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert read_document(tmp_path / "f.yaml").plain() == {"a": 1}


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("seed=9", ("seed",), 9),
        ("medium.radius_m = 1e-3", ("medium", "radius_m"), 0.001),
        ("nodes[1].count=8", ("nodes", 1, "count"), 8),
        ("nodes.0.count=7", ("nodes", 0, "count"), 7),
        ("nodes=[{count: 3}]", ("nodes",), [{"count": 3}]),
        ("medium={type: disk, radius_m: 2}", ("medium",), {"type": "disk", "radius_m": 2}),
        ("medium.type=log-distance", ("medium",), {"type": "log-distance"}),
        ("medium.type=disk", ("medium",), {"type": "disk", "radius_m": 5}),
        ("note=a=b", ("note",), "a=b"),
        ("note=", ("note",), None),
        ("new.part=1", ("new",), {"part": 1}),
        ("seed.part=1", ("seed",), {"part": 1}),
    ],
)
def test_override(override: str, path: tuple[Any, ...], value: object) -> None:
    before = parse(BASE, "f")
    after = apply_override(before, override)
    node: Any = after.plain()
    for key in path:
        node = node[key]
    assert node == value
    assert before.plain() == parse(BASE, "f").plain()


def test_the_order_of_type_and_its_keys_does_not_matter() -> None:
    assignments = ["medium.type=log-distance", "medium.exponent=2"]
    one, two = parse(BASE, "f"), parse(BASE, "f")
    for assignment in assignments:
        one = apply_override(one, assignment)
    for assignment in reversed(assignments):
        two = apply_override(two, assignment)
    assert one.plain() == two.plain()
    assert one.plain()["medium"] == {"type": "log-distance", "exponent": 2}


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("medium.radius_m=-1", "--set medium.radius_m: expected a number > 0 (metres), got -1"),
        (
            "medium.raduis_m=1",
            "--set medium.raduis_m: expected a known key, got the unknown key `raduis_m`; did you mean `radius_m`?",
        ),
        ("nodes[2].count=1", "--set nodes: expected an index from 0 to 1, got `2`; count the items of the list from 0"),
        (
            "nodes.count=1",
            "--set nodes: expected an index from 0 to 1, got `count`; count the items of the list from 0",
        ),
        ("seed", "--set: expected path=value, got seed; write it like `medium.exponent=3.5` or `nodes[0].count=9`"),
        ("=5", '--set: expected path=value, got "=5"; write it like `medium.exponent=3.5` or `nodes[0].count=9`'),
        (
            "a..b=5",
            '--set: expected path=value, got "a..b=5"; write it like `medium.exponent=3.5` or `nodes[0].count=9`',
        ),
        ("seed=[1", '--set seed: expected `,` or `]` in a list, got "[1"; close the list with `]`'),
        (
            "seed=!!int 5",
            '--set seed: expected a value without a tag, got the tag "!!int"; remove the tag; put text that',
        ),
    ],
)
def test_message_about_an_override(override: str, message: str) -> None:
    with pytest.raises(ScenarioError) as raised:
        validate(apply_override(parse(BASE, "f"), override), Root)
    assert str(raised.value).startswith(message)


keys = st.sampled_from(["a", "b", "type"])
trees = st.recursive(
    st.integers(0, 2) | st.sampled_from(["x", "y"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=12,
)
mappings = st.dictionaries(keys, trees, max_size=3)


def node(value: Any, line: int) -> Node:
    if isinstance(value, dict):
        return Node({key: node(item, line) for key, item in value.items()}, "f", line)
    return Node([node(item, line) for item in value] if isinstance(value, list) else value, "f", line)


def merged(base: Any, over: Any) -> Any:
    if not isinstance(base, dict) or not isinstance(over, dict):
        return over
    if "type" in over and ("type" not in base or base["type"] != over["type"]):
        return over
    both = {key: merged(base[key], over[key]) for key in base.keys() & over.keys()}
    return {**base, **over, **both}


@given(mappings, mappings)
def test_overlay_equals_a_plain_deep_merge(base: Any, over: Any) -> None:
    made = Document(overlay(node(base, 1), node(over, 2)))
    assert made.plain() == merged(base, over)


@given(mappings, mappings)
def test_every_scalar_keeps_its_position(base: Any, over: Any) -> None:
    made = Document(overlay(node(base, 1), node(over, 2)))

    def leaves(value: Any, path: tuple[Any, ...]) -> Any:
        if isinstance(value, dict | list):
            pairs = value.items() if isinstance(value, dict) else enumerate(value)
            for key, item in pairs:
                yield from leaves(item, (*path, key))
        else:
            yield path

    upper = set(leaves(over, ()))
    for path in leaves(made.plain(), ()):
        assert made.where(path) == ("f", 2 if path in upper else 1)


@given(mappings, mappings, mappings)
def test_laying_over_the_same_twice_changes_nothing(base: Any, over: Any, other: Any) -> None:
    once = overlay(node(base, 1), node(over, 2))
    assert Document(overlay(once, node(over, 2))).plain() == Document(once).plain()
    assert Document(overlay(node(other, 1), node({}, 2))).plain() == other
