"""Values set from another file: where they land, and where findings about them point."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.reading import Node, assign, keys_of, parse

BASE = """\
mac: {type: csma, retries: 3}
nodes:
  - name: a
    count: 1
  - name: b
    count: 2
"""


def base():
    return parse(BASE, "base.yaml")


def value(text, line=7):
    return parse("\n" * (line - 1) + text, "study.yaml").root


def test_a_value_lands_at_its_path_with_its_own_line():
    document = assign(base(), "nodes[1].count", Node(5, "study.yaml", 7))
    assert document.plain()["nodes"] == [{"name": "a", "count": 1}, {"name": "b", "count": 5}]
    assert document.where(("nodes", 1, "count")) == ("study.yaml", 7)
    assert document.where(("nodes", 0, "count")) == ("base.yaml", 4)
    assert base().plain()["nodes"][1]["count"] == 2


@pytest.mark.parametrize("path", ["nodes[1].count", "nodes.1.count"])
def test_both_ways_to_write_an_index(path):
    assert keys_of(path) == ("nodes", "1", "count")
    assert assign(base(), path, value("9")).plain()["nodes"][1]["count"] == 9


def test_another_type_drops_the_keys_of_the_old_one_but_not_those_assigned_before():
    first = assign(base(), "mac.slot_s", value("0.1"))
    second = assign(first, "mac.type", value("tdma"))
    assert second.plain()["mac"] == {"slot_s": 0.1, "type": "tdma"}
    assert assign(base(), "mac.type", value("csma")).plain()["mac"] == {"type": "csma", "retries": 3}


def test_a_mapping_replaces_what_was_there():
    assert assign(base(), "mac", value("{type: ideal}")).plain()["mac"] == {"type": "ideal"}


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("nodes[2].count", "study.yaml:7: nodes: expected an index from 0 to 1, got `2`"),
        ("nodes[-1].count", "study.yaml:7: expected the path of a value"),
        ("nodes.first.count", "study.yaml:7: nodes: expected an index from 0 to 1, got `first`"),
        ("a..b", "study.yaml:7: expected the path of a value"),
        ("", "study.yaml:7: expected the path of a value"),
    ],
)
def test_paths_that_lead_nowhere_are_found_where_the_value_stands(target, words):
    with pytest.raises(ScenarioError) as raised:
        assign(base(), target, Node(1, "study.yaml", 7))
    assert str(raised.value).startswith(words)


names = st.from_regex(r"[a-z][a-z_]{0,6}", fullmatch=True)


@given(st.lists(names, min_size=1, max_size=5), st.integers())
def test_whatever_is_assigned_is_read_back(keys, number):
    document = assign(parse("{}", "base.yaml"), ".".join(keys), Node(number, "study.yaml", 3))
    plain = document.plain()
    for key in keys:
        plain = plain[key]
    assert plain == number
    assert document.where(tuple(keys)) == ("study.yaml", 3)
