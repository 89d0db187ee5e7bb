"""Leaders that find each other after their tracks have changed hands, on a medium without physics and on a lossy one."""

import itertools
import json

import numpy as np
import pytest

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_identity import WORD, Identities
from netsim.algorithms.joint_location import LOCATE, REGISTER, Whereabouts, home_of
from netsim.algorithms.joint_messages import Held
from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.algorithms.joint_station import Station
from netsim.kernels.energy_sensing import EnergyModel
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge
from netsim.kernels.particles import equal_weights
from netsim.kernels.vehicle_labels import VehicleLabels, label_probabilities
from netsim.testing import DROP, ScriptedMedium, rule, run_algorithm
from netsim.trace.events import AlgorithmRecord, MessageSent
from netsim.units import NS_PER_S, s_to_ns

NODES = 12
LOOK_S = 20
SENSORS_M = {node: (10.0 * node, 0.0) for node in range(NODES)}
KNOWLEDGE = EnergyTrackingKnowledge(
    has_sensor=True,
    sensors_m=SENSORS_M,
    model=EnergyModel(43200.0, 2.0, 30.0),
    sensing_range_m=120.0,
    reading_s=1.0,
    max_speed_m_per_s=45.0,
    targets=2,
    labels=VehicleLabels((0, 1)),
)


def held_of(track, known, step, turn):
    return Held(step, turn, (track,), equal_weights(np.zeros((1, 1, 2))), known)


class Wandering:
    """Tracks 0 and 1 have met at node 0, which keeps track 0; track 1 goes from node 1 on to the next every second.

    At `LOOK_S` node 0 looks at its target, and what it learns is to reach whoever leads track 1 by then; so every 3 s.
    """

    def __init__(self, parameters, moves, looks):
        self._parameters, self._moves, self._looks = parameters, moves, looks

    def run(self, node):
        station = Station(node, KNOWLEDGE, self._parameters)
        identities = Identities(station)
        node.spawn(self._script(node, identities))
        while True:
            message = yield from node.receive(kinds={WORD, REGISTER, LOCATE, "move"})
            if message.kind == WORD:
                identities.hear(message)
            elif message.kind != "move":
                identities.whereabouts.serve(message)

    def _script(self, node, identities):
        both = [Acquaintances.alone(track, np.eye(2)[track], Place(0, track)) for track in (0, 1)]
        known = both[0].merged(both[1]).met((0, 1))
        yield from node.pause_until(0)
        if node.id == 0:
            identities.lead(held_of(0, known, 0, 0))
            for look in range(self._looks):
                yield from node.pause_until(s_to_ns(LOOK_S + 3 * look))
                identities.evidence.classify(held_of(0, known, LOOK_S, 0))
        elif node.id <= self._moves + 1:
            yield from node.pause_until(s_to_ns(node.id - 1) + s_to_ns(0.01 * (node.id > 1)))
            identities.lead(held_of(1, known, 0, node.id - 1))
            if node.id <= self._moves:
                yield from node.pause_until(s_to_ns(node.id))
                yield from node.pause(s_to_ns(0.02))
                identities.leave((1,), Place(node.id, node.id + 1), known)


def run_of(moves, medium=None, looks=1, label=lambda: 0, accuracy=0.94, **parameters):
    return run_algorithm(
        lambda: Wandering(JointTrackingParameters(**parameters), moves, looks),
        NODES,
        knowledge=lambda _: KNOWLEDGE,
        observe=lambda _: [0.0, *label_probabilities(label(), 2, accuracy)],
        medium=medium,
        duration_s=LOOK_S + 3 * looks + 9,
    )


def records(run):
    """Events of identities in order: node, what, rows."""
    told = [(event.node, json.loads(event.fields_json)) for _, event in run.of(AlgorithmRecord)]
    return [(node, fields["event"], np.array(fields["rows"])) for node, fields in told]


def sent(run, kind):
    return [(event.source, event.destination) for _, event in run.of(MessageSent) if event.kind == kind]


@pytest.mark.parametrize("location", ["forwarding", "rendezvous"])
@pytest.mark.parametrize("moves", [0, 1, 4, 10])
def test_a_leader_that_has_moved_is_found(location, moves):
    run = run_of(moves, location=location)
    assert not run.failures
    (learned, _, clear), (told, what, rows) = records(run)
    assert (learned, told, what) == (0, moves + 1, "heard")
    np.testing.assert_allclose(clear, [[0.94, 0.06], [0.06, 0.94]], atol=1e-7)
    np.testing.assert_array_equal(rows, clear)
    assert sent(run, "heard") == [(moves + 1, 0)]


def test_pointers_lead_from_hand_to_hand_and_the_answer_shortens_the_way():
    run = run_of(3, looks=2)
    assert sent(run, WORD) == [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]
    assert sent(run, LOCATE) == sent(run, REGISTER) == []


def test_a_rendezvous_is_told_of_every_leader_and_asked_once():
    run = run_of(3, location="rendezvous")
    home = home_of(1, KNOWLEDGE)
    assert sent(run, WORD) == [(0, 4)]
    assert sent(run, LOCATE) == [(0, home)]
    assert [each for each in sent(run, REGISTER) if each[1] == home] == [(n, home) for n in (1, 2, 3, 4) if n != home]


@pytest.mark.parametrize("location", ["forwarding", "rendezvous"])
@pytest.mark.parametrize("kind", [WORD, "heard", LOCATE, "located", REGISTER, "registered"])
def test_a_message_that_is_lost_twice_is_sent_again(location, kind):
    run = run_of(3, ScriptedMedium([rule(DROP, kind=kind, counts={0, 1})]), location=location)
    assert {node for node, what, _ in records(run) if what == "heard"} == {4}
    assert "unanswered" not in [what for _, what, _ in records(run)]


def test_a_leader_that_is_silent_is_given_up():
    rounds, attempts = 4, 2
    lost = ScriptedMedium([rule(DROP, kind="heard")])
    run = run_of(0, lost, tell_rounds=rounds, tell_attempts=attempts)
    assert [what for _, what, _ in records(run)].count("unanswered") == 1
    assert len(sent(run, WORD)) == rounds * attempts
    assert max(time_ns for time_ns, _ in run.of(MessageSent)) < (LOOK_S + 6) * NS_PER_S


def test_a_leader_that_was_given_up_gets_one_row_of_words_for_each_news():
    lost = ScriptedMedium([rule(DROP, kind=WORD)])
    labels = itertools.cycle([0, 1])
    run = run_of(0, lost, looks=4, tell_rounds=2, tell_attempts=1, label=lambda: next(labels), accuracy=0.9)
    events = [what for _, what, _ in records(run)]
    assert events.count("evidence") == 4
    assert len(sent(run, WORD)) == 2 + 3


def test_what_is_said_does_not_grow_with_time():
    """Labels that contradict each other, so that each is news: sixteen changes known to all become a new start."""
    looks, labels = 40, itertools.cycle([0, 1])
    run = run_of(2, looks=looks, tell_change=0.0, classify_above=0.7, label=lambda: next(labels), accuracy=0.75)
    sizes = [event.size_byte for _, event in run.of(MessageSent) if event.kind == WORD]
    events = [what for _, what, _ in records(run)]
    assert events.count("evidence") == looks
    assert "unanswered" not in events
    assert max(sizes) == min(sizes) + 16 * (sizes[9] - sizes[8])
    np.testing.assert_allclose(records(run)[-1][2], 0.5, atol=1e-6)


def test_homes_are_sensors_and_differ():
    homes = {home_of(track, KNOWLEDGE) for track in range(12)}
    assert homes <= set(SENSORS_M)
    assert len(homes) > 3


def test_a_rendezvous_itself_goes_by_the_later_word_too():
    """Node `home` led track 1 at turn 2, and has heard since that node 7 leads it at turn 4."""
    home, found = home_of(1, KNOWLEDGE), []

    class Once:
        def run(self, node):
            whereabouts = Whereabouts(Station(node, KNOWLEDGE, JointTrackingParameters(location="rendezvous")))
            if node.id == home:
                whereabouts.took(1, 2)
                found.append((yield from whereabouts.find(1, Place(4, 7))))
                found.append((yield from whereabouts.find(1, Place(1, 3))))

    run_algorithm(Once, NODES, knowledge=lambda _: KNOWLEDGE, duration_s=1.0).require_success()
    assert found == [7, home]
