"""Groups by region: who answers, and what goes over the air."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.api import Circle, Polygon, Rectangle
from netsim.protocols.geographic_groups import GROUP_ANSWER, GROUP_CALL, GeographicGroup, call, collect, serve
from netsim.protocols.region_payload import decode_region, encode_region
from netsim.protocols.regions import Intersection, Union
from netsim.testing import DROP, ScriptedMedium, delay, duplicate, rule, run_algorithm
from netsim.trace.events import Log, MessageSent

NODES = 12
S = 1_000_000_000
numbers = st.floats(-1000, 1000, width=32)
points = st.tuples(numbers, numbers)
shapes = st.one_of(
    st.builds(Circle, points, numbers.map(abs)),
    st.builds(Rectangle, points, points),
    st.builds(Polygon, st.lists(points, min_size=3, max_size=8).map(tuple)),
)
regions = st.recursive(
    shapes,
    lambda inner: st.one_of(
        st.builds(Union, st.lists(inner, max_size=3).map(tuple)),
        st.builds(Intersection, st.lists(inner, min_size=1, max_size=3).map(tuple)),
    ),
    max_leaves=6,
)


@given(regions, st.binary(max_size=8))
def test_a_region_arrives_as_it_was_sent(region, after):
    data = encode_region(region)
    assert decode_region(b"xy" + data + after, 2) == (region, 2 + len(data))


def test_a_region_of_too_many_parts_is_refused():
    with pytest.raises(ValueError, match=r"256 parts: expected at most 255"):
        encode_region(Union((Circle((0, 0), 1),) * 256))


@pytest.mark.parametrize("data", [b"\x00\x02" + bytes(8), b"\x09\x03" + bytes(12)])
def test_what_is_no_region_is_refused(data):
    with pytest.raises(ValueError, match="a shape of kind"):
        decode_region(data)


class Roll:
    """Node 0 calls a region several times; nodes in a row, a metre apart, answer with their number and what was asked."""

    def __init__(self, region, calls=1):
        self.region, self.calls = region, calls

    def run(self, node):
        if node.id:
            respond = lambda heard: None if node.id == 9 else bytes([node.id]) + heard.payload  # noqa: E731
            yield from serve(node, respond, spread_ns=S // 10, until_ns=10 * S)
            return
        group = GeographicGroup(7, self.region)
        for number in range(self.calls):
            ticket = call(node, group, number, b"?%d" % number)
            found = yield from collect(node, group, number, (number + 1) * S)
            node.log(f"{ticket is not None} {sorted(found)} {sorted(set(found.values()))[:1]}")


def rolled(region, *rules, calls=1):
    run = run_algorithm(lambda: Roll(region, calls), NODES, medium=ScriptedMedium(rules)).require_success()
    return [event.message for _, event in run.of(Log)], run


@pytest.mark.parametrize(
    ("region", "members"),
    [
        (Circle((4, 0), 1.5), [3, 4, 5]),
        (Rectangle((2, -1), (4, 1)), [2, 3, 4]),
        (Polygon(((2.5, -1), (6.5, -1), (6.5, 1), (2.5, 1))), [3, 4, 5, 6]),
        (Union((Circle((2, 0), 1), Circle((7, 0), 1))), [1, 2, 3, 6, 7, 8]),
        (Intersection((Circle((4, 0), 2), Rectangle((5, -1), (9, 1)))), [5, 6]),
        (Circle((10, 0), 1.5), [10, 11]),
    ],
)
def test_who_stands_in_the_region_answers(region, members):
    """The union's cover holds 4 and 5 too, who keep silent; node 9 has nothing to say."""
    (told,), run = rolled(region)
    assert told == f"True {members} {[bytes([members[0]]) + b'?0']}"
    answers = [event for _, event in run.of(MessageSent) if event.kind == GROUP_ANSWER]
    assert sorted(event.source for event in answers) == members


def test_to_nowhere_nothing_is_sent():
    (told,), run = rolled(Intersection((Circle((2, 0), 1), Circle((7, 0), 1))))
    assert told == "False [] []"
    assert not [event for _, event in run.of(MessageSent) if event.kind == GROUP_CALL]


def test_answers_that_are_late_count_for_no_other_call_and_those_that_come_twice_count_once():
    late = rule(delay(1.0), kind=GROUP_ANSWER, source=3, counts={0})
    lost = rule(DROP, kind=GROUP_ANSWER, source=4, counts={1})
    twice = rule(duplicate(0.2), kind=GROUP_ANSWER, source=5)
    told, _ = rolled(Circle((4, 0), 1.5), late, lost, twice, calls=2)
    assert told == ["True [4, 5] [b'\\x04?0']", "True [3, 5] [b'\\x03?1']"]
