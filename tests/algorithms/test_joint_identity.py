"""Identities in whole runs: two vehicles cross, sensors tell their classes, and leaders tell each other."""

import json

import numpy as np
import pytest
from joint_rig import JointRun

from netsim.trace.events import AlgorithmRecord, Identity, MessageSent

S = 1_000_000_000
WORLD = """
kind: scenario
schema_version: 1
name: small-crossing
seed: 1
duration_s: 25
field: {{width_m: 320, height_m: 320}}
nodes:
  - name: sensors
    placement: {{type: jittered-grid, rows: 8, columns: 8, spacing_m: 40, jitter_sd_m: 6}}
    radio: cc2420
    cpu: cortex_m4
medium: {medium}
mac: {mac}
network: {{type: shortest-path}}
problem:
  type: energy-tracking
  {sense}
  targets:
    - vehicle: car
      track: {{type: straight, from_m: [20, 300], to_m: [300, 20], speed_m_per_s: 15}}
    - vehicle: truck
      track: {{type: straight, from_m: [300, 300], to_m: [20, 20], speed_m_per_s: 15}}
    {targets}
algorithm: {{type: joint-tracking}}
"""
IDEAL = "{type: ideal, range_m: 100}"
LABELS = "labels: {accuracy: 0.94, rate_per_s: 1}"


def world(folder, *settings, medium=IDEAL, mac="{type: ideal}", sense=LABELS, targets=""):
    path = folder / "world.yaml"
    path.write_text(WORLD.format(medium=medium, mac=mac, sense=sense, targets=targets))
    return JointRun(path, *settings)


def told(run):
    """What leaders recorded of identities: time, and the fields with the group's rows as an array."""
    found = [(time_ns, json.loads(e.fields_json)) for time_ns, e in run.of(AlgorithmRecord) if e.kind == "identity"]
    return [(time_ns, fields | {"rows": np.array(fields["rows"])}) for time_ns, fields in found]


def check_matrices(run):
    for _, fields in told(run):
        rows = fields["rows"]
        np.testing.assert_allclose(rows.sum(axis=1), 1.0, atol=1e-9)
        columns = rows.sum(axis=0)
        np.testing.assert_allclose(columns, np.rint(columns), atol=1e-9)
        assert np.rint(columns).sum() == len(fields["group"])
    for _, event in run.of(Identity):
        assert sum(event.probability) == pytest.approx(1.0, abs=1e-9)


@pytest.fixture(scope="module")
def labelled(tmp_path_factory):
    return world(tmp_path_factory.mktemp("labelled"))


def test_one_crossing_then_evidence_of_94_percent(labelled):
    """Liu et al. 2004, section 6 and Fig. 6c."""
    events = told(labelled)
    (met,) = [fields for _, fields in events if fields["event"] == "met"]
    np.testing.assert_array_equal(met["rows"], 0.5)
    first = next(fields for _, fields in events if fields["event"] == "evidence")
    np.testing.assert_allclose(np.sort(first["rows"], axis=1), [[0.06, 0.94]] * 2, atol=1e-7)


def test_leaders_agree_in_the_end_and_know_who_is_who(labelled):
    check_matrices(labelled)
    last = {event.track: np.array(event.probability) for _, event in labelled.of(Identity)}
    np.testing.assert_allclose(last[0] + last[1], 1.0, atol=1e-9)
    figures = labelled.figures()
    assert figures["identity_probability_last"] > 0.9
    assert figures["identity_evidence"] >= 2
    assert figures["identity_messages"] >= 2 * (figures["identity_evidence"] - 1)
    assert figures["identity_words_unanswered"] == figures["identity_contradictions"] == 0


def test_only_leaders_of_the_group_get_words(labelled):
    """Those who lead its tracks, or did."""
    leaders = {node for holders in labelled.leaders().values() for _, nodes in holders for node in nodes}
    for _, event in labelled.of(MessageSent):
        if event.kind in ("word", "heard"):
            assert {event.source, event.destination} <= leaders


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_rows_outside_the_group_do_not_change_by_a_bit(tmp_path, seed):
    tank = "- {vehicle: tank, track: {type: straight, from_m: [10, 160], to_m: [10, 170], speed_m_per_s: 0.4}}"
    run = world(tmp_path, f"seed={seed}", "algorithm.separate_m=80", targets=tank)
    check_matrices(run)
    rows, touched, untouched = {track: np.eye(3)[track] for track in range(3)}, set(), 0
    for _, event in run.events:
        if isinstance(event, AlgorithmRecord) and event.kind == "identity":
            touched.update(json.loads(event.fields_json)["group"])
        elif isinstance(event, Identity):
            if event.track not in touched:
                np.testing.assert_array_equal(event.probability, rows[event.track])
                untouched += 1
            rows[event.track] = np.array(event.probability)
            touched.discard(event.track)
    assert untouched > 20


@pytest.mark.slow
def test_without_evidence_nothing_is_said_but_of_the_meeting(tmp_path):
    run = world(tmp_path, sense="saturation_m: 30")
    assert {fields["event"] for _, fields in told(run)} == {"met"}
    assert run.figures()["identity_messages"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("location", ["forwarding", "rendezvous"])
@pytest.mark.parametrize("seed", range(1, 4))
def test_every_copy_is_a_matrix_when_frames_are_lost(tmp_path, location, seed):
    run = world(
        tmp_path,
        f"seed={seed}",
        f"algorithm.location={location}",
        medium="{type: ideal, range_m: 100, loss_probability: 0.1}",
    )
    assert told(run)
    check_matrices(run)


@pytest.mark.slow
@pytest.mark.parametrize("track", [0, 1])
def test_who_takes_over_from_a_lost_leader_knows_who_is_who_and_is_found(tmp_path, track):
    """The leader dies between two hand-overs, after evidence was told."""
    run = world(tmp_path, f"faults=[{{type: role-crash, role: leader {track}, at_s: 22.8}}]", "duration_s=28")
    assert run.crashes()
    check_matrices(run)
    events = told(run)
    assert any(fields["event"] == "recovered" and track in fields["tracks"] for _, fields in events)
    evidence = [(time_ns, fields) for time_ns, fields in events if fields["event"] == "evidence"]
    assert evidence[0][0] < 22.8 * S
    after = [
        (time_ns, np.array(e.probability)) for time_ns, e in run.of(Identity) if e.track == track and time_ns > 23 * S
    ]
    truth = np.argmax(evidence[-1][1]["rows"][evidence[-1][1]["group"].index(track)])
    assert after
    assert all(probability[truth] > 0.9 for _, probability in after)
