"""What routes are expected to cost before anything is sent, and hosts chosen by it."""

import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from netsim.kernels.association_model import AssociationInstance
from netsim.rng import Streams
from netsim.scenario.build import build
from netsim.scenario.links import air_between
from netsim.scenario.load import load
from netsim.scenario.places import places
from netsim.scenario.route_costs import PlannedRoutes
from netsim.units import NS_PER_S

FAINT = ["nodes[0].tx_power_dbm=-25", "medium.exponent=4"]


def planned(path: Path, overrides: list[str]):
    loaded = load(path, overrides)
    streams = Streams(loaded.scenario.seed, loaded.scenario.repetition)
    nodes = places(loaded, streams)
    air = air_between(nodes, loaded, streams)
    return PlannedRoutes(loaded.scenario, nodes, air), nodes, air


@pytest.fixture
def path(scenarios: Path) -> Path:
    return scenarios / "chen2006" / "association-csmp.yaml"


def test_one_hop_everywhere_on_ideal_air(path):
    costs, nodes, _ = planned(path, ["medium={type: ideal}", "network={type: one-hop}"])
    assert {costs.hops(a.id, b.id) for a in nodes for b in nodes if a is not b} == {1.0}
    assert costs.hops(3, 3) == costs.joule_per_byte(3, 3) == 0.0
    radio = nodes[0].radio
    byte_s = 8 / radio.bitrate_bps
    expected_j = (radio.transmit_power_mw(0.0) + radio.receive_mw) * 1e-3 * byte_s
    assert costs.joule_per_byte(0, 24) == pytest.approx(expected_j, rel=1e-6)
    assert radio.airtime_ns(1) - radio.airtime_ns(0) == pytest.approx(byte_s * NS_PER_S)


def test_out_of_reach_of_one_hop_is_out_of_reach(path):
    costs, *_ = planned(path, ["medium={type: ideal, range_m: 5.5}", "network={type: one-hop}"])
    assert costs.hops(0, 1) == 1.0
    assert costs.hops(0, 24) == costs.joule_per_byte(0, 24) == math.inf


def test_hops_are_those_of_the_grid(path):
    costs, nodes, _ = planned(
        path, ["medium={type: ideal, range_m: 5.5}", "network={type: shortest-path, metric: hop}"]
    )
    for a in nodes:
        for b in nodes:
            assert costs.hops(a.id, b.id) == abs(a.x_m - b.x_m) / 5 + abs(a.y_m - b.y_m) / 5


def test_joules_of_lossy_routes_are_the_least_expected(path):
    """All radios alike: joules a byte are the ETX of the route, the least of any (Floyd and Warshall)."""
    costs, nodes, air = planned(path, FAINT)
    table = np.full((25, 25), np.inf)
    prr = {(node, link.id): link.prr for node, links in air.neighbours.items() for link in links}
    for (a, b), there in prr.items():
        if min(there, prr.get((b, a), 0.0)) >= 0.5:
            table[a, b] = 1.0 / (there * prr[b, a])
    np.fill_diagonal(table, 0.0)
    for middle in range(25):
        table = np.minimum(table, table[:, middle, None] + table[None, middle, :])
    radio = nodes[0].radio
    once_j = (radio.transmit_power_mw(-25.0) + radio.receive_mw) * 1e-3 * 8 / radio.bitrate_bps
    measured = np.array([[costs.joule_per_byte(a, b) for b in range(25)] for a in range(25)])
    np.testing.assert_allclose(measured, once_j * table, rtol=1e-6)
    assert max(costs.hops(a, b) for a in range(25) for b in range(25)) > 2


def instance(path: Path, hosting: str, overrides: list[str]) -> AssociationInstance:
    return build(load(path, [f"problem.hosting={hosting}", *overrides])).problem.instance


@pytest.mark.parametrize("hosting", ["nearest", "least_communication", "least_energy", "load_balanced"])
def test_hosts_cover_their_target_and_lead_the_candidates(path, hosting):
    drawn = instance(path, hosting, FAINT)
    assert AssociationInstance.from_json(drawn.to_json()).preferences == drawn.preferences
    for sensor in range(25):
        for covered in drawn.knowledge(sensor).targets:
            covering = {drawn.sensor_nodes[other] for other in covered.sensors}
            assert set(covered.candidates) == (covering if covered.vertex is not None else set())
            assert covered.candidates[:1] == (() if covered.host is None else (covered.host,))


def test_each_rule_is_best_by_its_own_measure(path):
    costs, *_ = planned(path, FAINT)
    drawn = {rule: instance(path, rule, FAINT) for rule in ("nearest", "least_communication", "load_balanced")}

    def fullest(each: AssociationInstance) -> int:
        return max(Counter(host for host in each.hosts if host is not None).values())

    def byte_hops(each: AssociationInstance) -> float:
        sizes = [16 + 8 * (0.8 * len(targets) + 0.15) for targets in each.targets_of]
        return sum(
            sizes[s] * (costs.hops(host, each.sensor_nodes[s]) + costs.hops(each.sensor_nodes[s], host))
            for sensors, host in zip(each.coverage, each.hosts, strict=True)
            if host is not None
            for s in sensors
        )

    assert min(drawn, key=lambda rule: byte_hops(drawn[rule])) == "least_communication"
    assert fullest(drawn["load_balanced"]) < fullest(drawn["least_communication"])


def test_instances_written_before_there_was_a_choice_still_read(path):
    drawn = instance(path, "nearest", [])
    content = json.loads(drawn.to_json())
    del content["preferences"]
    old = AssociationInstance.from_json(json.dumps(content))
    covered = next(c for c in old.knowledge(12).targets if c.vertex is not None)
    assert covered.candidates[0] == covered.host
    assert list(covered.candidates[1:]) == sorted(set(covered.candidates) - {covered.host})


@pytest.mark.parametrize("hosting", ["nearest", "least_communication", "least_energy", "load_balanced"])
def test_subregions_live_where_the_rule_says(scenarios, hosting):
    """On ideal air all hops are alike: nearest it is, unless load is balanced."""
    path = scenarios / "chen2006" / "target-distribution.yaml"
    ideal = ["medium={type: ideal, delay_s: 0.001}", "mac={type: ideal}", "network={type: one-hop}"]
    drawn = build(load(path, [f"problem.hosting={hosting}", *ideal])).problem.instance
    nearest = build(load(path, ideal)).problem.instance
    for subregion in drawn.subregions:
        assert subregion.host in {drawn.sensor_nodes[sensor] for sensor in subregion.sensors}
    hosts, usual = ([each.host for each in instance.subregions] for instance in (drawn, nearest))
    if hosting == "load_balanced":
        assert max(Counter(hosts).values()) <= max(Counter(usual).values())
    else:
        assert hosts == usual
