"""Lifetimes by hand, from plain numbers and from the folder of a run."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.metrics.lifetime import DutyPlan, NodeUse, assumptions, lifetimes, spread_of
from netsim.metrics.milestones import Milestones
from netsim.metrics.reach import Reach
from netsim.scenario.load import load
from netsim.scenario.outlook import lifetime_figures, outlook
from netsim.scenario.run import run

SCENARIO = """
kind: scenario
schema_version: 1
name: days
duration_s: 100
field: {width_m: 60, height_m: 60}
nodes:
  - name: sensors
    placement: {type: grid, rows: 1, columns: 2, spacing_m: 10}
    battery: {type: capacity, energy_j: 20000}
  - name: tiny
    placement: {type: listed, positions_m: [[5, 50]]}
    battery: {type: capacity, energy_j: 0.0564}
  - name: sink
    role: sink
    placement: {type: listed, positions_m: [[5, 5]]}
    battery: {type: mains}
medium: {type: ideal}
algorithm: {type: neighbour-traffic, rounds: 4, neighbours: 1}
duty_plan: {activities_per_day: 24, self_discharge_percent_per_year: 3}
"""


def use(name="a", capacity_j=20_000.0, activity_j=1.0, between_mw=0.06, died_s=None):
    return NodeUse(name, "g", capacity_j, activity_j, between_mw, died_s)


def days(node, **plan):
    ((found),) = lifetimes([node], DutyPlan(**plan), 10.0)
    return found.days


def test_a_day_by_hand():
    """100 J for activities, 85,400 s at 60 uW between them: 105.124 J a day."""
    assert days(use(), activities_per_day=100) == pytest.approx(20_000 / 105.124, rel=1e-12)


def test_self_discharge_by_hand():
    """3 % of 20 kJ a year are 600 J, 1.6427 J a day."""
    plan = {"activities_per_day": 100, "self_discharge_percent_per_year": 3}
    assert days(use(), **plan) == pytest.approx(20_000 / (105.124 + 600 / 365.25), rel=1e-12)


def test_only_self_discharge_lasts_its_years():
    node = use(activity_j=0.0, between_mw=0.0)
    assert days(node, activities_per_day=1, self_discharge_percent_per_year=10) == pytest.approx(3652.5)
    assert days(node, activities_per_day=1) == math.inf


def test_a_day_full_of_activities_has_nothing_between():
    assert days(use(between_mw=1e9), activities_per_day=8640) == pytest.approx(20_000 / 8640)
    with pytest.raises(ScenarioError, match="expected at most 8640"):
        days(use(), activities_per_day=8641)


def test_mains_and_the_dead():
    assert days(use(capacity_j=math.inf), activities_per_day=100) == math.inf
    assert days(use(died_s=0.0), activities_per_day=100) == 0.0


def test_a_node_that_dies_in_the_run_lasts_the_activities_it_managed():
    """Empty after 4.32 of the 10 s activities; 100 a day, and next to nothing in between."""
    assert days(use(died_s=43.2, between_mw=0.0), activities_per_day=100) == pytest.approx(0.0432)
    day_j = 100 * 20_000 / 4.32 + 60e-6 * 85_400
    assert days(use(died_s=43.2), activities_per_day=100) == pytest.approx(20_000 / day_j, rel=1e-12)


def test_first_median_last():
    nodes = [use("b", activity_j=2.0), use("a", activity_j=4.0), use("c"), use("m", capacity_j=math.inf)]
    spread = spread_of(lifetimes(nodes, DutyPlan(activities_per_day=100), 10.0))
    assert (spread.first.use.name, spread.last.use.name, spread.count) == ("a", "c", 3)
    assert spread.median_days == pytest.approx(20_000 / 205.124)
    assert spread_of(lifetimes(nodes[3:], DutyPlan(activities_per_day=100), 10.0)) is None


@given(st.lists(st.floats(1, 1e6), min_size=1, max_size=9))
def test_at_the_median_half_are_dead_and_no_sooner(capacities_j):
    found = lifetimes([use(capacity_j=each) for each in capacities_j], DutyPlan(activities_per_day=100), 10.0)
    half = spread_of(found).median_days
    assert sum(each.days <= half for each in found) * 2 >= len(found)
    assert sum(each.days < half for each in found) * 2 < len(found)


def test_assumptions_are_said():
    plan = DutyPlan(activities_per_day=144, between="low_power_listening", activities_per_run=3)
    said = assumptions(plan, "the run x", 60.0, 2)
    assert said[0] == "Taken from the run x, as 3 equal activities of 60 s; 144 a day take 10 % of its time."
    assert any("listens for 1 % of the time" in sentence for sentence in said)
    assert "No self-discharge." in said
    assert said[-1].startswith("2 node(s) ran empty")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("days")
    (folder / "days.yaml").write_text(SCENARIO, encoding="utf-8")
    (folder / "run").mkdir()
    run(load(folder / "days.yaml"), folder=folder / "run")
    return folder / "run"


def test_the_outlook_of_a_run(folder):
    """A CC2420 powered down draws 0.06 mW, an MSP430 asleep 0.1635 mW."""
    found = outlook(folder, {})
    by_name = {each.use.name: each for each in found.lifetimes}
    assert {each.use.group for each in found.lifetimes} == {"sensors", "tiny", "sink"}
    sensor = by_name["n00"]
    assert sensor.use.between_mw == pytest.approx(0.06 + 0.1635)
    assert 5 * 0.0564 < sensor.use.activity_j < 5 * 0.06
    rest_s = 86_400 - 24 * 5
    day_j = 24 * sensor.use.activity_j + 0.2235e-3 * rest_s + 600 / 365.25
    assert sensor.days == pytest.approx(20_000 / day_j, rel=1e-9)
    tiny_j = 24 * 5 * 0.0564 + 0.2235e-3 * rest_s  # 56.4 mJ are a second of listening
    assert by_name["n02"].days == pytest.approx(0.0564 / tiny_j, rel=0.01)
    assert by_name["n03"].days == math.inf
    assert found.assumptions[0].startswith("Taken from the run days (seed 1, 5 s simulated), as one activity of 5 s")


def test_milestones_of_a_run(folder):
    """On the ideal medium all hear all: the tiny node dies first, and the two sensors leave the sink alone together."""
    found = outlook(folder, {})
    by_name = {each.use.name: each.days for each in found.lifetimes}
    last = max(by_name["n00"], by_name["n01"])
    assert found.milestones == Milestones(by_name["n02"], last, by_name["n02"])


def test_without_a_trace_the_milestones_are_not_known(folder, tmp_path):
    for name in ("metrics.json", "scenario.yaml"):
        (tmp_path / name).write_text((folder / name).read_text())
    assert outlook(tmp_path, {}).milestones is None


def test_figures_for_a_study_are_those_of_the_outlook(folder):
    loaded, reach = load(folder / "scenario.yaml"), Reach()
    metrics = run(loaded, observers=[reach]).metrics
    figures = lifetime_figures(loaded, metrics, reach.links, reach.hosts)
    stages = outlook(folder, {}).milestones
    assert figures["lifetime_first_dead_days"] == stages.first_dead_days
    assert figures["lifetime_partition_days"] == stages.partition_days
    assert figures["lifetime_accuracy_days"] == stages.accuracy_days
    assert figures["lifetime_median_days"] == spread_of(outlook(folder, {}).lifetimes).median_days
    hosting = lifetime_figures(loaded, metrics, reach.links, {0})
    assert hosting["lifetime_accuracy_days"] == outlook(folder, {}).lifetimes[0].days
    assert lifetime_figures(load(folder / "scenario.yaml", ["duty_plan=null"]), metrics, reach.links, reach.hosts) == {}


def test_options_replace_the_plan(folder):
    once = outlook(folder, {"activities_per_day": 1}).lifetimes[0].days
    listening = outlook(folder, {"between": "listen"}).lifetimes[0]
    assert once > outlook(folder, {}).lifetimes[0].days > listening.days
    assert listening.use.between_mw == pytest.approx(56.4 + 0.1635)


def test_a_folder_without_a_run(tmp_path):
    with pytest.raises(ScenarioError, match="expected the metrics of a finished run"):
        outlook(tmp_path, {})
