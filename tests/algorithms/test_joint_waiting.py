"""Evidence that is too little to be told: it goes with its track, and counts for who that was before a meeting."""

import json

import numpy as np
import pytest

from netsim.algorithms import joint_leader
from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_belief import operations
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_groups import joined
from netsim.algorithms.joint_identity import Identities
from netsim.algorithms.joint_leader import Leading
from netsim.algorithms.joint_messages import Held, decode_given, encode_given
from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.algorithms.joint_station import Station
from netsim.kernels import identity
from netsim.kernels.energy_sensing import EnergyModel, likelihood_operations
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge
from netsim.kernels.logical_targets import join_operations, separate_operations
from netsim.kernels.particles import equal_weights, predict_operations
from netsim.kernels.spare_targets import spare_operations
from netsim.kernels.vehicle_labels import VehicleLabels, label_probabilities
from netsim.testing import run_algorithm
from netsim.trace.events import AlgorithmRecord
from netsim.units import NS_PER_S

SURE, LABEL = (0.999, 0.001), label_probabilities(0, 2, 0.94)
PARAMETERS = JointTrackingParameters()


def known():
    """Two tracks that are nearly sure who they are."""
    one, other = (Acquaintances.alone(track, np.eye(2)[track], Place(0, 0)) for track in (0, 1))
    return one.merged(other).met((0, 1)).learned(0, SURE).renewed()


def held(track, x_m):
    return Held(1, track + 1, (track,), equal_weights(np.full((5, 1, 2), float(x_m))), known())


class Scripted:
    """A node that does nothing but a script."""

    def __init__(self, script):
        self._script = script

    def run(self, node):
        yield from self._script(Station(node, node.knowledge, PARAMETERS))


def run_of(script):
    knowledge = EnergyTrackingKnowledge(
        True, {0: (0.0, 0.0)}, EnergyModel(43200.0, 2.0, 30.0), 120.0, 1.0, 45.0, 2, labels=VehicleLabels((0, 1))
    )
    run = run_algorithm(
        lambda: Scripted(script),
        1,
        knowledge=lambda _: knowledge,
        observe=lambda _: [0.0, *LABEL],
        duration_s=2.9,
    )
    assert not run.failures
    return run


def read(station, identities):
    """Look at the label once, which says too little that is new to be told."""
    identities.evidence.classify(held(0, 0))
    yield from station.node.pause(NS_PER_S // 10)


def test_evidence_that_waits_goes_with_the_belief():
    gone = []

    def script(station):
        identities = Identities(station)
        identities.lead(held(0, 0))
        yield from read(station, identities)
        first = identities.evidence.with_waiting(held(0, 0))
        there = decode_given(encode_given(first, "float32"), "float32")
        identities.leave((0,), Place(2, 7), first.known)
        assert identities.evidence.with_waiting(held(0, 0)).waiting == ()
        identities.lead(there)
        identities.evidence.keep(there)
        yield from read(station, identities)
        gone.extend(each.waiting for each in (first, identities.evidence.with_waiting(there)))

    run_of(script)
    (once,), (twice,) = gone
    assert once == pytest.approx(LABEL / LABEL.max())
    assert twice == pytest.approx((LABEL / LABEL.max()) ** 2)


def test_evidence_of_before_a_meeting_does_not_tell_who_the_track_is_after_it():
    """Tracks 0 and 1 of one node are joined: the label counts for track 0 as it was, and nothing waits any more."""
    waits = []

    def script(station):
        identities = Identities(station)
        leading = Leading(station, lambda _: None, lambda _: None, identities)
        leading.take(held(0, 0))
        yield from read(station, identities)
        waits.append(identities.evidence.with_waiting(held(0, 0)).waiting)
        leading.take(held(1, 50))
        waits.append(identities.evidence.with_waiting(held(0, 0)).waiting)

    run = run_of(script)
    assert [bool(each) for each in waits] == [True, False]
    records = [(event.kind, json.loads(event.fields_json)) for _, event in run.of(AlgorithmRecord)]
    assert [kind for kind, _ in records[:2]] == ["identity", "merge"]
    np.testing.assert_allclose(records[0][1]["rows"][0], identity.posterior(np.array(SURE), LABEL), rtol=1e-6)


def test_joining_and_naming_are_work(monkeypatch):
    """Two groups of 5 particles become one of 200; a step of that takes its naming besides what its particles take."""
    charged = []

    def noted(_, count):
        charged.append(count)
        yield from ()

    monkeypatch.setattr(joint_leader, "charge", noted)

    def script(station):
        leading = Leading(station, lambda _: None, lambda _: None, Identities(station))
        leading.take(held(0, 0))
        leading.take(held(1, 50))
        yield from station.node.pause(NS_PER_S // 2)

    run_of(script)
    assert charged == [join_operations(200, 10)]
    pair = joined(held(0, 0), held(1, 50), 200, np.random.default_rng(1)).belief
    one = equal_weights(pair.positions_m[:, :1])
    naming = 2 * separate_operations(200, 2) + spare_operations(7, 200, 2)
    assert operations(7, pair) - likelihood_operations(7, 200, 2) - naming == (
        operations(7, one) - likelihood_operations(7, 200, 1) + predict_operations(200, 1)
    )
