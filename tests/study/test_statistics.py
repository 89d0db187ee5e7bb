"""Aggregates and differences against scipy and numpy, and what holds whatever the data."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pandas.testing import assert_frame_equal
from scipy import stats
from study_records import study, trials

from netsim.errors import ScenarioError
from netsim.study.levels import at, label_of
from netsim.study.samples import holm
from netsim.study.statistics import aggregate, paired_differences, unpaired_differences, variant_differences

AXES = {"tolerance": [0, 0.1, 1], "radio": ["cc2420", "cc1000"]}


def noisy(seed=3, missing=0.0, repetitions=8):
    """A study with normal figures of common and own noise, some of them missing."""
    rng = np.random.default_rng(seed)
    common = rng.normal(size=repetitions)

    def figures(levels, repetition):
        if rng.random() < missing:
            return None
        value = common[repetition] + 0.3 * rng.normal() + float(levels["tolerance"])
        return {"deviation": value, "frames": int(100 * abs(value)), "solved": bool(value > 0.2)}

    info = study(AXES, repetitions)
    return info, trials(info, figures)


def cell(table, metric, **levels):
    found = table[(table["metric"] == metric) & at(table, levels)]
    assert len(found) == 1
    return found.iloc[0]


def figures(table, metric, **levels):
    return table[at(table, levels)].sort_values("repetition")[metric].astype(float).to_numpy()


@pytest.mark.parametrize("metric", ["deviation", "frames", "solved"])
def test_aggregates_equal_numpys_and_scipys(metric):
    info, table = noisy()
    summary = aggregate(table, info.axis_names, [metric])
    assert list(summary) == ["variant", "tolerance", "radio", "metric", "n", "mean", "sd", "se", "low", "high"]
    for variant in info.variants:
        values = figures(table, metric, **variant.levels)
        row = cell(summary, metric, **variant.levels)
        low, high = stats.t.interval(0.95, 7, values.mean(), values.std(ddof=1) / np.sqrt(8))
        expected = [variant.number, 8, values.mean(), values.std(ddof=1), values.std(ddof=1) / np.sqrt(8), low, high]
        got = row[["variant", "n", "mean", "sd", "se", "low", "high"]].astype(float)
        np.testing.assert_allclose(got, expected, rtol=1e-12)


@pytest.mark.parametrize("metric", ["deviation", "frames", "solved"])
def test_paired_differences_equal_scipys_paired_t_test(metric):
    info, table = noisy()
    found = paired_differences(table, info.axis_names, "tolerance", 0, [metric])
    assert len(found) == 4
    for row in found.to_dict("records"):
        values = figures(table, metric, tolerance=row["tolerance"], radio=row["radio"])
        base = figures(table, metric, tolerance=0, radio=row["radio"])
        if (values == base).all():  # scipy's p is not a number then
            assert (row["verdict"], row["difference"], row["p"]) == ("equal", 0, 1)
            continue
        test = stats.ttest_rel(values, base)
        interval = test.confidence_interval(0.95)
        got = [row[name] for name in ("n", "baseline_mean", "mean", "difference", "low", "high", "p", "relative")]
        apart = values.mean() - base.mean()
        wanted = [8, base.mean(), values.mean(), apart, *interval, test.pvalue, apart / abs(base.mean())]
        np.testing.assert_allclose(got, wanted, rtol=1e-9)
        assert (
            row["verdict"]
            == {1: "higher", -1: "lower", 0: "no difference shown"}[int(interval.low > 0) - int(interval.high < 0)]
        )


def test_unpaired_differences_equal_scipys_welch_test():
    info, table = noisy(missing=0.2)
    found = unpaired_differences(table, info.axis_names, "tolerance", 0, ["deviation"])
    for row in found.to_dict("records"):
        values = figures(table, "deviation", tolerance=row["tolerance"], radio=row["radio"])
        base = figures(table, "deviation", tolerance=0, radio=row["radio"])
        values, base = values[~np.isnan(values)], base[~np.isnan(base)]
        test = stats.ttest_ind(values, base, equal_var=False)
        interval = test.confidence_interval(0.95)
        got = [row[name] for name in ("n", "n_baseline", "difference", "low", "high", "p")]
        wanted = [len(values), len(base), values.mean() - base.mean(), *interval, test.pvalue]
        np.testing.assert_allclose(got, wanted, rtol=1e-9)


@given(st.randoms(use_true_random=False))
def test_the_order_of_the_rows_changes_no_digit(shuffler):
    info, table = noisy(missing=0.2)
    order = list(range(len(table)))
    shuffler.shuffle(order)
    mixed = table.iloc[order]
    axes, metrics = info.axis_names, ["deviation", "frames", "solved"]
    assert_frame_equal(aggregate(mixed, axes, metrics), aggregate(table, axes, metrics), rtol=0, atol=0)
    for differences in (paired_differences, unpaired_differences):
        one, other = (differences(each, axes, "radio", "cc2420", metrics) for each in (mixed, table))
        assert_frame_equal(one, other, rtol=0, atol=0)


def test_pairs_are_repetitions_that_both_have():
    info = study({"tolerance": [0, 1]}, repetitions=4)
    given_figures = {0: [1.0, 2.0, None, 4.0], 1: [2.0, None, 5.0, 6.0]}
    table = trials(info, lambda levels, repetition: {"deviation": given_figures[levels["tolerance"]][repetition]})
    row = paired_differences(table, ["tolerance"], "tolerance", 0, ["deviation"]).iloc[0]
    assert (row["n"], row["baseline_mean"], row["mean"], row["difference"]) == (2, 2.5, 4.0, 1.5)


def test_a_share_of_nothing_is_missing():
    info = study({"tolerance": [0, 1, 2]}, repetitions=2)
    table = trials(info, lambda levels, repetition: {"frames_retry": levels["tolerance"] * (1 + repetition)})
    assert paired_differences(table, ["tolerance"], "tolerance", 0, ["frames_retry"])["relative"].isna().all()
    found = paired_differences(
        table.assign(frames_retry=-table["frames_retry"]), ["tolerance"], "tolerance", 1, ["frames_retry"]
    )
    assert found["relative"].tolist() == [1.0, -1.0]


def test_trials_of_other_seeds_are_no_pair():
    info = study({"tolerance": [0, 1]}, repetitions=4)
    table = trials(info, lambda levels, repetition: {"deviation": 1.0})
    table.loc[table["variant"] == 1, "seed"] = 2
    row = paired_differences(table, ["tolerance"], "tolerance", 0, ["deviation"]).iloc[0]
    assert (row["n"], row["verdict"]) == (0, "too few pairs")
    assert unpaired_differences(table, ["tolerance"], "tolerance", 0, ["deviation"]).iloc[0]["n"] == 4


def test_failed_trials_count_nowhere_even_with_figures():
    info = study({"tolerance": [0]}, repetitions=3)
    table = trials(info, lambda levels, repetition: {"deviation": float(repetition)})
    table.loc[2, "status"] = "failed"
    row = aggregate(table, ["tolerance"], ["deviation"]).iloc[0]
    assert (row["n"], row["mean"]) == (2, 0.5)


def test_one_figure_has_a_mean_and_no_interval():
    info = study({"tolerance": [0, 1]}, repetitions=1)
    table = trials(info, lambda levels, repetition: {"deviation": levels["tolerance"] + 0.5})
    row = aggregate(table, ["tolerance"], ["deviation"]).iloc[0]
    assert (row["n"], row["mean"]) == (1, 0.5)
    assert row[["sd", "se", "low", "high"]].isna().all()
    row = paired_differences(table, ["tolerance"], "tolerance", 0, ["deviation"]).iloc[0]
    assert (row["n"], row["difference"], row["verdict"]) == (1, 1.0, "too few pairs")


def test_what_is_missing_everywhere_gives_rows_without_figures():
    info = study({"tolerance": [0, 1]}, repetitions=2)
    table = trials(info, lambda levels, repetition: None if levels["tolerance"] else {"deviation": 1.0, "name": "n1"})
    summary = aggregate(table, ["tolerance"], ["deviation", "name", "absent"])
    assert summary["n"].tolist() == [2, 0, 0, 0, 0, 0]
    found = paired_differences(table, ["tolerance"], "tolerance", 0, ["deviation", "name", "absent"])
    assert found["verdict"].tolist() == ["too few pairs"] * 3
    assert found["p_holm"].isna().all()


def test_a_table_without_trials_gives_tables_without_rows():
    info = study(AXES)
    empty = trials(info, lambda *_: {"deviation": 1.0}).iloc[:0]
    assert aggregate(empty, info.axis_names, ["deviation"]).empty
    assert paired_differences(empty, info.axis_names, "tolerance", 0, ["deviation"]).empty


def test_a_variant_against_itself_is_equal_to_the_last_digit():
    _, table = noisy()
    twice = pd.concat([table, table.assign(variant=table["variant"] + 6, trial=table["trial"] + 48)])
    found = variant_differences(twice, 0, [6], ["deviation", "frames", "solved"])
    assert found["verdict"].tolist() == ["equal"] * 3
    assert (found[["difference", "se", "low", "high"]] == 0).all(axis=None)


def test_the_rounding_of_sums_is_no_difference():
    info = study({"tolerance": [0, 1]}, repetitions=5)
    table = trials(info, lambda levels, repetition: {"energy_j": 0.3 if levels["tolerance"] else 0.1 + 0.2})
    row = paired_differences(table, ["tolerance"], "tolerance", 0, ["energy_j"]).iloc[0]
    assert (row["verdict"], row["difference"]) == ("equal", 0)


@pytest.mark.parametrize(("repetitions", "verdict"), [(2, "too few pairs"), (5, "too few pairs"), (6, "higher")])
def test_a_difference_without_any_spread_is_shown_by_six_pairs(repetitions, verdict):
    """All signs alike has a chance of 2 in 2**n: 6 % of five pairs, 3 % of six."""
    info = study({"tolerance": [0, 1]}, repetitions)
    table = trials(info, lambda levels, repetition: {"frames": 10**17 + repetition + levels["tolerance"]})
    row = paired_differences(table, ["tolerance"], "tolerance", 0, ["frames"]).iloc[0]
    assert (row["difference"], row["se"], row["verdict"], row["p"]) == (1, 0, verdict, 2.0 ** (1 - repetitions))
    assert (row["low"] == row["high"] == 1) == (verdict == "higher")


@pytest.mark.parametrize(("repetitions", "verdict"), [(3, "too few pairs"), (4, "higher")])
def test_two_samples_without_any_spread_differ_by_four_each(repetitions, verdict):
    info = study({"tolerance": [0, 1]}, repetitions)
    table = trials(info, lambda levels, repetition: {"frames": levels["tolerance"]})
    row = unpaired_differences(table, ["tolerance"], "tolerance", 0, ["frames"]).iloc[0]
    values, base = np.ones(repetitions), np.zeros(repetitions)
    test = stats.permutation_test((values, base), lambda one, other: one.mean() - other.mean(), n_resamples=np.inf)
    assert row["verdict"] == verdict
    assert row["p"] == pytest.approx(test.pvalue)


@pytest.mark.parametrize(
    ("levels", "baseline"),
    [([0, 0.1], 0), ([0, 0.1], 0.0), ([True, False], False), ([None, 1], None), (["a", "b"], "b"), ([1, "auto"], 1)],
)
def test_a_baseline_is_found_by_its_label_whatever_the_column_holds(levels, baseline):
    info = study({"level": levels}, repetitions=2)
    table = trials(info, lambda levels, repetition: {"deviation": float(repetition)})
    assert len(paired_differences(table, ["level"], "level", baseline, ["deviation"])) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [(1, 1.0), (1, np.int64(1)), (True, np.bool_(True)), (None, float("nan")), (None, pd.NA), (0.1, np.float64(0.1))],
)
def test_a_level_has_one_label_wherever_it_comes_from(one, other):
    assert label_of(one) == label_of(other)


def test_levels_that_differ_have_other_labels():
    assert len({label_of(level) for level in (None, True, False, 0, 1, 0.1, 1e300, "a")}) == 8


def test_wrong_names_are_told():
    info, table = noisy()
    with pytest.raises(ScenarioError, match=r"expected one of 0, 0.1, 1, got 7"):
        paired_differences(table, info.axis_names, "tolerance", 7, ["deviation"])
    with pytest.raises(ScenarioError, match=r"expected one of tolerance, radio, got 'exponent'"):
        paired_differences(table, info.axis_names, "exponent", 7, ["deviation"])
    with pytest.raises(ScenarioError, match=r"one variant at tolerance=0, got 0 and 1; give all axes"):
        paired_differences(table, ["tolerance"], "tolerance", 0, ["deviation"])
    with pytest.raises(ScenarioError, match=r"a column `exponent`"):
        aggregate(table, ["exponent"], ["deviation"])
    with pytest.raises(ScenarioError, match=r"variant 0 once, got repetition 0 twice"):
        aggregate(pd.concat([table, table]), info.axis_names, ["deviation"])
    with pytest.raises(ScenarioError, match=r"variant 9: expected one with trials"):
        variant_differences(table, 0, [9], ["deviation"])


def test_p_is_adjusted_for_the_comparisons_of_its_own_metric():
    info, table = noisy()
    found = paired_differences(table, info.axis_names, "tolerance", 0, ["deviation", "frames"])
    for metric in ("deviation", "frames"):
        rows = found[found["metric"] == metric]
        assert rows["p_holm"].tolist() == holm(rows["p"].tolist())


@pytest.mark.parametrize("compare", [paired_differences, unpaired_differences])
def test_a_share_off_by_the_same_steps_in_two_pairs_is_no_verdict(compare):
    info = study({"algorithm": ["a", "b"]}, 2)
    errors = {
        "a": (3, 3) if compare is unpaired_differences else (3, 5),
        "b": (2, 2) if compare is unpaired_differences else (2, 4),
    }
    table = trials(info, lambda levels, n: {"association_error": 0.1 * errors[levels["algorithm"]][n] / 1.2})
    row = compare(table, ["algorithm"], "algorithm", "a", ["association_error"]).iloc[0]
    assert row["verdict"] == "too few pairs"
    assert not row["p_holm"] < 0.05


def test_independent_samples_that_are_equal_but_for_rounding_are_equal():
    info = study({"algorithm": ["a", "b"]}, 2)
    table = trials(info, lambda levels, n: {"energy_j": 0.1 + 0.2 if levels["algorithm"] == "a" else 0.3})
    row = unpaired_differences(table, ["algorithm"], "algorithm", "a", ["energy_j"]).iloc[0]
    assert row["verdict"] == "equal"
