"""The whole message for every kind of mistake a file can hold.

Texts that begin with `+` stand below a head that makes them complete: a `seed` on line 1 and a `medium` on line 2.
"""

import pytest
from reading_records import Root

from netsim.errors import ScenarioError
from netsim.reading import parse, validate

HEAD = "seed: 1\nmedium: {type: disk, radius_m: 5}\n"

VALUES = [
    (
        "",
        [
            "s.yaml:1: expected a mapping with the keys seed, medium, nodes, loss, note, debug, limit, "
            "weights, ..., got nothing",
        ],
    ),
    (
        "seed: 1",
        [
            "s.yaml:1: medium: expected a mapping whose `type` is one of disk, log-distance: The shared "
            "air, got no such key; add `medium: ...` at the top of the file",
        ],
    ),
    (
        "- 1\n- 2",
        [
            "s.yaml:1: expected a mapping with the keys seed, medium, nodes, loss, note, debug, limit, "
            "weights, ..., got [1, 2]",
        ],
    ),
    (
        "5",
        [
            "s.yaml:1: expected a mapping with the keys seed, medium, nodes, loss, note, debug, limit, "
            "weights, ..., got 5",
        ],
    ),
    (
        "seed: '5'\nmedium: {type: disk, radius_m: 5}",
        [
            's.yaml:1: seed: expected a whole number, got "5"; write 5 without quotes',
        ],
    ),
    (
        "seed: 1.0\nmedium: {type: disk, radius_m: 5}",
        [
            "s.yaml:1: seed: expected a whole number, got 1.0; write 1",
        ],
    ),
    (
        "seed: true\nmedium: {type: disk, radius_m: 5}",
        [
            "s.yaml:1: seed: expected a whole number, got true",
        ],
    ),
    (
        "seed:\nmedium: {type: disk, radius_m: 5}",
        [
            "s.yaml:1: seed: expected a whole number, got nothing; write a value, or remove the key if it "
            "has a default",
        ],
    ),
    (
        "seed: 1\nmedium:\n  type: disk\n  radius_km: 0.005",
        [
            "s.yaml:4: medium.radius_km: expected a known key, got the unknown key `radius_km`; did you "
            "mean `radius_m`? it is in metres (1 km = 1000 m); write `radius_m: 5`",
        ],
    ),
    (
        "seed: 1\nmedium:\n  type: disk\n  radius: 5",
        [
            "s.yaml:4: medium.radius: expected a known key, got the unknown key `radius`; did you mean "
            "`radius_m`? it is in metres",
        ],
    ),
    (
        "seed: 1\nmedium:\n  type: disk\n  radius: 2 km",
        [
            "s.yaml:4: medium.radius: expected a known key, got the unknown key `radius`; did you mean "
            "`radius_m`? it is in metres (1 km = 1000 m); write `radius_m: 2000`",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, raduis_m: 5}",
        [
            "s.yaml:2: medium.raduis_m: expected a known key, got the unknown key `raduis_m`; did you mean `radius_m`?",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: 5, exponent: 2}",
        [
            "s.yaml:2: medium.exponent: expected a key of this type, got `exponent`; it belongs to log-distance: leave it "
            "out, or choose such a type",
        ],
    ),
    (
        "seed: 1\nmedium: {type: dsk}",
        [
            "s.yaml:2: medium.type: expected one of disk, log-distance, got `dsk`; did you mean `disk`?",
        ],
    ),
    (
        "seed: 1\nmedium: {type: [disk]}",
        [
            "s.yaml:2: medium.type: expected one of disk, log-distance, got [disk]",
        ],
    ),
    (
        "seed: 1\nmedium: {radius_m: 5}",
        [
            "s.yaml:2: medium.type: expected one of disk, log-distance, got no such key; add `type: ...` here",
        ],
    ),
    (
        "seed: 1\nmedium: disk",
        [
            "s.yaml:2: medium: expected a mapping whose `type` is one of disk, log-distance, got `disk`",
        ],
    ),
    (
        "seed: 1\nmedium:",
        [
            "s.yaml:2: medium: expected a mapping whose `type` is one of disk, log-distance, got nothing; "
            "write its keys or items below it, or remove the key if it has a default",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: 5 m}",
        [
            's.yaml:2: medium.radius_m: expected a number > 0 (metres), got "5 m"; write 5: the unit is in the key',
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: 5, delay_s: 10 ms}",
        [
            's.yaml:2: medium.delay_s: expected a number >= 0 (seconds), got "10 ms"; write 0.01: the unit '
            "is in the key",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: 5, delay_s: 10 km}",
        [
            's.yaml:2: medium.delay_s: expected a number >= 0 (seconds), got "10 km"; write the number '
            "alone; the unit of the key is seconds",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: -5}",
        [
            "s.yaml:2: medium.radius_m: expected a number > 0 (metres), got -5",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: .inf}",
        [
            "s.yaml:2: medium.radius_m: expected a number > 0 (metres), got .inf; write a finite number",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: 1e400}",
        [
            "s.yaml:2: medium.radius_m: expected a number > 0 (metres), got .inf; write a finite number",
        ],
    ),
    (
        "seed: 1\nmedium: {type: disk, radius_m: .nan}",
        [
            "s.yaml:2: medium.radius_m: expected a number > 0 (metres), got .nan; write a finite number",
        ],
    ),
    (
        "seed: 1\nmedium: {type: log-distance, tx_power_mw: 1}",
        [
            "s.yaml:2: medium.tx_power_mw: expected a known key, got the unknown key `tx_power_mw`; did you "
            "mean `tx_power_dbm`? it is in dBm; write `tx_power_dbm: 0`",
        ],
    ),
    (
        "seed: 1\nmedium: {type: log-distance, exponent: '3,5'}",
        [
            's.yaml:2: medium.exponent: expected a number > 0, got "3,5"; write 3.5',
        ],
    ),
    (
        "seed: 1\nmedium: {type: log-distance, exponent: 5 dB}",
        [
            's.yaml:2: medium.exponent: expected a number > 0, got "5 dB"; write the number alone',
        ],
    ),
    (
        "+loss: 1.5",
        [
            "s.yaml:3: loss: expected a number >= 0 and <= 1, got 1.5",
        ],
    ),
    (
        "+note: 5",
        [
            's.yaml:3: note: expected text or null, got 5; write it in quotes: "5"',
        ],
    ),
    (
        "+note: [a]",
        [
            "s.yaml:3: note: expected text or null, got [a]",
        ],
    ),
    (
        "+debug: yes",
        [
            "s.yaml:3: debug: expected true or false, got `yes`; write true",
        ],
    ),
    (
        "+debug: 1",
        [
            "s.yaml:3: debug: expected true or false, got 1",
        ],
    ),
    (
        "+limit: nnoe",
        [
            "s.yaml:3: limit: expected a whole number > 0 or none, got `nnoe`; did you mean `none`?",
        ],
    ),
    (
        "+limit: 0",
        [
            "s.yaml:3: limit: expected a whole number > 0 or none, got 0",
        ],
    ),
    (
        "+weights: {a: x, 1: 2}",
        [
            "s.yaml:3: weights.a: expected a number, got `x`",
            "s.yaml:3: weights[1]: expected text that is not empty as key, got 1",
        ],
    ),
    (
        "+supply_v: {value: 3000 mV}",
        [
            's.yaml:3: supply_v.value: expected a number > 0 (volts), got "3000 mV"; write 3: the unit is in the key',
        ],
    ),
    (
        "+rate_kbit_per_s: 250",
        [
            "s.yaml:3: rate_kbit_per_s: expected a known key, got the unknown key `rate_kbit_per_s`; did "
            "you mean `rate_bit_per_s`? it is in bits per second (1 kbit/s = 1000 bit/s); write "
            "`rate_bit_per_s: 250000`",
        ],
    ),
    (
        "+nodes:\n- count: 0\n- cuont: 1\n- 3\n",
        [
            "s.yaml:4: nodes[0].count: expected a whole number > 0, got 0",
            "s.yaml:5: nodes[1].cuont: expected a known key, got the unknown key `cuont`; did you mean `count`?",
            "s.yaml:6: nodes[2]: expected a mapping with the keys count, origin_m, tags, role, battery, "
            "algorithm, got 3",
        ],
    ),
    (
        "+nodes:\n- count: 1\n  origin_m: [1]\n- count: 1\n  origin_m: [1, a]\n"
        "- count: 1\n  tags: []\n- count: 1\n  tags: [a, b, c, '']\n  role: Sensor\n",
        [
            "s.yaml:5: nodes[0].origin_m: expected a list of 2 items, each a number (metres), got [1]",
            "s.yaml:7: nodes[1].origin_m[1]: expected a number (metres), got `a`",
            "s.yaml:9: nodes[2].tags: expected a list, each item text that is not empty (at least 1 and at "
            "most 3 of them), got []",
            's.yaml:11: nodes[3].tags[3]: expected text that is not empty, got ""',
            "s.yaml:12: nodes[3].role: expected one of sensor, sink, got `Sensor`; did you mean `sensor`?",
        ],
    ),
    (
        "+nodes: [{count: 1, battery: {low_v: 4}}]",
        [
            "s.yaml:3: nodes[0].battery: expected low_v below high_v, got low_v: 4, high_v: 3.0",
        ],
    ),
    (
        "+nodes: {count: 1}",
        [
            "s.yaml:3: nodes: expected a list, each item a mapping with the keys count, origin_m, tags, "
            "role, battery, algorithm, got {count: 1}",
        ],
    ),
    (
        "+seed: 2",
        [
            "s.yaml:3: expected each key once, got `seed` again (first on line 1); remove one of the two",
        ],
    ),
    (
        "+1: x\n[a]: 3\nzzz: 1\nnull: 2",
        [
            "s.yaml:3: [1]: expected one of seed, medium, nodes, loss, note, debug, limit, weights, "
            "supply_v, rate_bit_per_s, retries, got the unknown key `1`",
            "s.yaml:4: expected a word as key, got a list or mapping as key; write one word before the colon",
            "s.yaml:5: zzz: expected one of seed, medium, nodes, loss, note, debug, limit, weights, "
            "supply_v, rate_bit_per_s, retries, got the unknown key `zzz`",
            "s.yaml:6: [None]: expected one of seed, medium, nodes, loss, note, debug, limit, weights, "
            "supply_v, rate_bit_per_s, retries, got the unknown key `null`",
        ],
    ),
    (
        "+<<: {a: 1}",
        [
            "s.yaml:3: expected a key, got the merge key `<<`, which YAML 1.2 does not have; write the keys "
            "out, or move them to a file of their own and name it under `extends`",
        ],
    ),
    (
        "+note: !!python/object:os.system x",
        [
            's.yaml:3: note: expected a value without a tag, got the tag "!!python/object:os.system"; '
            "remove the tag; put text that looks like a number in quotes",
        ],
    ),
    (
        "+retries: 1_000",
        [
            's.yaml:3: retries: expected a whole number >= 0, got "1_000"; write 1000',
        ],
    ),
    (
        "+retries: 3.0",
        [
            "s.yaml:3: retries: expected a whole number >= 0, got 3.0; write 3",
        ],
    ),
    (
        "+--- \nseed: 3",
        [
            "s.yaml:3: expected one document, got a second one after `---`; put it into a file of its own",
        ],
    ),
]

SYNTAX = [
    (
        "a:\n\t- b\n",
        [
            's.yaml:2: expected spaces for indentation, got "- b"; replace each tab by spaces',
        ],
    ),
    (
        "a: b: c\n",
        [
            's.yaml:1: expected one `key: value` a line, got "a: b: c"; align the line with its neighbours; '
            "a value that contains `: ` needs quotes; a key ends with a colon and a space",
        ],
    ),
    (
        "a 1\nb: 2\n",
        [
            's.yaml:2: expected one `key: value` a line, got "b: 2"; align the line with its neighbours; a '
            "value that contains `: ` needs quotes; a key ends with a colon and a space",
        ],
    ),
    (
        "a:\n  b: 1\n   c: 2\n",
        [
            's.yaml:3: expected one `key: value` a line, got "c: 2"; align the line with its neighbours; a '
            "value that contains `: ` needs quotes; a key ends with a colon and a space",
        ],
    ),
    (
        "a: [1, 2\nb: 3\n",
        [
            's.yaml:2: expected `,` or `]` in a list, got "b: 3"; close the list with `]`',
        ],
    ),
    (
        'a: "x\n',
        [
            "s.yaml:2: expected a closing quote, got the end of the file; close the quote that is still open",
        ],
    ),
    (
        "a: {b: 1\nc: 2",
        [
            's.yaml:2: expected `,` or `}` in a mapping, got "c: 2"; close the mapping with `}`',
        ],
    ),
    (
        "- a\nb: 2\n",
        [
            's.yaml:2: expected keys of one mapping, or items of one list, in the same column, got "b: 2"; '
            "align the line with its neighbours; a value that contains `: ` needs quotes; a key ends with a "
            "colon and a space",
        ],
    ),
    (
        "a: @x\n",
        [
            's.yaml:1: expected a value, got "a: @x"; put a value that begins with a special character in quotes',
        ],
    ),
    (
        "a: 'it's'\n",
        [
            "s.yaml:1: expected the end of the value, got \"a: 'it's'\"; put a value that contains quotes in "
            "quotes of the other kind",
        ],
    ),
    (
        "]",
        [
            's.yaml:1: expected an opening bracket before `]`, got "]"; remove the bracket, or put the text in quotes',
        ],
    ),
    (
        "a: }\n",
        [
            's.yaml:1: expected an opening brace before `}`, got "a: }"; remove the brace, or put the text in quotes',
        ],
    ),
    (
        "a: [1, 2]]\n",
        [
            's.yaml:1: expected an opening bracket before `]`, got "a: [1, 2]]"; remove the bracket, or put '
            "the text in quotes",
        ],
    ),
    (
        "a: *x",
        [
            "s.yaml:1: a: expected the name of an anchor (`&name`) whose value ends above, got `*x`; write "
            "the value itself",
        ],
    ),
    (
        "a: &a [*a]",
        [
            "s.yaml:1: a[0]: expected the name of an anchor (`&name`) whose value ends above, got `*a`; "
            "write the value itself",
        ],
    ),
    (
        'a: "\\UFFFFFFFF"\n',
        [
            "s.yaml:1: expected YAML, got something that cannot be read; look for a control "
            "character, a malformed escape or a directive (`%`)",
        ],
    ),
    (
        "a: \x01\n",
        [
            "s.yaml:1: expected printable text, got the character 0x0001; remove the character",
        ],
    ),
    (
        "%YAML 3.0\n---\na: 1\n",
        [
            's.yaml:1: expected YAML, got "%YAML 3.0"; found incompatible YAML document (version 1.* is required)',
        ],
    ),
]


def messages(text: str) -> list[str]:
    whole = HEAD + text[1:] if text.startswith("+") else text
    with pytest.raises(ScenarioError) as raised:
        validate(parse(whole, "s.yaml"), Root)
    return str(raised.value).split("\n")


@pytest.mark.parametrize(("text", "expected"), VALUES, ids=[text[:60] for text, _ in VALUES])
def test_message_about_a_value(text: str, expected: list[str]) -> None:
    assert messages(text) == expected


@pytest.mark.parametrize(("text", "expected"), SYNTAX, ids=[text[:60] for text, _ in SYNTAX])
def test_message_about_syntax(text: str, expected: list[str]) -> None:
    assert messages(text) == expected
