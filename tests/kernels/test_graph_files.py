"""The two text formats, by hand-written files and by a writer for each."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.kernels.graph_files import parse_libdai, parse_uai

UAI = """MARKOV
3
2 2 3
2
1 0
2 0 2

2
 0.4 0.6
6
 1 2 3
 4 5 6
"""

LIBDAI = """# two factors
2

1
0
2
2
0 0.4   # first entry
1 0.6

2
2 0
3 2
5
0 1
1 2
2 3
3 4
5 6
"""


def test_uai_has_the_last_variable_fastest():
    graph = parse_uai(UAI, "g.uai")
    assert graph.cardinalities == (2, 2, 3)
    assert [factor.scope for factor in graph.factors] == [(0,), (0, 2)]
    np.testing.assert_array_equal(graph.factors[0].table, [0.4, 0.6])
    np.testing.assert_array_equal(graph.factors[1].table, [[1, 2, 3], [4, 5, 6]])


def test_libdai_has_the_first_variable_fastest_and_leaves_out_zeros():
    graph = parse_libdai(LIBDAI, "g.fg")
    assert graph.cardinalities == (2, 1, 3)
    assert [factor.scope for factor in graph.factors] == [(0,), (2, 0)]
    np.testing.assert_array_equal(graph.factors[1].table, [[1, 4], [2, 0], [3, 6]])


@st.composite
def models(draw):
    cards = draw(st.lists(st.integers(1, 3), min_size=1, max_size=4))
    scopes = draw(st.lists(st.lists(st.integers(0, len(cards) - 1), unique=True, max_size=3), max_size=4))
    value = st.floats(0.0, 1e6, allow_subnormal=False)
    tables = []
    for scope in scopes:
        size = int(np.prod([cards[v] for v in scope]))
        flat = draw(st.lists(value, min_size=size, max_size=size))
        tables.append(np.array(flat).reshape([cards[v] for v in scope]))
    return cards, scopes, tables


@given(models())
def test_written_models_are_read_back(model):
    cards, scopes, tables = model
    uai = ["MARKOV", len(cards), *cards, len(scopes)]
    uai += [word for scope in scopes for word in (len(scope), *scope)]
    uai += [word for table in tables for word in (table.size, *map(repr, table.ravel().tolist()))]
    libdai = [len(scopes)]
    for scope, table in zip(scopes, tables, strict=True):
        flat = table.ravel(order="F").tolist()
        libdai += [len(scope), *scope, *table.shape, sum(v > 0 for v in flat)]
        libdai += [word for index, v in enumerate(flat) if v > 0 for word in (index, repr(v))]
    for graph in (parse_uai("\n".join(map(str, uai)), "u"), parse_libdai("\n".join(map(str, libdai)), "l")):
        assert [list(factor.scope) for factor in graph.factors] == scopes
        for factor, table in zip(graph.factors, tables, strict=True):
            assert factor.table.tobytes() == np.ascontiguousarray(table).reshape(factor.table.shape).tobytes()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("BAYES\n1", "g:1: type: expected MARKOV, got 'BAYES'"),
        ("", "g:1: type: expected MARKOV, got the end of the file"),
        ("MARKOV\n2\n2 x", "g:3: cardinality of variable 1: expected a whole number of 1 or more, got 'x'"),
        ("MARKOV\n1 2\n1\n1 1", "g:4: variables of factor 0: expected a whole number from 0 to 0, got '1'"),
        ("MARKOV\n2 2 2\n1\n2 1 1", "g:4: variables of factor 0: expected each variable once, got (1, 1)"),
        ("MARKOV\n1 2\n1\n1 0\n3", "g:5: size of the table of factor 0: expected a whole number from 2 to 2, got '3'"),
        ("MARKOV\n1 2\n1\n1 0\n2 .5 -1", "g:5: table of factor 0: expected a number of 0 or more, got '-1'"),
        ("MARKOV\n1 2\n1\n1 0\n2 .5 inf", "g:5: table of factor 0: expected a number of 0 or more, got 'inf'"),
        (
            "MARKOV\n1 2\n1\n1 0\n2 .5",
            "g:5: table of factor 0: expected a number of 0 or more, got the end of the file",
        ),
        ("MARKOV\n1 2\n0\n7", "g:4: expected the end of the file, got '7'"),
        ("MARKOV\n2 9999 9999\n1\n2 0 1", "g:4: variables of factor 0: expected a table of at most"),
    ],
)
def test_wrong_uai_files_are_explained(text, message):
    with pytest.raises(ScenarioError) as refused:
        parse_uai(text, "g")
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("#\n\n-1", "g:3: number of factors: expected a whole number of 0 or more, got '-1'"),
        ("1\n1\n0\n2\n1\n2 5", "g:6: index of an entry of factor 0: expected a whole number from 0 to 1, got '2'"),
        ("1\n1\n0\n2\n3", "g:5: number of entries of factor 0: expected a whole number from 0 to 2, got '3'"),
        ("2\n1\n0\n2\n0\n1\n0\n3\n0", "g:8: cardinalities of factor 1: expected 2 states of variable 0, got 3"),
        ("1\n1\n0\n2\n1\n0 x # 5", "g:6: value of entry 0 of factor 0: expected a number of 0 or more, got 'x'"),
        ("1\n2\n0 0\n2 2\n0", "g:4: variables of factor 0: expected each variable once, got (0, 0)"),
    ],
)
def test_wrong_libdai_files_are_explained(text, message):
    with pytest.raises(ScenarioError) as refused:
        parse_libdai(text, "g")
    assert message in str(refused.value)
