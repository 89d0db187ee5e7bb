"""Choosing hosts, against brute force."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.kernels.placement import HEADER_BYTE, Lodger, balanced_hosts, communication_cost, message_byte, place


class Line:
    """Nodes on a line, a hop apart each; going up costs twice the joules; nobody reaches node 9."""

    def hops(self, source: int, destination: int) -> float:
        return np.inf if 9 in (source, destination) and source != destination else abs(source - destination)

    def joule_per_byte(self, source: int, destination: int) -> float:
        return self.hops(source, destination) * (2.0 if destination > source else 1.0)


POSITIONS_M = {node: (float(node), 0.0) for node in range(10)}


def lodger(x_m: float, **byte_by_node: float) -> Lodger:
    sizes = {int(name[1:]): size for name, size in byte_by_node.items()}
    return Lodger((x_m, 0.0), tuple(sizes), sizes)


def test_nearest_ignores_what_is_said_and_equals_go_to_the_lower_node():
    assert place("nearest", [lodger(2.5, n3=1, n2=1, n8=99)], POSITIONS_M) == ((2, 3, 8),)


def test_least_communication_weighs_hops_by_bytes():
    """On 0: 2 x (10 x 1 + 30 x 4); on 1: 2 x (20 + 90); on 4: 2 x (80 + 30)."""
    each = lodger(0.0, n0=20, n1=10, n4=30)
    assert communication_cost(each, 0, Line().hops) == (0.0, 260.0)
    assert place("least_communication", [each], POSITIONS_M, Line()) == ((1, 4, 0),)


def test_least_energy_counts_both_directions():
    each = lodger(0.0, n1=8, n3=8)
    assert communication_cost(each, 1, Line().joule_per_byte) == (0.0, 8 * 2 * 2.0 + 8 * 2 * 1.0)
    assert place("least_energy", [each], POSITIONS_M, Line()) == ((1, 3),)


def test_a_candidate_that_reaches_fewer_comes_last():
    each = lodger(9.0, n9=1, n0=5, n1=5)
    assert place("least_communication", [each], POSITIONS_M, Line())[0][-1] == 9


def test_nobody_to_host_it():
    nobody = Lodger((0.0, 0.0), (), {})
    assert place("nearest", [nobody], POSITIONS_M) == ((),)
    assert place("load_balanced", [nobody], POSITIONS_M) == ((),)
    assert place("load_balanced", [], POSITIONS_M) == ()
    assert balanced_hosts([]) == []


def test_a_rule_that_needs_costs_says_so():
    with pytest.raises(ValueError, match="least_energy needs the costs"):
        place("least_energy", [lodger(0.0, n1=1)], POSITIONS_M)


def test_a_message_is_its_header_and_eight_bytes_a_number():
    assert message_byte(3.0) == HEADER_BYTE + 24


CHOICES = st.lists(
    st.dictionaries(st.integers(0, 4), st.integers(0, 20).map(float), min_size=1, max_size=4), min_size=1, max_size=5
)


@given(CHOICES)
def test_balanced_hosts_are_the_best_by_brute_force(costs):
    def judged(hosts):
        return max(hosts.count(node) for node in hosts), sum(each[h] for each, h in zip(costs, hosts, strict=True))

    best = min(judged(hosts) for hosts in product(*costs))
    assert judged(tuple(balanced_hosts(costs))) == best


@given(st.permutations([2, 3, 5, 7]), st.sampled_from(["nearest", "least_communication", "least_energy"]))
def test_the_order_of_candidates_plays_no_part(order, rule):
    sizes = {2: 4.0, 3: 9.0, 5: 1.0, 7: 6.0}
    turned = Lodger((4.0, 1.0), tuple(order), {node: sizes[node] for node in order})
    straight = Lodger((4.0, 1.0), (2, 3, 5, 7), sizes)
    assert place(rule, [turned], POSITIONS_M, Line()) == place(rule, [straight], POSITIONS_M, Line())


@given(CHOICES.filter(lambda costs: len(costs) > 1))
def test_balanced_orders_name_every_candidate_once_the_host_first(costs):
    lodgers = [Lodger((float(i), 1.0), tuple(each), dict(each)) for i, each in enumerate(costs)]
    orders = place("load_balanced", lodgers, POSITIONS_M)
    away_m = [{node: float(np.hypot(node - i, 1.0)) for node in each} for i, each in enumerate(costs)]
    assert [sorted(order) for order in orders] == [sorted(each) for each in costs]
    hosts = [order[0] for order in orders]
    least = min(max(chosen.count(n) for n in chosen) for chosen in product(*costs))
    assert max(hosts.count(node) for node in hosts) == least
    best = min(
        sum(each[h] for each, h in zip(away_m, chosen, strict=True))
        for chosen in product(*costs)
        if max(chosen.count(n) for n in chosen) == least
    )
    assert sum(each[h] for each, h in zip(away_m, hosts, strict=True)) == pytest.approx(best)
