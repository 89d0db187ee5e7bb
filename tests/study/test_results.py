"""The tables of a study: one kind a column, one order, and the same from Parquet and CSV."""

import json
from dataclasses import replace

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pandas.testing import assert_frame_equal
from study_records import outcomes, study, tasks, trials

import netsim
from netsim.errors import ScenarioError
from netsim.study.info import INFO_FILE, NODES, RESULTS
from netsim.study.results import load_study, node_table, trial_table
from netsim.study.tables import read_table, typed, write_tables
from netsim.study.trial import Outcome


def written(folder, info, table, nodes=None):
    """A study's folder with these tables."""
    folder.mkdir(exist_ok=True)
    (folder / INFO_FILE).write_text(info.to_json(), encoding="utf-8")
    write_tables(folder, {RESULTS: table, NODES: node_table([], {}) if nodes is None else nodes})
    return folder


def test_every_kind_of_column_is_kept_and_both_files_give_the_table_back(tmp_path):
    info = study({"radio": ["cc2420", 'Ünï, "quoted" 雪'], "tolerance": [0, 0.1, 1]}, repetitions=2)

    def figures(levels, repetition):
        if levels["tolerance"] == 1 and repetition == 1:
            return None
        some = {} if levels["tolerance"] == 0 else {"frames_retry": 3, "energy_most_node": "n07"}
        return {
            "frames": 2**53 + 1,
            "interrupted": False,
            "latency_mean_s": 0.1 + repetition,
            "first_death_s": None,
            **some,
        }

    table = trials(info, figures)
    kinds = {name: str(kind) for name, kind in table.dtypes.items()}
    assert (kinds["frames"], kinds["frames_retry"], kinds["interrupted"]) == ("Int64", "Int64", "boolean")
    assert (kinds["tolerance"], kinds["first_death_s"], kinds["latency_mean_s"]) == ("float64",) * 3
    assert table["frames"].dropna().tolist() == [2**53 + 1] * 10
    folder = written(tmp_path / "s", info, table)
    for path in (folder, folder / "results.parquet", folder / "results.csv"):
        assert_frame_equal(netsim.load_results(path), table)
    assert_frame_equal(load_study(folder).trials, table)


LEVELS = st.one_of(
    st.lists(st.integers(-(2**70), 2**70), min_size=1, max_size=3, unique=True),
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=3, unique=True),
    st.lists(st.booleans(), min_size=1, max_size=2, unique=True),
    st.lists(st.text("a1.,\"'\n é-", max_size=4), min_size=1, max_size=3, unique=True),
    st.just([None, 1, 0.5, True, "x"]),
)
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text("an1 é", min_size=1),
)
COLUMNS = st.one_of(
    *(st.lists(st.one_of(st.none(), kind), min_size=6, max_size=6) for kind in (st.integers(), st.booleans(), VALUES)),
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=6, max_size=6),
)


@given(levels=LEVELS, column=COLUMNS)
def test_whatever_the_levels_and_figures_the_files_agree_with_the_table(tmp_path_factory, levels, column):
    info = study({"axis": levels}, repetitions=2)
    values = iter(column)
    table = trials(info, lambda levels, repetition: {"frames": next(values, None)})
    folder = written(tmp_path_factory.mktemp("s"), info, table)
    assert_frame_equal(netsim.load_results(folder), table)
    if all(not isinstance(value, str) for value in column):  # text that looks like a number is one, in a CSV file
        assert_frame_equal(netsim.load_results(folder / "results.csv"), table)


def test_columns_stand_in_the_order_of_the_catalogue_whichever_trial_came_first():
    info = study({"tolerance": [0, 1]}, repetitions=2)
    first = {"energy_by_state_j": {"radio.listen": 1.0}, "own": 1, "frames": 2, "energy_by_kind_j": {"k10": 1, "k9": 2}}
    second = {"association_error": 0.1, "energy_by_state_j": {"cpu.active": 2.0}, "frames": 2}
    one = trials(info, lambda levels, repetition: first if repetition else second)
    other = trials(info, lambda levels, repetition: second if repetition else first)
    assert list(one) == list(other)
    assert list(one)[8:] == [
        *("association_error", "frames", "energy_by_state_j.cpu.active", "energy_by_state_j.radio.listen"),
        *("energy_by_kind_j.k9", "energy_by_kind_j.k10", "own"),
    ]


def test_the_order_in_which_trials_end_does_not_matter():
    info = study({"tolerance": [0, 1]}, repetitions=3)
    found = outcomes(info, lambda levels, repetition: {"frames": repetition, f"k{levels['tolerance']}": 1})
    table = trial_table(info, tasks(info), found, [1, 1])
    again = trial_table(info, tasks(info)[::-1], dict(reversed(found.items())), [1, 1])
    assert_frame_equal(table, again)


def test_an_interrupted_study_has_the_rows_that_there_are(tmp_path):
    info = study({"tolerance": [0, 1]}, repetitions=3)
    found = dict(list(outcomes(info, lambda levels, repetition: {"frames": 1}).items())[:3])
    table = trial_table(info, tasks(info), found, [1, 1])
    assert table["trial"].tolist() == [0, 1, 2]
    empty = trial_table(info, tasks(info), {}, [1, 1])
    folder = written(tmp_path / "s", info, empty)
    assert list(netsim.load_results(folder)) == list(netsim.load_results(folder / "results.csv")) == list(table)[:-1]


def test_an_axis_called_as_a_metric_keeps_its_levels():
    info = study({"rounds": [5, 10]}, repetitions=1)
    table = trials(info, lambda levels, repetition: {"rounds": 3})
    assert (table["rounds"].tolist(), table["rounds_measured"].tolist()) == ([5, 10], [3, 3])


def test_levels_of_mixed_kinds_become_labels(tmp_path):
    info = study({"limit": [None, 1, 0.5, True, "x"]}, repetitions=1)
    table = trials(info, lambda levels, repetition: {"frames": 1})
    assert table["limit"].tolist() == ["null", "1", "0.5", "true", "x"]


def test_names_that_look_like_numbers_stay_names(tmp_path):
    info = study({"firmware": ["007", "1e5", "True"]}, repetitions=1)
    table = trials(info, lambda levels, repetition: {"frames": 1})
    folder = written(tmp_path / "s", info, table)
    assert netsim.load_results(folder / "results.csv")["firmware"].tolist() == ["007", "1e5", "True"]


def test_a_seed_that_64_bits_do_not_hold_is_kept(tmp_path):
    info = study({"tolerance": [0]}, repetitions=1)
    table = trial_table(info, tasks(info), outcomes(info, lambda *_: {"frames": 1}), [2**80])
    folder = written(tmp_path / "s", info, table)
    assert int(netsim.load_results(folder)["seed"][0]) == 2**80
    assert_frame_equal(netsim.load_results(folder / "results.csv"), table)


def test_nodes_have_rows_of_their_own(tmp_path):
    info = study({"tolerance": [0, 1]}, repetitions=1)
    nodes = {
        **{"node": [0, 1], "name": ["n0", "12"], "group": ["sensors", "sensors"], "role": ["sensor", "sink"]},
        **{"x_m": [0.0, 5.0], "y_m": [1.0, 1.5], "energy_j": [0.5, None], "death_s": [None, None]},
    }
    found = {task.key: Outcome(task.trial, task.key, "ok", nodes=nodes) for task in tasks(info)}
    table = node_table(tasks(info), found)
    assert table[["trial", "variant", "node"]].to_numpy().tolist() == [[0, 0, 0], [0, 0, 1], [1, 1, 0], [1, 1, 1]]
    folder = written(tmp_path / "s", info, trials(info, lambda *_: {"frames": 1}), table)
    assert_frame_equal(load_study(folder).nodes, table)
    texts = ("status", "error", "command", "name", "group", "role")
    assert_frame_equal(read_table(folder / "nodes.csv", texts), table)


def test_figures_by_node_are_in_the_table_of_nodes_alone():
    info = study({}, repetitions=1)
    table = trials(info, lambda *_: {"energy_by_node_j": {"n0": 1.0}, "death_by_node_s": {}, "frames": 1, "seed": 7})
    assert list(table) == ["trial", "variant", "repetition", "seed", "status", "error", "command", "frames"]


def test_the_widest_and_longest_tables_are_quick_enough(tmp_path):
    info = study({"tolerance": list(range(20))}, repetitions=10)
    table = trials(info, lambda *_: {"own": {f"k{number}": number for number in range(2000)}})
    assert table.shape == (200, 2008)
    assert list(table)[8:11] == ["own.k0", "own.k1", "own.k2"]
    assert_frame_equal(netsim.load_results(written(tmp_path / "s", info, table)), table)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("nowhere", None, "no such file"),
        ("results.parquet", b"not parquet", "expected the table of a study"),
        ("results.csv", b"", "expected the table of a study"),
        ("results.csv", b"a,b\n1\n\xff,2,3\n", "expected the table of a study"),
    ],
)
def test_what_is_no_table_is_told_in_one_line(tmp_path, name, content, expected):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ScenarioError, match=expected) as caught:
        netsim.load_results(tmp_path / name)
    assert "\n" not in str(caught.value)
    assert "netsim study" in str(caught.value)


def test_missing_and_not_a_number_are_the_same():
    assert typed([None, float("nan"), 1.5]).isna().tolist() == [True, True, False]
    assert pd.isna(typed([None, 1])[0])
    assert str(typed([]).dtype) == "float64"


def test_a_description_is_read_back_as_it_was():
    info = study({"tolerance": [0, 0.1], "radio": ["a", None], "on": [True, False]})
    assert type(info).from_json(info.to_json()) == info
    with pytest.raises(ValueError, match="format"):
        type(info).from_json(json.dumps({"format": 0}))
    assert replace(info, name="x") != info
