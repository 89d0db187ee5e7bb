from dataclasses import fields, is_dataclass
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reading_records import Battery, Disk, Gossip, Group, LogDistance, Root, Sourced, Untagged

from netsim.reading import Namers, Resolvers, dump_yaml, parse, to_plain, validate

TYPES: dict[str, type[Any]] = {"gossip": Gossip, "mine:Own": Untagged}
RESOLVERS: Resolvers = {("nodes", "*", "algorithm"): TYPES.__getitem__}
NAMERS: Namers = {("nodes", "*", "algorithm"): lambda record: "gossip" if isinstance(record, Gossip) else "mine:Own"}

finite = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(1e-300, 1e300)
text = st.text(st.characters(codec="utf-8"), max_size=12)
name = st.text(st.characters(codec="utf-8"), min_size=1, max_size=12) | st.sampled_from(
    [
        "1e-3",
        "null",
        "yes",
        "~",
        "0x1F",
        "<<",
        "=",
        "- a",
        "a: b",
        "#",
        "!x",
        "&a",
        "*a",
        "[",
        "1_0",
        "0o7",
        "2024-01-01",
        " x",
    ]
)
batteries = st.builds(Battery, capacity_mah=positive, low_v=st.floats(0.1, 1), high_v=st.floats(2, 9))
groups = st.builds(
    Group,
    count=st.integers(1, 10**30),
    origin_m=st.tuples(finite, finite),
    tags=st.lists(name, min_size=1, max_size=3).map(tuple),
    role=st.sampled_from(["sensor", "sink"]),
    battery=st.none() | batteries,
    algorithm=st.builds(Gossip, rounds=st.integers(1, 9)) | st.builds(Untagged, period_s=positive),
)
roots = st.builds(
    Root,
    seed=st.integers(),
    medium=st.builds(Disk, type=st.just("disk"), radius_m=positive)
    | st.builds(LogDistance, type=st.just("log-distance"), exponent=positive, tx_power_dbm=finite),
    nodes=st.lists(groups, max_size=2).map(tuple),
    loss=st.floats(0, 1),
    note=st.none() | text,
    debug=st.booleans(),
    limit=st.integers(1, 99) | st.just("none"),
    weights=st.none() | st.dictionaries(name, finite, max_size=3),
    supply_v=st.none() | st.builds(Sourced, value=positive),
)


@settings(max_examples=150, deadline=None)
@given(roots)
def test_what_is_dumped_reads_as_an_equal_record(record: Root) -> None:
    dumped = dump_yaml(record, NAMERS)
    again = validate(parse(dumped, "f"), Root, RESOLVERS)
    assert again == record
    assert dump_yaml(again, NAMERS) == dumped


@settings(max_examples=50, deadline=None)
@given(roots)
def test_every_field_is_written_in_the_order_of_declaration(record: Root) -> None:
    def names(value: Any) -> Any:
        if is_dataclass(value):
            return {field.name: names(getattr(value, field.name)) for field in fields(value)}
        return [names(item) for item in value] if isinstance(value, tuple) else None

    def keys(value: Any) -> Any:
        if isinstance(value, dict):
            return [(key, keys(item)) for key, item in value.items()]
        return [keys(item) for item in value] if isinstance(value, list) else None

    plain = to_plain(record)
    plain["weights"] = None
    assert keys(plain) == keys(names(record))


def test_dump() -> None:
    record = Root(
        seed=1, medium=Disk(type="disk", radius_m=5.0), nodes=(Group(count=2, algorithm=Untagged()),), note="1e-3"
    )
    assert (
        dump_yaml(record, NAMERS)
        == """\
seed: 1
medium: {type: disk, radius_m: 5.0, delay_s: 0.0}
nodes:
  - count: 2
    origin_m: [0.0, 0.0]
    tags: [all]
    role: sensor
    battery: null
    algorithm: {type: "mine:Own", period_s: 1.0}
loss: 0.0
note: "1e-3"
debug: false
limit: none
weights: null
supply_v: null
rate_bit_per_s: 0.0
retries: 3
"""
    )


@pytest.mark.parametrize("record", [Gossip(), Untagged(), Battery()])
def test_defaults_are_filled_in(record: Any) -> None:
    assert validate(parse(dump_yaml(record), "f"), type(record)) == record
    assert validate(parse("{}", "f"), type(record)) == record
