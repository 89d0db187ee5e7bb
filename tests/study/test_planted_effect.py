"""A small effect, planted in an algorithm of one's own under much larger noise, through a real study and by the thousand.

The algorithm says as often as it drew: its load, from a stream that is the same for all variants in a repetition, and a
little of its own, from a stream that is not. Only the latter's mean differs between the levels, by a known amount.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from netsim.study.plan import load_plan, write_plan
from netsim.study.results import RESULTS, load_results, trial_table, write_tables
from netsim.study.samples import differences_of, sample_of, welch
from netsim.study.statistics import aggregate, paired_differences, unpaired_differences
from netsim.study.trial import run_trial

NODES = 9
REPETITIONS = 16
PLANTED = 0.5 * NODES
"""Messages that a network says more at 5 draws than at 4, in the mean: half a message a node and draw."""

MODULE = '''
from netsim.api import NodeHandle, Op
from netsim.parameters import parameters


@parameters
class Parameters:
    """How much a node says of its own accord."""

    draws: int = 4
    """How often it throws a coin for a message more."""
    note: str = ""
    """Changes nothing."""


class Talker:
    """Says as often as its load and its coins tell it to."""

    Parameters = Parameters

    def __init__(self, parameters):
        self._draws = parameters.draws

    def run(self, node: NodeHandle) -> Op[None]:
        load = int(node.rng("load").integers(0, 41))
        own = int(node.rng(f"own {self._draws}").binomial(self._draws, 0.5))
        for _ in range(load + own):
            node.broadcast("word", bytes(8))
            yield from node.pause(10_000_000)
'''

SCENARIO = """
kind: scenario
schema_version: 1
name: talk
seed: 1
duration_s: 2
field: {width_m: 20, height_m: 20}
nodes: [{name: talkers, placement: {type: grid, rows: 3, columns: 3, spacing_m: 5}}]
medium: {type: ideal}
mac: {type: ideal}
algorithm: {type: "planted_talker:Talker"}
"""

STUDY = f"""
kind: study
schema_version: 1
name: planted
question: Is the effect found that was planted?
scenario: talk.yaml
repetitions: {REPETITIONS}
sweep:
  - {{path: algorithm.draws, values: [4, 5]}}
  - {{path: algorithm.note, values: [one, other]}}
"""

METRICS = ("radio_messages", "frame_byte", "airtime_s", "energy_j")


@pytest.fixture(scope="module")
def trials(tmp_path_factory) -> pd.DataFrame:
    """The table of the study, as read back from its folder."""
    folder = tmp_path_factory.mktemp("planted")
    for name, content in (("planted_talker.py", MODULE), ("talk.yaml", SCENARIO), ("study.yaml", STUDY)):
        (folder / name).write_text(content, encoding="utf-8")
    plan = load_plan(folder / "study.yaml")
    write_plan(plan, folder / "out", "netsim study study.yaml")
    tasks = plan.tasks(folder / "out")
    outcomes = {task.key: run_trial(task) for task in tasks}
    table = trial_table(plan.info(""), tasks, outcomes, [1] * len(plan.variants))
    write_tables(folder / "out", {RESULTS: table})
    return load_results(folder / "out")


def test_the_study_ran(trials):
    assert len(trials) == 4 * REPETITIONS
    assert trials["error"].tolist() == [""] * len(trials)


def test_the_paired_interval_finds_the_effect_and_the_unpaired_one_does_not(trials):
    arguments = (trials, ["draws", "note"], "draws", 4, METRICS)
    paired, unpaired = paired_differences(*arguments), unpaired_differences(*arguments)
    assert paired["n"].tolist() == [REPETITIONS] * len(paired)
    for metric in METRICS[:3]:
        assert set(paired[paired["metric"] == metric]["verdict"]) == {"higher"}
        assert set(unpaired[unpaired["metric"] == metric]["verdict"]) == {"no difference shown"}
    np.testing.assert_allclose(paired["difference"], unpaired["difference"], rtol=1e-6)
    messages = paired[paired["metric"] == "radio_messages"]
    assert ((messages["low"] < PLANTED) & (messages["high"] > PLANTED)).all()
    assert (unpaired["se"] > 4 * paired["se"]).all()


def test_the_unpaired_comparison_would_need_many_times_the_repetitions(trials):
    """Twice the standard error below the planted effect: so many trials a variant, from the spread that was measured."""
    arguments = (trials, ["draws", "note"], "draws", 4, ["radio_messages"])
    paired, unpaired = (each(*arguments).iloc[0] for each in (paired_differences, unpaired_differences))
    needed = [REPETITIONS * (2 * row["se"] / PLANTED) ** 2 for row in (paired, unpaired)]
    assert needed[0] < REPETITIONS
    assert needed[1] > 20 * needed[0]


def test_what_changes_nothing_makes_no_difference_at_all(trials):
    """Two variants of other digests draw the same: every figure is equal in every pair, while repetitions differ."""
    names = [name for name in trials if pd.api.types.is_numeric_dtype(trials[name])][4:]
    found = paired_differences(trials, ["draws", "note"], "note", "one", [n for n in names if trials[n].notna().any()])
    assert set(found["verdict"]) == {"equal"}
    assert (found[["difference", "se", "low", "high"]] == 0).all(axis=None)
    assert len(found) > 40
    spread = aggregate(trials, ["draws", "note"], METRICS)["sd"]
    assert (spread > 0).all()


@dataclass(frozen=True)
class Many:
    """Synthetic data sets: in each, pairs with common noise of sd 1, own noise of sd 0.2, and a planted difference."""

    sets: int = 2000
    pairs: int = 8
    planted: float = 0.3

    def intervals(self, seed):
        rng = np.random.default_rng(seed)
        common = rng.normal(size=(self.sets, self.pairs))
        base = common + 0.2 * rng.normal(size=common.shape)
        values = common + 0.2 * rng.normal(size=common.shape) + self.planted
        both = zip(values.tolist(), base.tolist(), strict=True)
        return [(sample_of(differences_of(one, other)), welch(one, other)) for one, other in both]


def test_intervals_hold_the_true_value_as_often_as_they_say():
    """Coverage of the paired interval is 95 %: binomial, 2000 data sets, at a false alarm of one in a thousand."""
    many = Many()
    covered = sum(paired.low <= many.planted <= paired.high for paired, _ in many.intervals(seed=7))
    assert stats.binomtest(covered, many.sets, 0.95).pvalue > 0.001
    assert stats.binomtest(covered, many.sets, 0.90).pvalue < 0.001  # the test would see a 90 % interval


def test_the_unpaired_interval_is_right_where_draws_are_independent():
    rng = np.random.default_rng(9)
    shape = (2000, 8)
    one, other = rng.normal(0.3, 1.0, shape).tolist(), rng.normal(0.0, 2.0, shape).tolist()
    found = [welch(values, base) for values, base in zip(one, other, strict=True)]
    covered = sum(sample.low <= 0.3 <= sample.high for sample in found)
    assert stats.binomtest(covered, 2000, 0.95).pvalue > 0.001


def test_pairing_finds_what_independent_means_miss():
    found = Many().intervals(seed=8)
    power = [sum(sample.low > 0 for sample in samples) / len(found) for samples in zip(*found, strict=True)]
    assert power[0] > 0.7  # exact: noncentral t, 8 pairs, effect 0.3 over 0.2 * sqrt(2): 0.74
    assert power[1] < 0.05


def test_the_power_of_the_paired_test_is_that_of_theory():
    many = Many()
    found = sum(paired.p < 0.05 for paired, _ in many.intervals(seed=8))
    shift = many.planted / (0.2 * np.sqrt(2)) * np.sqrt(many.pairs)
    edge = stats.t.ppf(0.975, many.pairs - 1)
    power = stats.nct.sf(edge, many.pairs - 1, shift) + stats.nct.cdf(-edge, many.pairs - 1, shift)
    assert stats.binomtest(found, many.sets, power).pvalue > 0.001


def test_without_an_effect_one_interval_in_twenty_errs():
    found = Many(planted=0.0).intervals(seed=10)
    wrong = sum(paired.low > 0 or paired.high < 0 for paired, _ in found)
    assert stats.binomtest(wrong, len(found), 0.05).pvalue > 0.001
