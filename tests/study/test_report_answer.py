"""What a report says of planted differences: verdicts, extremes, Pareto sets, winners."""

import itertools
import math

import numpy as np
import pytest
from report_studies import figures, written

from netsim.study.plots.tradeoff import tradeoff_plots
from netsim.study.reporting.answer import answer
from netsim.study.reporting.blocks import Bullets, Table
from netsim.study.reporting.tables import difference_tables, result_tables
from netsim.study.reporting.view import View, view_of
from netsim.study.results import load_study


def planted(effect_by_mac: dict[str, float]):
    """A law whose error has an effect of the algorithm B at each MAC, far smaller than what repetitions share."""

    def law(levels, repetition):
        noise = np.random.default_rng(repetition).normal(size=2)
        effect = effect_by_mac[levels["mac"]] if levels["algorithm"] == "B" else 0.0
        error = 0.4 + 0.1 * noise[0] + effect + 0.001 * noise[1] * (1 if levels["algorithm"] == "B" else -1)
        cost = 2.0 if levels["algorithm"] == "B" else 3.0
        return {"association_error": error, "energy_j": cost + 0.01 * noise[0], "nodes_finished": 9}

    return law


def view(folder, effects, repetitions=12, **changes) -> View:
    written(folder, {"algorithm": ["A", "B"], "mac": list(effects)}, repetitions, planted(effects), costs=("energy_j",),
            **changes)  # fmt: skip
    return view_of(load_study(folder))


def verdict_cells(shown: View) -> tuple[str, ...]:
    return next(block for block in answer(shown) if isinstance(block, Table)).rows[0]


def test_a_small_difference_among_large_common_noise_is_found(tmp_path):
    name, error, energy = verdict_cells(view(tmp_path, {"x": 0.01}))
    assert name == "B"
    assert error.endswith("**worse**")
    assert energy.endswith("**better**")


def test_no_difference_is_left_undecided(tmp_path):
    assert verdict_cells(view(tmp_path, {"x": 0.0}))[1].endswith("undecided")


def test_a_verdict_that_flips_says_so_and_where(tmp_path):
    shown = view(tmp_path, {"x": 0.02, "yy": -0.02})
    assert verdict_cells(shown)[1].endswith("**better** in 1 of 2, **worse** in 1 of 2 – **the verdict flips**")


def test_the_extremes_are_told_with_what_they_cost(tmp_path):
    blocks = answer(view(tmp_path, {"x": 0.05}))
    sentence, first, pareto = next(block for block in blocks if isinstance(block, Bullets)).items
    assert sentence == "**B** against A: **better** in energy; **worse** in association error."
    assert first.startswith("Lowest mean association error: **A** with 0.")
    assert (
        "Least on average in energy (\N{MINUS SIGN}33\N{NO-BREAK SPACE}%, better): **B**; its association error +0.0"
        in first
    )
    assert pareto.endswith("A → B.")


def test_bold_is_what_is_better_than_every_other_beyond_doubt(tmp_path):
    clear = next(iter(result_tables(view(tmp_path / "clear", {"x": 0.05})))).rows
    assert [row[4].startswith("**") for row in clear] == [True, False]
    doubtful = next(iter(result_tables(view(tmp_path / "doubtful", {"x": 0.0})))).rows
    assert [row[4].startswith("**") for row in doubtful] == [False, False]
    assert [row[5].startswith("**") for row in doubtful] == [False, True]


def test_the_table_of_differences_is_the_mean_within_repetitions(tmp_path):
    shown = view(tmp_path, {"x": 0.05})
    trials = shown.results.trials.pivot_table(index="repetition", columns="algorithm", values="association_error")
    apart = (trials["B"] - trials["A"]).to_numpy()
    half = 2.2009851600830295 * apart.std(ddof=1) / math.sqrt(12)  # the t quantile of 11 degrees of freedom
    cell = next(iter(difference_tables(shown))).rows[0][2].replace("\N{NO-BREAK SPACE}", " ")
    assert cell.startswith(f"**+{apart.mean():.4f} ± {half:.4f}**")


def test_differences_stand_under_their_own_metric_whatever_the_order_asked_for(tmp_path):
    asked = {"metrics": ("nodes_finished", "energy_j"), "costs": ("energy_j", "nodes_finished")}
    written(tmp_path, {"algorithm": ["A", "B"], "mac": ["x"]}, 12, planted({"x": 0.05}), **asked)
    table = next(iter(difference_tables(view_of(load_study(tmp_path)))))
    row = dict(zip(table.header, table.rows[0], strict=True))
    assert row["association error"].startswith("**+0.0")
    assert row["energy (J)"].startswith("**\N{MINUS SIGN}1\N{NO-BREAK SPACE}")
    assert [cell for title, cell in row.items() if "finished" in title] == ["equal"]


@pytest.mark.parametrize("seed", range(5))
def test_the_pareto_set_is_that_of_a_search_by_hand(tmp_path, seed):
    points = np.random.default_rng(seed).integers(0, 6, size=(9, 2)).astype(float)

    def law(levels, repetition):
        error, cost = points[levels["k"]]
        return {"association_error": error, "energy_j": cost}

    written(tmp_path, {"k": list(range(9))}, 2, law, costs=("energy_j",))
    found = view_of(load_study(tmp_path)).pareto("energy_j", range(9))
    beaten = {
        one
        for one, other in itertools.permutations(range(9), 2)
        if (points[other] <= points[one]).all() and (points[other] < points[one]).any()
    }
    assert set(found) == set(range(9)) - beaten


def test_circumstances_have_their_own_pareto_sets(tmp_path):
    """On the ideal rung all is cheaper; the dearer algorithm is a choice on the other rung all the same."""

    def law(levels, repetition):
        dear = levels["algorithm"] == "B"
        rung = 10.0 if levels["fidelity"] == "csma" else 1.0
        return {
            "association_error": 0.1 if dear else 0.3,
            "energy_j": rung * (2.0 if dear else 1.0) + 0.01 * repetition,
        }

    written(tmp_path, {"algorithm": ["A", "B"], "fidelity": ["ideal", "csma"]}, 3, law, costs=("energy_j",))
    text = next(block for block in answer(view_of(load_study(tmp_path))) if isinstance(block, Bullets)).items[-1]
    assert text.endswith("B → A in every setting.")


def test_names_beside_points_lie_on_no_other_and_on_no_point(tmp_path):
    written(tmp_path, {"tolerance": [0, 1, 2, 3, 4]}, 4, figures)
    (plot,) = tradeoff_plots(view_of(load_study(tmp_path)))
    renderer = plot.figure.canvas.get_renderer()
    for panel in (each for each in plot.figure.axes if each.axison):
        boxes = [text.get_window_extent(renderer) for text in panel.texts]
        assert len(boxes) == 5
        assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
        points = [
            line.get_xydata()[0] for line in panel.lines if line.get_marker() == "o" and len(line.get_xdata()) == 1
        ]
        assert len(points) >= 5
        assert not any(box.contains(*panel.transData.transform(point)) for box in boxes for point in points)


def test_members_of_a_pareto_set_that_are_alike_are_said_to_be(tmp_path):
    def law(levels, repetition):
        return {"association_error": 0.3, "energy_j": 2.0 if levels["radio"] == "C" else 1.0}

    written(tmp_path, {"radio": ["A", "B", "C"]}, 8, law, costs=("energy_j",))
    bullets = next(block for block in answer(view_of(load_study(tmp_path))) if isinstance(block, Bullets))
    assert bullets.items[-1].endswith("from the best error to the least cost: A = B.")
