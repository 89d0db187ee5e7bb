"""Tree-reweighted max-product among crashes: nothing is proved that is not, and no node ends with an exception."""

import pytest
from trmp_runs import ASSOCIATION, COMMON, IDEAL, simulate

from netsim.metrics.optimality import Optimality
from netsim.trace.events import AlgorithmRecord, VariablePlacement


def test_a_root_that_dies_after_its_verdict_leaves_it_behind():
    """Nodes 2 and 10 hear and tell that nothing was proved in their components, and crash before they end."""
    few = [*COMMON, *IDEAL, "repetition=3", "algorithm.iterations=3"]
    _, figures = simulate(ASSOCIATION, [*few, "faults=[{type: crash, nodes: [2, 10], at_s: 12}]"])
    _, unharmed = simulate(ASSOCIATION, few)
    assert figures["map_proved"] == unharmed["map_proved"] == 0
    assert figures["map_proved_share"] == pytest.approx(unharmed["map_proved_share"])
    assert figures["trmp_iterations"] == unharmed["trmp_iterations"] == 3


def test_a_node_that_dies_before_the_verdict_is_not_vouched_for():
    _, figures = simulate(ASSOCIATION, [*COMMON, *IDEAL, "faults=[{type: crash, nodes: [12], at_s: 6.2}]"])
    assert figures["map_proved"] == 0
    assert figures["trmp_vertices_unfinished"] > 0


def figures_of(*records):
    """Figures for a model of three variables on two nodes."""
    optimality = Optimality()
    handlers = optimality.handlers()
    placed = VariablePlacement([0, 1, 2], ["a", "b", "c"], [4, 4, 7], [0, 1], [1, 2])
    handlers[VariablePlacement](placed, 0)
    for node, kind, fields in records:
        handlers[AlgorithmRecord](AlgorithmRecord(node, kind, fields), 0)
    return optimality.figures()


def verdict(vertex, proved):
    return f'{{"vertex": {vertex}, "proved": {str(proved).lower()}, "iterations": 2, "trees": 1}}'


BEGUN = (4, "trmp_begun", '{"vertices": [0, 1]}'), (7, "trmp_begun", '{"vertices": [2]}')
PROVED = [(4, "trmp_verdict", verdict(0, True)), (4, "trmp_verdict", verdict(1, True))]


def test_every_variable_needs_a_verdict():
    assert figures_of() == {}
    assert figures_of(*BEGUN, *PROVED, (7, "trmp_verdict", verdict(2, True)))["map_proved"] == 1
    silent = figures_of(*BEGUN, *PROVED)
    assert (silent["map_proved"], silent["trmp_vertices_unfinished"]) == (0, 1)
    assert silent["map_proved_share"] == pytest.approx(2 / 3)
    unproved = figures_of(*BEGUN, *PROVED, (7, "trmp_verdict", verdict(2, False)))
    assert (unproved["map_proved"], unproved["trmp_vertices_unfinished"]) == (0, 0)


def test_a_node_that_began_anew_vouches_for_nothing():
    """Not even a node that never began at all counts as proved: 2 has no record of any kind."""
    again = figures_of(BEGUN[0], *PROVED, BEGUN[0], PROVED[1])
    assert again["map_proved_share"] == pytest.approx(1 / 3)
    assert again["trmp_vertices_unfinished"] == 2
