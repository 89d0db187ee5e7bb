"""In one repetition every variant meets the same world; another repetition is another world."""

from dataclasses import replace

import numpy as np
import pytest
from study_rig import QUICKSTART, write_study

from netsim.scenario.run import run
from netsim.study.plan import load_plan
from netsim.trace.events import LinkTable, NodeTable, TruthOrigins, TruthTargets

SWEEP = [
    {
        "name": "algorithm",
        "cases": [
            {"name": "csmp"},
            {"name": "max-product", "set": {"algorithm.type": "max-product"}},
            {"name": "idle talk", "set": {"algorithm": {"type": "neighbour-traffic", "rounds": 1}}},
        ],
    },
    {"path": "fidelity", "values": ["ideal", "csma", "lpl"]},
    {"path": "nodes[0].radio", "values": ["cc2420", "cc2538"]},
]


class Witness:
    """Keeps what the world of a run is like."""

    def __init__(self):
        self.targets = self.links = self.nodes = None
        self.measured = {}

    def handlers(self):
        return {
            TruthTargets: lambda event, _: setattr(self, "targets", np.stack([event.x_m, event.y_m])),
            NodeTable: lambda event, _: setattr(self, "nodes", np.stack([event.x_m, event.y_m])),
            LinkTable: lambda event, _: setattr(self, "links", self._gains(event)),
            TruthOrigins: lambda event, _: self.measured.update({event.node: (event.x_m, event.y_m, event.target)}),
        }

    @staticmethod
    def _gains(event):
        pairs = zip(map(int, event.source), map(int, event.destination), strict=True)
        return dict(zip(pairs, map(float, event.gain_db), strict=True))


@pytest.fixture(scope="module")
def worlds(tmp_path_factory):
    """By repetition, the world of every variant."""
    folder = tmp_path_factory.mktemp("crn")
    plan = load_plan(write_study(folder, set={"duration_s": 2, "algorithm.rounds": 1}, sweep=SWEEP[1:]))
    other = load_plan(write_study(folder, set={"duration_s": 2}, sweep=SWEEP[:1]))
    found = {}
    for repetition in (0, 1):
        found[repetition] = []
        for variant in (*plan.variants, *other.variants):
            witness = Witness()
            scenario = replace(variant.loaded.scenario, repetition=repetition)
            run(replace(variant.loaded, scenario=scenario), observers=[witness])
            found[repetition].append(witness)
    return found


def same(first, second):
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("repetition", [0, 1])
def test_all_variants_of_a_repetition_meet_the_same_world(worlds, repetition):
    first, *others = worlds[repetition]
    assert first.targets.shape == (2, 10)
    assert sum(len(x_m) for x_m, _, _ in first.measured.values()) > 0
    for other in others:
        assert np.array_equal(first.nodes, other.nodes)
        assert np.array_equal(first.targets, other.targets)
        assert first.measured.keys() == other.measured.keys()
        assert all(same(first.measured[node], other.measured[node]) for node in first.measured)


@pytest.mark.parametrize("repetition", [0, 1])
def test_the_same_links_have_the_same_shadowing(worlds, repetition):
    first, *others = worlds[repetition]
    assert len(set(first.links.values())) > 10  # shadowed, not by distance alone
    for other in others:
        shared = first.links.keys() & other.links.keys()  # another radio hears others
        assert len(shared) >= 20
        assert all(first.links[pair] == other.links[pair] for pair in shared)


def test_repetitions_are_other_worlds(worlds):
    first, second = worlds[0][0], worlds[1][0]
    assert np.array_equal(first.nodes, second.nodes)  # a grid has no chance in it
    assert not np.intersect1d(first.targets, second.targets).size
    assert first.links != second.links
    shared = first.links.keys() & second.links.keys()
    assert all(first.links[pair] != second.links[pair] for pair in shared)


def test_another_seed_is_another_world_too(worlds, tmp_path):
    plan = load_plan(write_study(tmp_path, seed=2, sweep=[]))
    witness = Witness()
    run(plan.variants[0].loaded, observers=[witness])
    assert QUICKSTART.exists()
    assert not np.intersect1d(worlds[0][0].targets, witness.targets).size
