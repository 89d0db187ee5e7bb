"""Tree-reweighted max-product among crashes: nothing is proved that is not, and no node ends with an exception."""

import json

import pytest
from trmp_runs import ASSOCIATION, COMMON, IDEAL, simulate

from netsim.algorithms.hosting import Measurements, is_founded
from netsim.kernels.assignment import best_assignment
from netsim.kernels.association_graph import model_vertices
from netsim.kernels.association_model import AssociationInstance
from netsim.metrics.optimality import Optimality
from netsim.trace.events import AlgorithmRecord, Association, Problem, VariablePlacement


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


@pytest.mark.parametrize("at_s", [3, 6.5, 8, 12])
def test_a_reboot_ends_in_not_proved(at_s):
    """Before, in and after the growing of trees, and once some components are through: no node raises anything."""
    crash = f"faults=[{{type: crash, nodes: [7, 12], at_s: {at_s}, reboot_after_s: 1}}]"
    keep, figures = simulate(ASSOCIATION, [*COMMON, *IDEAL, "algorithm.time_limit_s=60", crash])
    assert figures["reboots"] == 2
    assert figures["map_proved"] == 0
    if at_s in (6.5, 8):
        assert any(note["is_abandoned"] for note in keep.notes("trmp_unfinished"))


def test_who_gave_up_does_not_wait_for_the_end():
    """Four sensors hang together here; they are through long before the time is over."""
    line = [[x, 10] for x in range(5, 26, 5)]
    few = ["problem.targets.count=12", f"nodes[0].placement={{type: listed, positions_m: {line}}}"]
    crash = "faults=[{type: crash, nodes: [2], at_s: 6.1, reboot_after_s: 0.1}]"
    keep, figures = simulate(ASSOCIATION, [*COMMON, *IDEAL, *few, crash])
    unfinished = keep.notes("trmp_unfinished")
    assert len(unfinished) == 4
    assert all(note["is_abandoned"] for note in unfinished)
    assert figures["simulated_s"] < 100


@pytest.mark.parametrize("repetition", range(1, 7))
def test_what_is_proved_among_reboots_is_the_map(repetition):
    rule = "{type: crash, nodes: [2, 7, 11, 12, 13, 17, 22], rate_per_h: 200, reboot_after_s: 0.5}"
    rest = ["problem.targets.count=20", "algorithm.time_limit_s=60", f"repetition={repetition}", f"faults=[{rule}]"]
    keep, figures = simulate(ASSOCIATION, [*COMMON, *IDEAL, *rest])
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    exact = best_assignment(instance).assignment
    proved = proved_at_the_end(keep)
    assert figures["reboots"] > 0
    assert figures["map_proved"] == 0
    decided = {event.node: event.target for event in keep.of(Association)}  # the last of each
    sensors = [vertex for vertex in proved if vertex < len(instance.sensor_nodes)]
    assert all(decided[instance.sensor_nodes[sensor]] == exact[sensor].tolist() for sensor in sensors)


NINE = ["nodes[0].placement={type: grid, rows: 3, columns: 3, spacing_m: 5}", "algorithm.time_limit_s=100"]
UNACKNOWLEDGED = ["mac={type: ideal}", "network={type: one-hop}", "medium={type: ideal, loss_probability: 0.3}"]


@pytest.mark.parametrize("seed", [9, 10, 11])
def test_a_host_that_lacks_a_measurement_proves_nothing_about_its_target(seed):
    """In the target-oriented model the size of a message need not tell it: a sensor may matter to one target alone.

    Without giving up, all three runs prove for such a target that it was missed by a sensor that detected it.
    """
    model = ["problem.targets.count=6", "problem.model=target", "problem.false_alarms=geometric", f"seed={seed}"]
    keep, figures = simulate(ASSOCIATION, [*COMMON, *NINE, *UNACKNOWLEDGED, *model])
    assert any(note["is_abandoned"] for note in keep.notes("trmp_unfinished"))
    assert figures["map_proved"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("model", ["hybrid", "sensor", "target"])
def test_what_is_proved_through_losses_is_the_map_in_every_model(model):
    """Twenty-five problems each, a fifth of all frames lost and nobody acknowledging; the integer programme knows."""
    kind = [f"problem.model={model}", "problem.false_alarms=geometric", "problem.targets.count=5"]
    loss = [*UNACKNOWLEDGED[:2], "medium={type: ideal, loss_probability: 0.2}", "algorithm.setup_exchange=broadcast"]
    proved = 0
    for seed in range(25):
        _, figures = simulate(ASSOCIATION, [*COMMON, *NINE, *loss, *kind, f"seed={seed}"])
        proved += figures["map_proved"]
        assert not figures["map_proved"] or figures["association_differs_from_exact_map"] == 0
    assert proved > 12


@pytest.mark.parametrize(("allowance_j", "period_s", "seed"), [(0.3, 10, 1), (0.1, 5, 3)])
def test_what_is_refused_for_want_of_energy_is_made_up_for(allowance_j, period_s, seed):
    """Nodes may compute and send in the first part of each period: whatever is refused comes when the allowance does.

    Five seconds are also the silence after which nodes ask: they would ask for ever when nobody may answer.
    """
    few = ["fidelity=ideal", "problem.targets.count=8", "algorithm.time_limit_s=300", f"seed={seed}"]
    budget = f"nodes[0].budget={{allowance_j: {allowance_j}, per: {period_s}, policy: refuse}}"
    _, figures = simulate(ASSOCIATION, [*COMMON, NINE[0], *few, budget])
    assert figures["map_proved"] == 1
    assert figures["association_differs_from_exact_map"] == 0


def test_a_node_without_energy_to_compute_leaves_its_component_unproved():
    """The allowance is for the whole run and gone while inference goes on: nothing comes after it, and nothing fails."""
    few = ["fidelity=ideal", "problem.targets.count=8", "algorithm.time_limit_s=60", "seed=1"]
    budget = "nodes[0].budget={allowance_j: 0.345, per: run, policy: refuse}"
    _, figures = simulate(ASSOCIATION, [*COMMON, NINE[0], *few, budget])
    assert 0 < figures["map_proved_share"] < 1
    assert figures["trmp_messages_by_phase_per_sensor"]["inference"] > 0


def test_vertices_made_without_a_measurement_are_not_founded():
    """Sensor 2 was not heard: it matters to targets that it covers, and to sensors it shares a target with."""
    keep, _ = simulate(ASSOCIATION, [*COMMON, *IDEAL, NINE[0], "algorithm.time_limit_s=7"])
    instance = AssociationInstance.from_json(keep.of(Problem)[0].content_json)
    knowledge = instance.knowledge(4)
    others_m = {other: instance.measurements_m[other] for other in knowledge.partners}
    for vertex in model_vertices(knowledge, instance.measurements_m[4], others_m):
        for other in range(9):
            measured = Measurements(knowledge, instance.measurements_m[4], others_m, frozenset([other]))
            assert is_founded(vertex, measured) == (other != vertex.id and other not in vertex.neighbours)
        assert is_founded(vertex, None)


def proved_at_the_end(keep):
    """Vertices whose last word is a proof."""
    proved = set()
    for event in keep.of(AlgorithmRecord):
        fields = json.loads(event.fields_json)
        if event.kind == "trmp_begun":
            proved -= set(fields["vertices"])
        elif event.kind == "trmp_verdict" and fields["proved"]:
            proved.add(fields["vertex"])
    return proved


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


def test_losses_that_nobody_notices_cost_about_a_round_trip():
    """Some sixty of the messages are lost; each would cost the silence of 5 s and more, this takes 10 s without loss."""
    silent = ["medium={type: ideal, loss_probability: 0.05}", "mac={type: ideal}", "network={type: one-hop}"]
    rest = ["algorithm.setup_exchange=broadcast", "repetition=1"]
    _, figures = simulate(ASSOCIATION, [*COMMON, *silent, *rest])
    assert figures["map_proved"] == 1
    assert figures["last_news_s"] < 30
