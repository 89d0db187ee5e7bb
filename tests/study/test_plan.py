"""From a study file to its variants, and what is said of one that is wrong."""

import json
from pathlib import Path

import pytest
from study_rig import QUICKSTART, write_misbehaving, write_study

from netsim.errors import ScenarioError
from netsim.study.plan import load_plan, write_plan
from netsim.study.run import run_study

HEAD = f"""kind: study
schema_version: 1
name: small
question: What does it cost?
scenario: {QUICKSTART}
"""


def findings_of(folder: Path, text: str, overrides=()) -> list[str]:
    path = folder / "study.yaml"
    path.write_text(HEAD + text)
    with pytest.raises(ScenarioError) as raised:
        load_plan(path, overrides)
    return [str(finding).removeprefix(f"{path}:") for finding in raised.value.findings] or [str(raised.value)]


def test_variants_are_the_scenarios_with_their_values(tmp_path):
    plan = load_plan(write_study(tmp_path, seed=9))
    assert [dict(each.levels) for each in plan.variants] == [
        {"tolerance": tolerance, "fidelity": rung} for tolerance in (0, 1) for rung in ("ideal", "csma")
    ]
    for each in plan.variants:
        scenario = each.loaded.scenario
        assert (scenario.algorithm.tolerance, scenario.fidelity) == tuple(each.levels.values())
        assert (scenario.duration_s, scenario.algorithm.rounds, scenario.seed) == (8, 2, 9)
    assert len({each.digest for each in plan.variants}) == 4


def test_traps_are_told_with_the_number_of_variants_in_them(tmp_path):
    sweep = [{"name": "radio", "cases": [{"name": "a"}, {"name": "b", "set": {"nodes[0].radio": "cc1000"}}]}]
    (warning,) = load_plan(write_study(tmp_path, sweep=sweep)).warnings
    assert warning.startswith("radio cc1000: medium.noise_dbm is -95.4")
    assert warning.endswith("(1 of 2 variants)")


def test_an_axis_is_not_called_as_a_metric_is(tmp_path):
    (found,) = findings_of(tmp_path, "sweep: [{path: algorithm.rounds, values: [5, 10]}]\n")
    assert "expected a column that no metric has, got `rounds`, which is what a metric is called" in found
    (found,) = findings_of(tmp_path, "sweep: [{name: energy_j, path: algorithm.tolerance, values: [0, 1]}]\n")
    assert "`energy_j`" in found


def test_a_study_in_place_of_a_scenario_is_refused_in_one_line(tmp_path):
    (tmp_path / "other.yaml").write_text(HEAD)
    (found,) = findings_of(tmp_path, "sweep: [{name: base, cases: [{name: a, scenario: other.yaml}]}]\n")
    assert found == "6: scenario: expected a scenario file, got `other.yaml`, which is a study"


def test_tasks_go_repetition_by_repetition(tmp_path):
    plan = load_plan(write_study(tmp_path, first_repetition=3))
    tasks = plan.tasks(tmp_path)
    assert [(task.trial, task.repetition, task.variant) for task in tasks] == [
        (4 * turn + variant, 3 + turn, variant) for turn in range(2) for variant in range(4)
    ]
    assert len({task.key for task in tasks}) == 8


def test_the_digest_is_of_what_matters_to_a_trial(tmp_path):
    def digests(**changes):
        return [each.digest for each in load_plan(write_study(tmp_path, **changes)).variants]

    before = digests()
    assert digests(name="other", question="Why?", metrics=["energy_j"], repetitions=7) == before
    described = {"duration_s": 8, "algorithm.rounds": 2, "description": "Other words.", "name": "other"}
    assert digests(set=described) == before
    assert not set(digests(seed=5)) & set(before)
    assert not set(digests(set={"duration_s": 9, "algorithm.rounds": 2})) & set(before)


def test_the_digest_covers_files_that_a_scenario_refers_to(tmp_path):
    file = write_misbehaving(tmp_path, ["none"])
    before = load_plan(file).variants[0].digest
    (tmp_path / "misbehaving.py").write_text((tmp_path / "misbehaving.py").read_text() + "\n# changed\n")
    assert load_plan(file).variants[0].digest != before


def test_modules_of_one_name_in_two_folders_are_two_modules(tmp_path):
    cases = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_misbehaving(tmp_path / name, ["none"])
        module = tmp_path / name / "misbehaving.py"
        module.write_text(module.read_text().replace("as told", f"told by {name}"))
        cases.append({"name": name, "scenario": f"{name}/base.yaml", "set": {"algorithm.deed": "raise"}})
    plan = load_plan(write_study(tmp_path, set={}, sweep=[{"name": "folder", "cases": cases}]))
    assert len({each.digest for each in plan.variants}) == 2
    out = tmp_path / "out"
    out.mkdir()
    end = run_study(plan, out, "c")
    told = [f"ValueError('told by {name}')" in outcome.error for name in ("one", "two") for _, outcome in end.failures]
    assert told == [True, False, True, False, False, True, False, True]


def test_overrides_reach_the_study_or_else_its_scenarios(tmp_path):
    path = write_study(tmp_path)
    overrides = ["repetitions=5", "mac.queue_frames=3", "nodes[0].tx_power_dbm=-10", "medium.exponent=2.5"]
    plan = load_plan(path, overrides)
    assert plan.study.repetitions == 5
    for each in plan.variants:
        scenario = each.loaded.scenario
        assert (scenario.nodes[0].tx_power_dbm, scenario.medium.exponent, scenario.duration_s) == (-10, 2.5, 8)
    assert plan.study.set["medium.exponent"] == 2.5


def test_a_scenario_is_no_study():
    with pytest.raises(ScenarioError, match=r"is a scenario, not a study: run it with `netsim run .*quickstart\.yaml`"):
        load_plan(QUICKSTART)


def test_a_wrong_value_is_found_on_the_line_of_the_study(tmp_path):
    text = "sweep:\n  - path: algorithm.tolerance\n    values:\n      - 0.1\n      - -1\n      - high\n"
    found = findings_of(tmp_path, text)
    assert [line.partition(":")[0] for line in found] == ["10", "11"]
    assert found[0].startswith("10: algorithm.tolerance: expected a number >= 0 or adaptive, got -1")


def test_a_misspelt_path_is_found_on_the_line_of_the_study(tmp_path):
    found = findings_of(tmp_path, "sweep:\n  - {path: algorithm.tolerence, values: [0, 1]}\n")
    assert found == [
        "7: algorithm.tolerence: expected a known key, got `tolerence`; did you mean `tolerance`?"
    ] or "did you mean `tolerance`?" in "\n".join(found)
    assert {line.partition(":")[0] for line in found} == {"7"}
    assert findings_of(tmp_path, "set: {algorithm.tolerence: 1}\n")[0].startswith("6: algorithm.tolerence")


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("sweep: [{path: 'nodes[7].radio', values: [cc2420]}]", "6: nodes", "an index from 0 to 0, got `7`"),
        ("sweep: [{path: 'a..b', values: [1]}]", "6", "the path of a value"),
        ("sweep: [{path: a, values: [1]}, {path: b.a, values: [2]}]", "6: sweep[1]", "a second `a`"),
        ("sweep: [{path: seed, values: [1, 2]}]", "6: sweep[0]", "give the axis a `name`"),
        ("sweep: [{name: r, path: repetition, values: [1, 2]}]", "6: sweep[0]", "the study counts them: `repetitions`"),
        ("set: {fidelity: csma}\nsweep: [{path: fidelity, values: [ideal]}]", "7: sweep[0]", "not also by `set`"),
        (
            "sweep: [{path: 'nodes[0].tx_power_dbm', values: [0]}, {name: x, path: nodes.0.tx_power_dbm, values: [1]}]",
            "6: sweep[1]",
            "not also by the axis `tx_power_dbm`",
        ),
        ("sweep: [{path: seed, name: s, values: [1, 1]}]", "6: sweep[0]", "`1` twice"),
        ("sweep: [{path: seed, name: s, values: [1, 2], labels: [a]}]", "6: sweep[0].labels", "expected 2 labels"),
        ("compare: {axis: fidelity}", "6: compare.axis", "none: there is no sweep"),
        (
            "sweep: [{path: fidelity, values: [ideal, csma]}]\ncompare: {axis: fidelty}",
            "7: compare.axis",
            "did you mean `fidelity`?",
        ),
        (
            "sweep: [{path: fidelity, values: [ideal, csma]}]\ncompare: {axis: fidelity, baseline: cmsa}",
            "7: compare.baseline",
            "did you mean `csma`?",
        ),
        (
            "sweep: [{path: fidelity, values: [ideal]}]\n"
            "published:\n- {metric: energy_j, value: 1, at: {fidelity: csma}, source: A}",
            "8: published[0].at.fidelity",
            "a level of the axis (ideal), got csma",
        ),
        (
            "published:\n- {metric: energy_j, value: 1, at: {tolerance: 1}, source: A}",
            "7: published[0].at.tolerance",
            "expected an axis",
        ),
        ("metrics: [energy_j, energyj]", "6: metrics[1]", "did you mean energy_j"),
        ("error: asociation_error", "6: error", "did you mean association_error"),
        ("costs: [enrgy_j]", "6: costs[0]", "did you mean energy_j"),
        ("repetitions: 0", "6: repetitions", "> 0"),
        ("repetition: 3", "6: repetition", "did you mean `repetitions`?"),
        ("sweep: [{name: way, cases: [{name: a, scenario: nowhere.yaml}]}]", "6", "an existing scenario file"),
        (
            "sweep: [{path: seed, name: s, range: {start: 0, stop: 10001, step: 1}}]",
            "6: sweep",
            "at most 10000 variants",
        ),
    ],
)
def test_what_is_said_of_a_study_that_is_wrong(tmp_path, text, place, words):
    found = findings_of(tmp_path, text + "\n")
    assert any(line.startswith(place) and words in line for line in found), found


def test_a_name_that_cannot_be_a_folder(tmp_path):
    path = write_study(tmp_path, name="../escape")
    with pytest.raises(ScenarioError, match="results go into a folder of this name"):
        load_plan(path)


def test_a_scenario_that_is_wrong_by_itself_is_told_once(tmp_path):
    (tmp_path / "base.yaml").write_text(json.dumps({"kind": "scenario", "extends": str(QUICKSTART), "duration_s": -1}))
    path = write_study(tmp_path, scenario="base.yaml", set={})
    with pytest.raises(ScenarioError) as raised:
        load_plan(path)
    assert [finding.path for finding in raised.value.findings] == ["duration_s"]
    assert raised.value.findings[0].file.endswith("base.yaml")


def test_levels_of_metric_dictionaries_are_metrics_too(tmp_path):
    plan = load_plan(write_study(tmp_path, metrics=["energy_by_state_j.radio.listen"]))
    assert plan.study.metrics == ("energy_by_state_j.radio.listen",)


def test_a_file_that_variants_shared_is_not_written_over_for_all_when_one_takes_another(tmp_path):
    scenario = {"kind": "scenario", "extends": str(QUICKSTART), "algorithm": {"tolerance": 0.5}}
    (tmp_path / "base.yaml").write_text(json.dumps(scenario))
    for name, x_m in (("a", 1.0), ("b", 2.0)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.csv").write_text(f"id,x_m,y_m\n0,{x_m},3.0\n1,{x_m},6.0\n")
    out = tmp_path / "out"
    for files in ("a", "a"), ("b", "a"):
        cases = [
            {
                "name": str(number),
                "set": {
                    "algorithm.tolerance": number,
                    "nodes[0].placement": {"type": "csv", "file": f"{file}/x.csv"},
                },
            }
            for number, file in enumerate(files)
        ]
        write_plan(
            load_plan(write_study(tmp_path, scenario="base.yaml", set={}, sweep=[{"name": "n", "cases": cases}])),
            out,
            "c",
        )
    held = [(out / "variants" / f"00{number}" / "inputs" / "x.csv").read_text() for number in (0, 1)]
    assert held == [(tmp_path / name / "x.csv").read_text() for name in ("b", "a")]
