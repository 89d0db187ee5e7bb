"""From axes to combinations: how many, in which order, called what."""

import itertools
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.reading import check_document, parse
from netsim.study.axes import combinations, range_values, settings_of
from netsim.study.schema import Range, Study

HEAD = {"kind": "study", "schema_version": 1, "name": "s", "question": "?", "scenario": "base.yaml"}

scalars = st.one_of(st.integers(-1000, 1000), st.booleans(), st.text("abc", min_size=1, max_size=3))
columns = st.lists(scalars, min_size=1, max_size=4, unique_by=lambda value: (str(value),))


def study_of(**more):
    document = parse(json.dumps({**HEAD, **more}), "study.yaml")
    study, findings = check_document(document, Study)
    assert findings == []
    return study, document


def levels_of(**more):
    return [dict(each.levels) for each in combinations(*study_of(**more))]


@given(st.lists(columns, max_size=4))
def test_every_combination_once_the_last_axis_changing_fastest(axes):
    sweep = [{"path": f"p{index}", "values": values} for index, values in enumerate(axes)]
    made = combinations(*study_of(sweep=sweep))
    assert len(made) == math.prod(map(len, axes))
    for index, each in enumerate(made):
        left = index
        for axis in reversed(range(len(axes))):
            left, place = divmod(left, len(axes[axis]))
            level = each.levels[f"p{axis}"]
            assert (level, type(level)) == (axes[axis][place], type(axes[axis][place]))
        assert [(path, node.value) for path, node in each.values] == [
            (f"p{axis}", each.levels[f"p{axis}"]) for axis in range(len(axes))
        ]


@given(
    st.floats(-1e6, 1e6).map(lambda value: round(value, 3)),
    st.floats(-1e6, 1e6).map(lambda value: round(value, 3)),
    st.integers(2, 50),
)
def test_a_range_with_a_count_has_both_ends_and_equal_distances(start, stop, count):
    values = range_values(Range(start=start, stop=stop, count=count))
    assert len(values) == count
    assert values[0] == pytest.approx(start, rel=1e-11, abs=1e-300)
    assert values[-1] == pytest.approx(stop, rel=1e-11, abs=1e-300)
    step = (stop - start) / (count - 1)
    for before, after in itertools.pairwise(values):
        assert after - before == pytest.approx(step, abs=1e-5 * abs(step) + 1e-9 * max(1.0, abs(start), abs(stop)))


@given(st.integers(0, 30), st.integers(1, 40), st.sampled_from([0.1, 0.2, 0.25, 0.3, 0.05, 1.0]))
def test_a_range_with_a_step_holds_the_decimals_that_one_would_write(first, steps, step):
    start = round(first * step, 10)
    values = range_values(Range(start=start, stop=round(start + steps * step, 10), step=step))
    assert values == [round(start + index * step, 10) for index in range(steps + 1)]


def test_ranges_as_one_would_write_them():
    assert range_values(Range(start=0, stop=1, step=0.1)) == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    assert range_values(Range(start=0, stop=1, step=0.3)) == [0.0, 0.3, 0.6, 0.9]
    assert range_values(Range(start=3, stop=1, step=-1)) == [3, 2, 1]
    assert range_values(Range(start=0.001, stop=1, count=4, scale="log")) == [0.001, 0.01, 0.1, 1.0]
    assert range_values(Range(start=0, stop=2, count=40))[1:3] == [0.0512821, 0.1025641]
    assert range_values(Range(start=1, stop=10, count=4, scale="log")) == [1.0, 2.15443, 4.64159, 10.0]
    whole = range_values(Range(start=1, stop=9, count=3))
    assert whole == [1, 5, 9]
    assert all(isinstance(value, int) for value in whole)


@pytest.mark.parametrize(
    "wrong",
    [
        {"start": 0, "stop": 1},
        {"start": 0, "stop": 1, "count": 3, "step": 0.5},
        {"start": 0, "stop": 1, "step": -0.5},
        {"start": 0, "stop": 1, "step": 0.0},
        {"start": 0, "stop": 1, "count": 3, "scale": "log"},
        {"start": 1, "stop": 2, "step": 0.5, "scale": "log"},
    ],
)
def test_ranges_that_lead_nowhere(wrong):
    with pytest.raises(ValueError, match=r"step|start"):
        Range(**wrong)


def test_labels_come_from_the_value_its_type_or_the_file():
    axis = {"path": "medium", "values": [{"type": "ideal"}, {"type": "unit-disk", "radius_m": 5}]}
    assert levels_of(sweep=[axis]) == [{"medium": "ideal"}, {"medium": "unit-disk"}]
    named = {"path": "nodes[0].tx_power_dbm", "name": "power", "values": [-10, 0], "labels": ["low", "high"]}
    assert levels_of(sweep=[named]) == [{"power": "low"}, {"power": "high"}]
    assert levels_of(sweep=[{"path": "a.b[3].c", "values": [1]}]) == [{"c": 1}]
    assert levels_of(sweep=[{"path": "p", "values": [[1, 2], None]}]) == [{"p": "[1, 2]"}, {"p": None}]


def test_zip_goes_through_its_lists_together():
    axis = {"name": "size", "zip": {"rows": [2, 3], "columns": [4, 5]}}
    made = combinations(*study_of(sweep=[axis]))
    assert [dict(each.levels) for each in made] == [{"size": 2}, {"size": 3}]
    assert [[(path, node.value) for path, node in each.values] for each in made] == [
        [("rows", 2), ("columns", 4)],
        [("rows", 3), ("columns", 5)],
    ]


def test_cases_bring_scenarios_and_values_and_later_axes_win():
    cases = [{"name": "one", "scenario": "other.yaml"}, {"name": "two", "set": {"seed": 3}}]
    sweep = [{"name": "way", "cases": cases}, {"path": "fidelity", "values": ["ideal"]}]
    made = combinations(*study_of(set={"duration_s": 1}, seed=7, sweep=sweep))
    assert [each.scenario.value for each in made] == ["other.yaml", "base.yaml"]
    assert [[(path, node.value) for path, node in each.values] for each in made] == [
        [("seed", 7), ("duration_s", 1), ("fidelity", "ideal")],
        [("seed", 7), ("duration_s", 1), ("seed", 3), ("fidelity", "ideal")],
    ]


def test_values_keep_the_line_they_stand_on():
    text = "\n".join(
        [
            *(f"{key}: {json.dumps(value)}" for key, value in HEAD.items()),
            "sweep:",
            "  - path: seed",
            "    values:",
            "      - 1",
            "      - 2",
        ]
    )
    document = parse(text, "study.yaml")
    study, _ = check_document(document, Study)
    settings = settings_of(study.sweep[0], document.root.child("sweep").child(0))
    assert [setting.values[0][1].line for setting in settings] == [9, 10]


@pytest.mark.parametrize(
    "axis",
    [
        {"path": "p"},
        {"path": "p", "values": [1], "range": {"start": 0, "stop": 1, "count": 2}},
        {"values": [1]},
        {"name": "n", "path": "p", "cases": [{"name": "a"}]},
        {"cases": [{"name": "a"}]},
        {"name": "n", "zip": {"a": [1, 2], "b": [1]}},
        {"name": "n", "zip": {}},
        {"name": "n", "zip": {"a": []}},
        {"name": "n", "cases": [{"name": "a"}], "labels": ["b"]},
    ],
)
def test_axes_that_do_not_say_what_they_vary(axis):
    document = parse(json.dumps({**HEAD, "sweep": [axis]}), "study.yaml")
    _, findings = check_document(document, Study)
    assert [finding.path for finding in findings] == ["sweep[0]"]
