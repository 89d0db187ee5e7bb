"""A report's words: which way is better, what is missing, what is undecided, equal, or was never compared."""

import numpy as np
import pytest
from report_studies import figures, written

from netsim.study.plots.forest import difference_plots
from netsim.study.plots.tradeoff import tradeoff_plots
from netsim.study.reporting.answer import answer
from netsim.study.reporting.blocks import Bullets, Table
from netsim.study.reporting.sections import page_of
from netsim.study.reporting.view import view_of
from netsim.study.reporting.winners import clear_winners
from netsim.study.results import load_study

RADIOS = {"radio": ["A", "B", "C"]}


def shown(folder, axes, repetitions, law, **changes):
    written(folder, axes, repetitions, law, **changes)
    return view_of(load_study(folder))


def bullets(view):
    return next(block for block in answer(view) if isinstance(block, Bullets)).items


def caveats(view):
    section = next(each for each in page_of(view, {}, "").sections if each.title == "Assumptions and caveats")
    return "\n".join(section.blocks[0].items)


def lasting(levels, repetition):
    """C lasts longest and errs most."""
    place = "ABC".index(levels["radio"])
    return {
        "association_error": 0.1 * (1 + place) + 1e-4 * repetition,
        "lifetime_first_dead_days": 50.0 * (1 + place) + 0.1 * repetition,
        "delivery_ratio_unicast": 0.5 + 0.1 * place + 1e-4 * repetition,
        "energy_j": 3.0 - place + 1e-3 * repetition,
    }


def test_where_higher_is_better_the_best_has_the_most(tmp_path):
    costs = ("lifetime_first_dead_days", "delivery_ratio_unicast")
    view = shown(tmp_path, RADIOS, 8, lasting, costs=costs)
    text = "\n".join(bullets(view))
    assert "Most on average in lifetime to the first death" in text
    assert "Least" not in text
    assert "least cost" not in text
    assert "to the best cost: A → B → C" in text
    (plot,) = tradeoff_plots(view)
    assert "better is below and to the right" in plot.caption


def test_costs_of_both_senses_are_told_apart(tmp_path):
    view = shown(tmp_path, RADIOS, 8, lasting, costs=("energy_j", "lifetime_first_dead_days"))
    assert "Best on average in energy" in "\n".join(bullets(view))
    (plot,) = tradeoff_plots(view)
    assert "to the left, of lifetime to the first death to the right" in plot.caption


def effects(by_setting):
    """The cost of B against A at each setting; common noise, and own noise where the effect is not exact."""

    def law(levels, repetition):
        own, shared = np.random.default_rng([repetition, len(levels["mac"])]).normal(size=2)
        effect, noise = by_setting[levels["mac"]]
        more = effect + noise * own if levels["algorithm"] == "B" else 0.0
        return {"association_error": 0.5, "energy_j": 5.0 + 0.1 * shared + more}

    return law


@pytest.mark.parametrize(
    ("by_setting", "said"),
    [
        ({"x": (-1, 0.01), "yy": (-1, 0.01), "zzz": (0, 0)}, "**better** in 2 of 3 settings, equal in the other, in energy"),
        ({"x": (-1, 0.01), "yy": (0, 1), "zzz": (0, 1)}, "**better** in 1 of 3 settings, undecided in the others,"),
        ({"x": (-1, 0.01), "yy": (0, 1), "zzz": (0, 0)},
         "**better** in 1 of 3 settings, undecided in 1 and equal in 1, in energy"),
        ({"x": (0, 1), "yy": (0, 0)}, "undecided in 1 of 2 settings, equal in the other, in energy"),
        ({"x": (0, 0), "yy": (0, 0)}, "equal in every metric"),
    ],
)  # fmt: skip
def test_the_other_settings_are_called_what_they_are(tmp_path, by_setting, said):
    axes = {"algorithm": ["A", "B"], "mac": list(by_setting)}
    view = shown(tmp_path, axes, 12, effects(by_setting), costs=("energy_j",))
    assert said in bullets(view)[0]


def test_bold_obeys_the_adjustment_that_the_table_of_differences_obeys(tmp_path):
    """A difference of p = 0.015 in one of eight settings: unadjusted a winner, among the eight chance."""
    more = (1.0, 2.0, 3.0, 2.5)

    def law(levels, repetition):
        at_x = levels["algorithm"] == "B" and levels["mac"] == "a"
        sign = (-1) ** repetition * (levels["algorithm"] == "B")
        return {"energy_j": 5.0 + (more[repetition] if at_x else sign)}

    alone = shown(tmp_path / "one", {"algorithm": ["A", "B"], "mac": ["a"]}, 4, law)
    assert clear_winners(alone, "energy_j") == {0}
    many = shown(tmp_path / "many", {"algorithm": ["A", "B"], "mac": list("abcdefgh")}, 4, law)
    assert clear_winners(many, "energy_j") == set()


def test_a_winner_is_better_than_the_baseline_by_the_studys_own_verdict_too(tmp_path):
    """Settings split the comparisons by the circumstances; those against the baseline are adjusted for all."""

    def law(levels, repetition):
        own = np.random.default_rng([repetition, ord(levels["radio"])]).normal()
        return {"energy_j": {"A": 5.0, "B": 6.0, "C": 7.0}[levels["radio"]] + 0.2 * own}

    for repetitions in range(3, 9):
        view = shown(tmp_path / str(repetitions), RADIOS, repetitions, law)
        decided = (view.differences["p_holm"] < 0.05) & (view.differences["metric"] == "energy_j")
        if 0 in clear_winners(view, "energy_j"):
            assert decided.sum() == 2
    assert clear_winners(view, "energy_j") == {0}


def test_what_never_happens_is_neither_beaten_nor_passed_over(tmp_path):
    def law(levels, repetition):
        never = levels["radio"] == "C"
        return lasting(levels, repetition) | {"lifetime_partition_days": None} if never else {
            **lasting(levels, repetition), "lifetime_partition_days": 10.0 + ord(levels["radio"]) + 0.01 * repetition
        }  # fmt: skip

    view = shown(tmp_path, RADIOS, 8, law, costs=("lifetime_partition_days", "energy_j"))
    assert clear_winners(view, "lifetime_partition_days") == set()
    assert clear_winners(view, "energy_j") == {2}
    text = "\n".join(bullets(view))
    assert "**B** (not every trial has a figure: C)" in text
    assert "A → B (not every trial has a figure: C)" in text


def test_means_that_differ_by_rounding_are_equal_in_words(tmp_path):
    def law(levels, repetition):
        return {"association_error": 0.5, "energy_j": {"A": 0.1 + 0.2, "B": 0.3, "C": 0.4}[levels["radio"]]}

    text = "\n".join(bullets(shown(tmp_path, RADIOS, 8, law, costs=("energy_j",))))
    assert "Least on average in energy: **A** and **B** alike" in text
    assert text.endswith("A = B.")


def test_what_repetitions_cannot_tell_from_the_pareto_set_is_named(tmp_path):
    def law(levels, repetition):
        own = np.random.default_rng([repetition, ord(levels["radio"])]).normal()
        error = {"A": 0.10, "B": 0.1001, "C": 0.9}[levels["radio"]] + 0.01 * own
        return {"association_error": error, "energy_j": {"A": 1.0, "B": 1.0, "C": 2.0}[levels["radio"]]}

    view = shown(tmp_path, RADIOS, 10, law, costs=("energy_j",))
    (best,) = view.pareto("energy_j", (0, 1, 2))
    other = "AB"[1 - best]
    assert bullets(view)[-1].endswith(f"{'AB'[best]} (not shown to be dominated: {other}).")
    assert "“Not shown to be dominated”" in caveats(view)


def test_a_baseline_of_0_has_no_relative_difference_and_the_report_says_so(tmp_path):
    def law(levels, repetition):
        noise = np.random.default_rng([repetition, len(levels["mac"])]).normal()
        error = {"x": 0.0, "yy": 0.2 + 0.01 * noise}[levels["mac"]]
        return figures(levels, repetition) | {"association_error": error + 0.1 * (levels["algorithm"] == "B")}

    view = shown(tmp_path, {"algorithm": ["A", "B"], "mac": ["x", "yy"]}, 8, law, costs=("radio_messages",))
    table = next(block for block in answer(view) if isinstance(block, Table))
    assert "(baseline 0 in 1 of 2)" in table.rows[0][1]
    (plot,) = difference_plots(view)
    assert "Not drawn: 1 difference from a baseline of 0" in plot.caption


def test_energy_is_told_once_as_all_but_constant(tmp_path):
    view = shown(tmp_path, {"tolerance": [0, 1, 2]}, 4, figures)
    assert "energy_j" in view.constant
    assert caveats(view).count("`energy_j`") == 1


def test_where_each_variant_has_its_own_seed_there_are_no_pairs_and_the_report_says_so(tmp_path):
    written(tmp_path, {"seed": [1, 2]}, 4, lambda levels, n: figures({}, n + 10 * levels["seed"]), seeds=(1, 2))
    results = load_study(tmp_path)
    results.trials["seed"] = results.trials["variant"] + 1
    view = view_of(results)
    assert "see the same targets" not in caveats(view)
    assert "No variant has a pair with its baseline (their seeds differ)" in caveats(view)
    assert "no pairs to compare in every metric" in bullets(view)[0]
