"""Running studies: the same tables whoever runs them and in however many goes."""

import json
import shutil

import pytest
from study_rig import lines_of, same_tables, write_misbehaving, write_study

import netsim
from netsim.errors import ScenarioError
from netsim.study.build_id import build_id, versions
from netsim.study.executors import ThisProcess
from netsim.study.journal import read_journal
from netsim.study.plan import load_plan
from netsim.study.run import open_study, run_study


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study run in one go in this process."""
    folder = tmp_path_factory.mktemp("whole")
    out = folder / "out"
    out.mkdir()
    return folder, out, run_study(load_plan(write_study(folder)), out, "netsim study study.yaml")


@pytest.fixture
def copied(whole, tmp_path):
    """A copy of that study's folder, to go on from."""
    return shutil.copytree(whole[1], tmp_path / "out")


def stop_after(count):
    return lambda standing: standing.ran < count


def test_a_row_a_trial_with_axes_repetition_seed_and_metrics(whole):
    _, out, end = whole
    trials = netsim.load_results(out)
    assert len(trials) == end.standing.ran == 8
    assert list(trials.columns[:10]) == [
        *("trial", "variant", "tolerance", "fidelity", "repetition", "seed", "status", "error", "command"),
        "interrupted",
    ]
    assert list(trials["trial"]) == list(range(8))
    assert set(trials["status"]) == {"ok"}
    assert trials["energy_j"].gt(0).all()
    assert not [name for name in trials.columns if "by_node" in name]
    assert trials["command"][5] == "netsim run variants/001/scenario.yaml --set repetition=1"


def test_the_command_of_a_trial_gives_its_figures(whole):
    _, out, _ = whole
    row = netsim.load_results(out).iloc[5]
    again = netsim.run(netsim.load(out / "variants" / "001" / "scenario.yaml", ["repetition=1"]))
    assert again.metrics["energy_j"] == row["energy_j"]
    assert again.metrics["association_error"] == row["association_error"] > 0


def test_a_pool_gives_the_tables_of_this_process(whole, tmp_path):
    folder, out, _ = whole
    end = run_study(load_plan(folder / "study.yaml"), tmp_path, "c", jobs=2)
    assert end.workers == "2 worker processes"
    same_tables(out, tmp_path)


@pytest.mark.parametrize("stops", [[1], [3, 2, 1]])
def test_an_interrupted_study_resumed_gives_the_tables_of_one_go(whole, tmp_path, stops):
    folder, out, _ = whole
    plan = load_plan(folder / "study.yaml")
    for turn, count in enumerate(stops):
        end = run_study(plan, tmp_path, "c", resume=turn > 0, watch=stop_after(count))
        assert end.interrupted
        assert len(netsim.load_results(tmp_path)) == sum(stops[: turn + 1])
    end = run_study(plan, tmp_path, "c", resume=True)
    assert (end.interrupted, end.standing.ran, end.standing.done) == (False, 8 - sum(stops), 8)
    same_tables(out, tmp_path)
    again = run_study(plan, tmp_path, "c", resume=True)
    assert (again.standing.ran, lines_of(tmp_path / "trials.jsonl")) == (0, 8)
    same_tables(out, tmp_path)


def test_a_torn_line_costs_one_trial(whole, copied):
    folder, out, _ = whole
    journal = copied / "trials.jsonl"
    journal.write_bytes(journal.read_bytes()[:-100])
    assert run_study(load_plan(folder / "study.yaml"), copied, "c", resume=True).standing.ran == 1
    same_tables(out, copied)


def test_without_resume_everything_is_run_anew(whole, tmp_path):
    folder, out, _ = whole
    plan = load_plan(folder / "study.yaml")
    run_study(plan, tmp_path, "c", watch=stop_after(2))
    (tmp_path / "mine.txt").write_text("kept")
    assert run_study(plan, tmp_path, "c").standing.ran == 8
    assert (tmp_path / "mine.txt").read_text() == "kept"
    same_tables(out, tmp_path)


def test_variants_of_equal_content_are_run_once_and_have_their_rows(tmp_path):
    cases = [
        {"name": "as it is"},
        {"name": "the same", "set": {"fidelity": None}},
        {"name": "csma", "set": {"fidelity": "csma"}},
    ]
    plan = load_plan(write_study(tmp_path, sweep=[{"name": "way", "cases": cases}]))
    out = tmp_path / "out"
    out.mkdir()
    end = run_study(plan, out, "c")
    assert (end.standing.trials, end.standing.done, end.standing.ran) == (4, 4, 4)
    trials = netsim.load_results(out)
    assert len(trials) == 6
    first, second = (
        trials[trials["way"] == name].iloc[:, 9:].reset_index(drop=True) for name in ("as it is", "the same")
    )
    assert first.equals(second)
    assert run_study(plan, out, "c", resume=True).standing.ran == 0


def test_a_failing_trial_is_recorded_and_the_rest_go_on(tmp_path):
    plan = load_plan(write_misbehaving(tmp_path, ["raise", "none"]))
    out = tmp_path / "out"
    out.mkdir()
    end = run_study(plan, out, "c")
    assert (end.standing.ran, end.standing.ran_failed, len(end.failures)) == (4, 2, 2)
    task, outcome = end.failures[0]
    assert (task.trial, outcome.status) == (0, "failed")
    assert outcome.error == "node 0: the algorithm raised ValueError('as told') (misbehaving.py, line 38)"
    assert "ValueError: as told" in outcome.details
    trials = netsim.load_results(out)
    assert list(trials["status"]) == ["failed", "ok", "failed", "ok"]
    assert trials["error"][0] == outcome.error
    assert trials["energy_j"].isna().tolist() == [True, False, True, False]


def test_failed_trials_are_run_again_on_resume(tmp_path):
    plan = load_plan(write_misbehaving(tmp_path, ["raise once", "none"]))
    out, clean = tmp_path / "out", tmp_path / "clean"
    out.mkdir()
    clean.mkdir()
    assert len(run_study(plan, out, "c").failures) == 1
    with open_study(plan, out, "c", resume=True) as study:
        assert (study.finished, study.failed_before, len(study.todo)) == (3, 1, 1)
        end = study.run(lambda trials: ThisProcess(), lambda standing: True)
    assert (end.standing.ran, end.failures) == (1, ())
    run_study(plan, clean, "c")
    same_tables(out, clean)


def test_where_all_failed_the_mended_study_goes_on_without_more_ado(tmp_path):
    file, out = write_misbehaving(tmp_path, ["raise"]), tmp_path / "out"
    out.mkdir()
    assert len(run_study(load_plan(file), out, "c").failures) == 2
    module = tmp_path / "misbehaving.py"
    module.write_text(module.read_text().replace('raise ValueError("as told")', "return"))
    with open_study(load_plan(file), out, "c", resume=True) as study:
        assert any(note.startswith("changed: ") for note in study.notes)
        end = study.run(lambda trials: ThisProcess(), lambda standing: True)
    assert (end.standing.ran, end.failures) == (2, ())


def test_what_cannot_be_written_down_is_a_failure_of_its_trial(tmp_path, monkeypatch):
    from netsim.metrics.collect import Metrics

    honest = Metrics.figures
    monkeypatch.setattr(Metrics, "figures", lambda self: {**honest(self), "energy_j": float("nan")})
    out = tmp_path / "out"
    out.mkdir()
    end = run_study(load_plan(write_study(tmp_path, sweep=[], repetitions=1)), out, "c")
    assert len(end.failures) == 1
    assert "not JSON compliant" in end.failures[0][1].error
    assert len(netsim.load_results(out)) == 1


def reopen(folder, out, *, allow_changed=False, **changes):
    plan = load_plan(write_study(folder, **changes))
    with open_study(plan, out, "c", resume=True, allow_changed=allow_changed) as study:
        return study.notes, len(study.todo), study.finished


@pytest.mark.parametrize(
    ("changes", "lines", "kept"),
    [
        ({"set": {"duration_s": 9, "algorithm.rounds": 2}}, ["duration_s: 8.0 before, 9.0 now"], 0),
        ({"seed": 3}, ["seed: 1 before, 3 now"], 0),
        (
            {
                "sweep": [
                    {"path": "algorithm.tolerance", "values": [0, 0.5]},
                    {"path": "fidelity", "values": ["ideal", "csma"]},
                ]
            },
            ["axis tolerance: 0.5 new", "axis tolerance: 1 gone"],
            4,
        ),
        (
            {"sweep": [{"path": "algorithm.tolerance", "values": [0, 1]}]},
            ["axis fidelity is gone: ideal, csma"],
            0,
        ),
        ({"repetitions": 1}, ["repetitions: 0 to 1 before, 0 alone now"], 4),
        (
            {
                "sweep": [
                    {"path": "algorithm.tolerance", "values": [0, 1]},
                    {
                        "name": "fidelity",
                        "cases": [
                            {"name": "ideal", "set": {"fidelity": "ideal"}},
                            {"name": "csma", "set": {"fidelity": "csma", "algorithm.round_s": 1.5}},
                        ],
                    },
                ]
            },
            ["algorithm.round_s: 1.0 before, 1.5 now"],
            4,
        ),
    ],
)
def test_a_changed_study_is_refused_in_words_unless_allowed(copied, tmp_path, changes, lines, kept):
    before = (copied / "study.json").read_bytes()
    with pytest.raises(ScenarioError) as raised:
        reopen(tmp_path, copied, **changes)
    said = str(raised.value).splitlines()
    assert [line.strip() for line in said[1:-1]] == lines
    assert f"{kept} of 8 finished trials still count: --allow-changed goes on with them" in said[-1]
    assert (copied / "study.json").read_bytes() == before
    assert (copied / "results.parquet").exists()
    notes, todo, finished = reopen(tmp_path, copied, allow_changed=True, **changes)
    assert finished == kept
    assert f"{kept} of 8 finished trials still count; the others stay in trials.jsonl" in notes
    assert not (copied / "results.parquet").exists(), "until the new study has ended, there is no table under its name"
    plan = load_plan(tmp_path / "study.yaml")
    end = run_study(plan, copied, "c", resume=True)
    assert (end.standing.ran, end.standing.done) == (todo, todo + kept)
    clean = tmp_path / "clean"
    clean.mkdir()
    run_study(plan, clean, "c")
    same_tables(copied, clean)
    assert sorted(path.name for path in (copied / "variants").iterdir()) == sorted(
        path.name for path in (clean / "variants").iterdir()
    )


def test_more_repetitions_are_no_other_study(copied, tmp_path):
    notes, todo, finished = reopen(tmp_path, copied, repetitions=3)
    assert notes == ("more repetitions than before (repetitions: 0 to 1 before, 0 to 2 now)",)
    assert (todo, finished) == (4, 8)


def test_what_does_not_concern_trials_may_change(copied, tmp_path):
    changed = {"question": "Why?", "metrics": ["energy_j"], "error": "association_error", "description": "More."}
    published = [{"metric": "energy_j", "value": 1, "source": "A"}]
    assert reopen(tmp_path, copied, published=published, **changed) == ((), 0, 8)
    assert json.loads((copied / "study.json").read_text())["question"] == "Why?"


def test_a_changed_input_file_is_another_study(tmp_path):
    file = write_misbehaving(tmp_path, ["none"])
    out = tmp_path / "out"
    out.mkdir()
    run_study(load_plan(file), out, "c")
    (tmp_path / "misbehaving.py").write_text((tmp_path / "misbehaving.py").read_text() + "\n# changed\n")
    with (
        pytest.raises(ScenarioError, match=r"misbehaving\.py: the file's content differs"),
        open_study(load_plan(file), out, "c", resume=True),
    ):
        pass


def test_a_file_that_many_variants_refer_to_is_stored_once(tmp_path):
    file = write_misbehaving(tmp_path, ["none", "raise", "raise once"])
    out = tmp_path / "out"
    out.mkdir()
    run_study(load_plan(file), out, "c", watch=stop_after(0))
    copies = [out / "variants" / f"{number:03d}" / "misbehaving.py" for number in range(3)]
    assert {copy.read_bytes() for copy in copies} == {(tmp_path / "misbehaving.py").read_bytes()}
    assert len({copy.stat().st_ino for copy in copies}) == 1
    run_study(load_plan(file), out, "c", resume=True, watch=stop_after(0))
    assert {copy.read_bytes() for copy in copies} == {(tmp_path / "misbehaving.py").read_bytes()}


def test_figures_of_another_netsim_are_told_of(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    run_study(load_plan(write_study(tmp_path)), out, "c", watch=stop_after(2))
    journal = out / "trials.jsonl"
    journal.write_text(journal.read_text().replace(f'"{build_id()}"', '"0.0.7"'))
    assert {each.netsim_version for each in read_journal(journal)} == {"0.0.7"}
    notes, _, _ = reopen(tmp_path, out)
    assert notes == (f"warning: finished trials were run by netsim 0.0.7, the others are by {build_id()}",)
    journal.write_text(journal.read_text().replace(f'"numpy": "{versions()["numpy"]}"', '"numpy": "1.0"', 1))
    notes, _, _ = reopen(tmp_path, out)
    assert notes[1:] == (f"warning: finished trials were run by numpy 1.0, the others are by {versions()['numpy']}",)


def test_a_study_without_axes_is_one_variant(tmp_path):
    plan = load_plan(write_study(tmp_path, sweep=[]))
    out = tmp_path / "out"
    out.mkdir()
    run_study(plan, out, "c")
    assert list(netsim.load_results(out)["variant"]) == [0, 0]
