"""Studies side by side, against differences taken by hand from their tables."""

import json
import math
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

from netsim.errors import ScenarioError
from netsim.study.compare_studies import Line, Match, compare_studies
from netsim.study.gate import Judgement, parse_gate
from netsim.study.plan import load_plan
from netsim.study.results import load_results
from netsim.study.run import run_study
from netsim.study.shortfalls import Tally
from netsim.study.tabulate import refresh_tables

STUDY = """
kind: study
schema_version: 1
name: small
question: What does a tolerance save?
scenario: {scenario}
repetitions: 3
sweep:
  - {{path: algorithm.tolerance, values: [0, 1]}}
"""


@pytest.fixture(scope="module")
def studies(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """A study, the same again, with half the payload, of another seed, and with another level."""
    folder = tmp_path_factory.mktemp("studies")
    file = folder / "small.yaml"
    file.write_text(STUDY.format(scenario=scenarios / "quickstart.yaml"))
    made = {}
    for name, changes in (
        ("one", []),
        ("again", []),
        ("half", ["set={algorithm.payload: float16}"]),
        ("seed", ["seed=5"]),
        ("level", ["sweep=[{path: algorithm.tolerance, values: [1, 2]}]", "repetitions=1"]),
        ("axis", ["sweep=[{name: length, path: algorithm.rounds, values: [2, 3]}]", "repetitions=1"]),
    ):
        made[name] = folder / name
        made[name].mkdir()
        run_study(load_plan(file, changes), made[name], "netsim study small.yaml")
    return made


def match(studies: Mapping[str, Path], later: str) -> Match:
    return compare_studies([studies["one"], studies[later]]).matches[0]


def line(lines: list[Line], metric: str) -> Line:
    return next(each for each in lines if each.metric == metric)


def test_a_study_equals_itself(studies: Mapping[str, Path]) -> None:
    found = match(studies, "again")
    assert found.is_paired
    assert found.changed == 0
    assert found.lonely == []
    assert all(each.is_equal or each.is_empty for lines in found.variants.values() for each in lines)
    assert all(each.is_equal or each.is_empty for each in found.overall)


def test_pairs_of_one_seed_and_repetition_are_held_against_each_other(studies: Mapping[str, Path]) -> None:
    found = match(studies, "half")
    first, later = (load_results(studies[name]).sort_values("repetition") for name in ("one", "half"))
    assert list(found.variants) == ["tolerance=0", "tolerance=1"]
    assert found.changed == 2
    apart = []
    for level in (0, 1):
        before, after = (table[table["tolerance"] == level]["frame_byte"].to_numpy() for table in (first, later))
        told = line(found.variants[f"tolerance={level}"], "frame_byte").difference
        oracle = stats.ttest_rel(after, before)
        interval = oracle.confidence_interval(0.95)
        assert (told.n, told.mean, told.baseline_mean) == (3, pytest.approx(after.mean()), pytest.approx(before.mean()))
        assert told.sample.mean == pytest.approx((after - before).mean())
        assert (told.sample.low, told.sample.high) == (pytest.approx(interval.low), pytest.approx(interval.high))
        apart.append(after - before)
    overall = line(found.overall, "frame_byte").difference.sample
    interval = stats.ttest_1samp((apart[0] + apart[1]) / 2, 0).confidence_interval(0.95)
    assert overall.n == 3  # a repetition counts once, whatever the number of variants
    assert (overall.low, overall.high) == (pytest.approx(interval.low), pytest.approx(interval.high))


def test_of_other_seeds_the_samples_are_independent(studies: Mapping[str, Path]) -> None:
    found = match(studies, "seed")
    assert not found.is_paired
    first, later = (load_results(studies[name]) for name in ("one", "seed"))
    before, after = (table[table["tolerance"] == 0]["frame_byte"] for table in (first, later))
    told = line(found.variants["tolerance=0"], "frame_byte").difference.sample
    interval = stats.ttest_ind(after, before, equal_var=False).confidence_interval(0.95)
    assert (told.low, told.high) == (pytest.approx(interval.low), pytest.approx(interval.high))


def test_levels_that_only_one_has_are_left_out(studies: Mapping[str, Path]) -> None:
    found = match(studies, "level")
    assert list(found.variants) == ["tolerance=1"]
    assert found.lonely == ["tolerance=0", "tolerance=2"]
    told = line(found.variants["tolerance=1"], "energy_j").difference
    assert told.n == 1
    assert math.isnan(told.sample.low)
    with pytest.raises(ScenarioError, match=r"expected the axes of .*one, tolerance; got length"):
        match(studies, "axis")


def test_gates_judge_the_means_over_all_variants(studies: Mapping[str, Path]) -> None:
    found = match(studies, "half")
    first, later = (load_results(studies[name])["frame_byte"].mean() for name in ("one", "half"))
    judged = found.judge(parse_gate("frame_byte_rel > -0.01"))
    assert not judged.failed
    assert judged.values["frame_byte_rel"] == pytest.approx((later - first) / first)
    assert found.judge(parse_gate("frame_byte < frame_byte_first")).failed
    with pytest.raises(ScenarioError, match="expected first_death_s to be a number"):
        found.judge(parse_gate("first_death_s > 1"))


def changed(original: Path, folder: Path, change: Callable[[dict[str, Any]], None], drop: int = 0) -> Path:
    """A copy of a study whose trials came to something else; the last ones may be missing."""
    shutil.copytree(original, folder)
    outcomes = [json.loads(line) for line in (folder / "trials.jsonl").read_text().splitlines()]
    kept = outcomes[: len(outcomes) - drop]
    for outcome in kept:
        change(outcome)
    (folder / "trials.jsonl").write_text("".join(json.dumps(outcome) + "\n" for outcome in kept))
    refresh_tables(folder)
    return folder


def crash(*trials: int) -> Callable[[dict[str, Any]], None]:
    def change(outcome: dict[str, Any]) -> None:
        if outcome["trial"] in trials:
            outcome.update(status="failed", error="boom", figures={}, nodes={})

    return change


def forget(metric: str, *trials: int) -> Callable[[dict[str, Any]], None]:
    def change(outcome: dict[str, Any]) -> None:
        if outcome["trial"] in trials:
            outcome["figures"][metric] = None

    return change


def judged(first: Path, later: Path, gate: str) -> Judgement:
    return compare_studies([first, later]).judge([parse_gate(gate)])[0][1]


def test_a_gate_does_not_pass_where_trials_crash_or_are_missing(studies: Mapping[str, Path], tmp_path: Path) -> None:
    """Else the regression that crashes would be the one that is let through."""
    one, gate = studies["one"], "frame_byte_rel > 0.01"
    assert judged(one, studies["again"], gate).passes
    crashed = changed(one, tmp_path / "crashed", crash(2, 5))
    found = judged(one, crashed, gate)
    assert not found.failed
    assert not found.passes
    lost = "tolerance=0, repetition 1 (failed); tolerance=1, repetition 2 (failed)"
    assert found.unjudged == f"2 of 6 trials that ended well in {one} did not here: {lost}"
    short = changed(one, tmp_path / "short", crash(), drop=1)
    assert judged(one, short, gate).unjudged.endswith("did not here: tolerance=1, repetition 2 (not run)")
    assert "tolerance=0, repetition 0 (not asked for)" in judged(one, studies["level"], gate).unjudged
    assert judged(crashed, one, gate).passes  # what was wrong before, and is mended
    assert judged(crashed, changed(one, tmp_path / "as-before", crash(5, 2)), gate).passes
    other = changed(studies["seed"], tmp_path / "other", crash(0))
    assert judged(one, other, "frame_byte_rel > 1").unjudged.endswith("tolerance=0, repetition 0 (failed)")
    assert judged(one, studies["seed"], "frame_byte_rel > 1").passes


def test_a_gate_is_not_refused_for_figures_that_crashes_took(studies: Mapping[str, Path], tmp_path: Path) -> None:
    """All trials of a variant, and all trials there are."""
    for name, trials in (("variant", (0, 2, 4)), ("all", range(6))):
        found = judged(studies["one"], changed(studies["one"], tmp_path / name, crash(*trials)), "energy_j_rel > 0")
        assert f"{len(trials)} of 6 trials that ended well" in found.unjudged


def test_a_gate_does_not_pass_where_only_one_has_the_figure(studies: Mapping[str, Path], tmp_path: Path) -> None:
    """Else a variant that no longer converges would not count; what the gate does not ask for may be missing."""
    one = studies["one"]
    later = changed(one, tmp_path / "later", forget("energy_j", 3))
    reason = "only one of the studies has a figure of tolerance=1, repetition 1 (no energy_j "
    assert judged(one, later, "energy_j_rel > 0.1").unjudged == f"{reason}there)"
    assert judged(later, one, "energy_j_rel > 0.1").unjudged == f"{reason}in the first)"
    assert judged(one, later, "frame_byte_rel > 0.1").passes
    assert judged(later, changed(one, tmp_path / "same", forget("energy_j", 3)), "energy_j_rel > 0.1").passes
    other = changed(studies["seed"], tmp_path / "other", forget("energy_j", 1))
    told = judged(one, other, "energy_j_rel > 9").unjudged
    assert told.endswith("tolerance=1 (of energy_j: a share of 2/3 there, 1 in the first)")


def test_failed_trials_are_tallied(studies: Mapping[str, Path], tmp_path: Path) -> None:
    later = changed(studies["one"], tmp_path / "later", crash(2), drop=1)
    first, found = compare_studies([studies["one"], later]).matches[0].tallies
    assert first == Tally(str(studies["one"]), 6, (), ())
    assert found == Tally(str(later), 6, ("tolerance=0, repetition 1",), ("tolerance=1, repetition 2",))


def test_what_differs_between_the_studies_is_told(studies: Mapping[str, Path], tmp_path: Path) -> None:
    comparison = compare_studies([studies["one"], studies["seed"], studies["half"]])
    assert [setting.path for setting in comparison.settings] == ["set['algorithm.payload']", "seed"]
    assert comparison.settings[1].values == ("null", "5", "null")
    (tmp_path / "study.json").write_text(json.dumps({"format": 99}))
    with pytest.raises(ScenarioError, match="expected the description of a study"):
        compare_studies([studies["one"], tmp_path])
