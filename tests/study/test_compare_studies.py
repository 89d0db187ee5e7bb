"""Studies side by side, against differences taken by hand from their tables."""

import json
import math
from collections.abc import Mapping
from pathlib import Path

import pytest
from scipy import stats

from netsim.errors import ScenarioError
from netsim.study.compare_studies import Line, Match, compare_studies
from netsim.study.gate import parse_gate
from netsim.study.plan import load_plan
from netsim.study.results import load_results
from netsim.study.run import run_study

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
        ("axis", ["sweep=[{path: algorithm.rounds, values: [2, 3]}]", "repetitions=1"]),
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
    with pytest.raises(ScenarioError, match=r"expected the axes of .*one, tolerance; got rounds"):
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


def test_what_differs_between_the_studies_is_told(studies: Mapping[str, Path], tmp_path: Path) -> None:
    comparison = compare_studies([studies["one"], studies["seed"], studies["half"]])
    assert [setting.path for setting in comparison.settings] == ["set['algorithm.payload']", "seed"]
    assert comparison.settings[1].values == ("null", "5", "null")
    (tmp_path / "study.json").write_text(json.dumps({"format": 99}))
    with pytest.raises(ScenarioError, match="expected the description of a study"):
        compare_studies([studies["one"], tmp_path])
