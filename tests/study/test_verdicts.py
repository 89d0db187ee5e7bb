"""Where a comparison holds and where it flips; published figures beside the measured."""

import math

import numpy as np
import pytest
from study_records import study, trials

from netsim.study.info import PublishedInfo
from netsim.study.published import z_score
from netsim.study.statistics import aggregate, flips, published_table, verdicts

AXES = {"algorithm": ["plain", "clever"], "exponent": [4, 2, 2.5, 3], "radio": ["cc2420", "cc1000"]}


def crossing(levels, repetition):
    """The clever one costs less up to an exponent between 2.5 and 3, and everywhere on the CC1000."""
    effect = (levels["exponent"] - 2.7) if levels["radio"] == "cc2420" else -1.0
    clever = effect if levels["algorithm"] == "clever" else 0.0
    rng = np.random.default_rng(
        [repetition, *map(ord, levels["algorithm"] + levels["radio"]), int(10 * levels["exponent"])]
    )
    return {"energy_j": 10 + 5 * math.sin(repetition) + clever + 0.01 * rng.normal()}


def test_a_verdict_that_flips_says_between_which_levels():
    info = study(AXES, 6)
    table = trials(info, crossing)
    overall = verdicts(table, info, "energy_j").to_dict("records")
    assert len(overall) == 1
    assert overall[0]["level"] == "clever"
    assert [overall[0][name] for name in ("combinations", "lower", "higher", "undecided")] == [8, 6, 2, 0]
    assert overall[0]["verdict"] == "flips"
    found = flips(table, info, "energy_j").to_dict("records")
    assert [row["words"] for row in found] == [
        "from lower to higher between exponent=2.5 and exponent=3, at radio=cc2420",
        "lower at radio=cc1000, higher at radio=cc2420, at exponent=4",
        "lower at radio=cc1000, higher at radio=cc2420, at exponent=3",
    ]
    assert (found[0]["along"], found[0]["at"]) == ("exponent", "radio=cc2420")
    assert (found[0]["lower_at"], found[0]["higher_at"]) == ("2.5", "3")


def test_undecided_levels_widen_the_range_of_a_flip():
    info = study({"algorithm": ["a", "b"], "exponent": [2, 3, 4]}, 8)
    noise = np.random.default_rng(1).normal(size=8)

    def figures(levels, repetition):
        effect = {2: -1.0, 3: 0.5 * noise[repetition] - noise.mean() / 2, 4: 1.0}[levels["exponent"]]
        return {"energy_j": 10 + (effect if levels["algorithm"] == "b" else 0.0) + 0.01 * noise[repetition]}

    table = trials(info, figures)
    assert verdicts(table, info, "energy_j")["undecided"].tolist() == [1]
    words = flips(table, info, "energy_j")["words"].tolist()
    assert words == ["from lower to higher between exponent=2 and exponent=4"]


@pytest.mark.parametrize(
    ("effect", "verdict"),
    [(-1.0, "lower everywhere"), (1.0, "higher everywhere"), (0.0, "equal everywhere")],
)
def test_a_verdict_that_holds_everywhere_says_so(effect, verdict):
    info = study({"algorithm": ["a", "b"], "exponent": [2, 3]}, 8)
    table = trials(
        info, lambda levels, repetition: {"energy_j": repetition + (effect if levels["algorithm"] == "b" else 0)}
    )
    assert verdicts(table, info, "energy_j")["verdict"].tolist() == [verdict]
    assert flips(table, info, "energy_j").empty


def test_noise_over_many_combinations_seldom_gives_any_verdict():
    """Among 200 studies of 40 comparisons of pure noise, those with any false verdict are few: 5 % at most, after Holm."""
    rng = np.random.default_rng(11)
    info = study({"algorithm": ["a", "b"], "exponent": list(range(40))}, 4)
    wrong = 0
    for _ in range(200):
        table = trials(info, lambda levels, repetition: {"energy_j": rng.normal()})
        wrong += verdicts(table, info, "energy_j")["verdict"].tolist() != ["undecided"]
    assert wrong <= 20  # binomial(200, 0.05) exceeds 20 with a probability of 0.1 %


def test_failures_and_missing_levels_leave_the_rest():
    info = study(AXES, 4)
    table = trials(info, lambda levels, repetition: None if levels["exponent"] == 4 else crossing(levels, repetition))
    row = verdicts(table, info, "energy_j").iloc[0]
    assert (row["combinations"], row["too_few"]) == (8, 2)
    assert verdicts(table[table["variant"] < 3], info, "energy_j").empty
    assert verdicts(table, info, "absent")["verdict"].tolist() == ["undecided"]


def test_without_an_axis_there_is_nothing_to_compare():
    info = study({}, 4)
    table = trials(info, lambda *_: {"energy_j": 1.0})
    assert verdicts(table, info, "energy_j").empty
    assert flips(table, info, "energy_j").empty


def figure(value, se=None, **levels):
    return PublishedInfo("association_error", value, levels, se, "Chen 2006, table I", "")


def test_published_figures_stand_beside_every_variant_they_are_about():
    published = [figure(0.2, 0.01, tolerance=0.1), figure(0.3, tolerance=1, fidelity="ideal"), figure(0.4, tolerance=5)]
    info = study({"tolerance": [0, 0.1, 1], "fidelity": ["ideal", "csma"]}, 4, published)
    table = trials(
        info, lambda levels, repetition: {"association_error": levels["tolerance"] + 0.1 * (repetition - 1.5)}
    )
    found = published_table(info, aggregate(table, info.axis_names, ["association_error", "other"]))
    assert found["variant"].tolist()[:3] == [2, 3, 4]
    assert found["variant"].isna().tolist() == [False, False, False, True]
    assert found["levels"].tolist() == [
        *("tolerance=0.1, fidelity=ideal", "tolerance=0.1, fidelity=csma", "tolerance=1, fidelity=ideal", ""),
    ]
    assert found["at"].tolist()[2] == "tolerance=1, fidelity=ideal"
    assert found["n"].tolist() == [4, 4, 4, 0]
    se = np.std([-0.15, -0.05, 0.05, 0.15], ddof=1) / 2
    expected = [-0.1 / math.hypot(se, 0.01)] * 2 + [0.7 / se, math.nan]
    np.testing.assert_allclose(found["z"].astype(float), expected, rtol=1e-9)


def test_a_published_figure_of_another_metric_has_no_measured_one():
    info = study({"tolerance": [0]}, 2, [PublishedInfo("energy_j", 1.0, {}, None, "somewhere", "")])
    table = trials(info, lambda *_: {"association_error": 0.5})
    found = published_table(info, aggregate(table, info.axis_names, ["association_error", "energy_j"]))
    assert found[["n", "variant"]].to_numpy().tolist() == [[0, 0]]
    found = published_table(info, aggregate(table, info.axis_names, ["association_error"]))
    assert found["n"].tolist() == [0]


def test_z_counts_standard_errors_of_both():
    assert z_score(1.0, 0.3, 0.5, 0.4) == pytest.approx(1.0)
    assert z_score(1.0, 0.25, 0.5, None) == pytest.approx(2.0)
    assert math.isnan(z_score(1.0, math.nan, 0.5, 0.4))
    assert math.isnan(z_score(1.0, 0.0, 2.0, None))
    assert z_score(1.0, 0.0, 2.0, 0.5) == -2.0
