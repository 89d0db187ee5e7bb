"""What groups of joint tracking become, and how they travel as bytes: no node, no time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_groups import cover, is_joint, joined, kept, named, parts_of, places_of
from netsim.algorithms.joint_messages import (
    Ask,
    Call,
    Held,
    Reading,
    Sighting,
    decode_ask,
    decode_call,
    decode_given,
    decode_reading,
    encode_ask,
    encode_call,
    encode_given,
    encode_reading,
    encode_taken,
    label_of,
)
from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.kernels.particles import equal_weights, uniform_disc
from netsim.protocols.regions import contains

RANGE_M = 120.0
tracks = st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=4, unique=True).map(lambda found: tuple(sorted(found)))
widths = st.sampled_from(["float64", "float32", "float16"])


def acquainted(tracks, identities, targets):
    """What is known of tracks that are sure who they are."""
    known, *others = (
        Acquaintances.alone(track, np.eye(targets)[identity], Place(2, 9))
        for track, identity in zip(tracks, identities, strict=True)
    )
    for other in others:
        known = known.merged(other)
    return known


def group(*places_m, tracks=None, identities=None, seed=1, count=50, **more):
    """A group whose targets are within 5 m of some places."""
    rng = np.random.default_rng(seed)
    tracks = tuple(range(len(places_m))) if tracks is None else tracks
    belief = uniform_disc(np.array(places_m, dtype=float), 5.0, count, rng)
    known = acquainted(tracks, range(len(places_m)) if identities is None else identities, 4)
    return Held(3, 2, tracks, belief, known, **more)


def parts(held, switch="distance", separate_m=140.0):
    parameters = JointTrackingParameters(switch=switch, separate_m=separate_m)
    return parts_of(parameters, held, RANGE_M, lambda targets: 100 * targets, np.random.default_rng(2))


@given(tracks, st.integers(0, 2**32 - 1), st.integers(0, 0xFFFF), st.integers(1, 5), st.booleans())
def test_a_call_arrives_as_it_was_sent(tracks, step, turn, targets, is_blank):
    known = acquainted(tracks, range(len(tracks)), len(tracks) + targets)
    call = Call(step, turn, tracks, np.arange(2.0 * len(tracks)).reshape(-1, 2), known, is_blank)
    there = decode_call(encode_call(call))
    assert (there.step, there.turn, there.tracks, there.is_blank) == (step, turn, tracks, is_blank)
    np.testing.assert_array_equal(there.estimates_m, call.estimates_m)
    np.testing.assert_array_equal(there.known.rows, known.rows)


@given(st.builds(Ask, *[st.integers(0, 0xFFFF)] * 3, st.integers(0, 4), st.lists(st.integers(0, 99)).map(tuple)))
def test_a_question_arrives_as_it_was_asked(ask):
    assert decode_ask(encode_ask(ask)) == ask


@given(
    st.lists(
        st.builds(Sighting, st.integers(0, 0xFFFF), st.integers(0, 0xFFFF), st.just(1.5), st.just(-2.0)), max_size=4
    )
)
def test_a_reading_arrives_as_it_was_sent(others):
    reading = Reading(7, 12.25, tuple(others))
    assert decode_reading(encode_reading(reading)) == reading


@given(tracks, st.booleans(), st.booleans(), st.integers(0, 300), st.booleans(), widths)
@settings(max_examples=30)
def test_a_group_arrives_as_it_was_given(tracks, is_parted, has_met, quiet, is_blank, width):
    places_m = np.random.default_rng(1).uniform(-600.0, 600.0, (20, len(tracks), 2))
    known = acquainted(tracks, range(len(tracks)), 4)
    known = known.met(tracks) if len(tracks) > 1 else known
    waiting = tuple((1.0, 0.5, 0.25, track / 65536) for track in tracks) if is_parted else ()
    held = Held(9, 4, tracks, equal_weights(places_m), known, is_parted, has_met, quiet, is_blank, waiting)
    there = decode_given(encode_given(held, width), width)
    assert (there.step, there.turn, there.tracks) == (9, 4, tracks)
    assert (there.is_parted, there.has_met, there.quiet) == (is_parted, has_met, min(quiet, 255))
    assert (there.is_blank, there.waiting) == (is_blank, waiting)
    np.testing.assert_array_equal(there.rows, held.rows)
    places_m = places_m[np.lexsort(places_m.reshape(20, -1).T[::-1])]
    np.testing.assert_allclose(
        there.belief.positions_m, places_m, atol={"float64": 0, "float32": 4e-5, "float16": 0.25}[width]
    )


def test_confirmations_of_different_groups_differ():
    held = group((0, 0), (9, 9))
    others = [group((0, 0)), group((0, 0), (9, 9), tracks=(0, 2))]
    assert encode_taken(held) not in [encode_taken(other) for other in others]


def test_a_group_is_named_by_all_its_tracks():
    assert (label_of((3,)), group((0, 0), (9, 9), tracks=(2, 5)).label) == ("track 3", "track 2 and track 5")


@settings(max_examples=10)
@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=1, max_size=4), st.integers(0, 10))
def test_the_cover_holds_the_disc_around_every_target(places_m, seed):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, 20)
    for place_m in places_m:
        rim_m = np.array(place_m) + 0.999 * RANGE_M * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        assert contains(cover(np.array(places_m), RANGE_M), rim_m).all()


@pytest.mark.parametrize(
    ("switch", "near", "far"), [("distance", True, False), ("never", False, False), ("always", True, True)]
)
def test_who_is_joint(switch, near, far):
    parameters, places_m = JointTrackingParameters(switch=switch), np.array([[0.0, 0.0]])
    assert is_joint(parameters, group((0, 0)), places_m, Sighting(5, 1, 0.0, 140.0)) is near
    assert is_joint(parameters, group((0, 0)), places_m, Sighting(5, 1, 0.0, 140.1)) is far


def test_latched_groups_join_where_they_collide_but_not_after_they_have_parted():
    parameters, far = JointTrackingParameters(switch="latched"), Sighting(5, 1, 0.0, 230.0)
    assert is_joint(parameters, group((0, 0)), np.zeros((1, 2)), far)
    assert not is_joint(parameters, group((0, 0), is_parted=True), np.zeros((1, 2)), far)


def test_latched_groups_part_only_after_their_targets_have_met():
    far = group((0, 0), (0, 200))
    assert [part.tracks for part in parts(far, "latched")] == [(0, 1)]
    (near,) = parts(group((0, 0), (0, 100)), "latched")
    assert near.has_met
    beyond = group((0, 0), (0, 200), has_met=True)
    assert sorted(part.tracks for part in parts(beyond, "latched")) == [(0,), (1,)]
    assert all(part.is_parted and not part.has_met for part in parts(beyond, "latched"))
    assert len(parts(group((0, 0), (0, 260)), "latched")) == 2, "the groups collide no more"


def test_joined_groups_have_their_tracks_in_order_with_their_places_and_rows():
    pair = group((0, 0), (0, 100), tracks=(1, 7), identities=(0, 1))
    both = joined(group((200, 0), tracks=(3,), identities=(3,)), pair, 60, np.random.default_rng(1))
    assert (both.tracks, both.turn, both.belief.count) == ((1, 3, 7), 3, 60)
    np.testing.assert_allclose(both.belief.estimate_m, [[0, 0], [200, 0], [0, 100]], atol=3.0)
    np.testing.assert_array_equal(both.rows, np.eye(4)[[0, 3, 1]])


@pytest.mark.parametrize("swapped", [False, True])
def test_a_pair_parts_under_the_names_that_its_calls_gave(swapped):
    held = group((200, 0), (0, 0)) if swapped else group((0, 0), (200, 0))
    for part in parts(held):
        np.testing.assert_allclose(part.belief.estimate_m[0], places_of(held)[part.tracks[0]], atol=3.0)
        np.testing.assert_allclose(part.rows.sum(axis=1), 1.0)
        np.testing.assert_allclose(part.rows, [[0.5, 0.5, 0.0, 0.0]])


def test_of_three_targets_one_leaves_and_two_stay_together():
    found = parts(group((0, 0), (0, 300), (0, 50)))
    assert sorted(part.tracks for part in found) == [(0, 2), (1,)]
    together = next(part for part in found if len(part.tracks) == 2)
    np.testing.assert_allclose(together.belief.estimate_m, [[0, 0], [0, 50]], atol=3.0)
    assert together.belief.count == 200


def test_a_symmetric_belief_names_each_logical_target_once():
    """Half of the particles hold the pair swapped: the means of the physical targets lie between the two."""
    one = np.random.default_rng(1).normal([[0, 0], [100, 0]], 2.0, (100, 2, 2))
    belief = equal_weights(np.concatenate([one, one[:, ::-1]]))
    np.testing.assert_allclose(belief.estimate_m, [[50, 0], [50, 0]], atol=1.0)
    found = sorted(named(belief).estimate_m[:, 0].tolist())
    np.testing.assert_allclose(found, [0, 100], atol=1.0)


def test_a_group_that_loses_a_track_keeps_the_marginal_of_the_others_and_no_longer_knows_who_is_who():
    held = group((0, 0), (100, 0), (0, 100), tracks=(2, 4, 6))
    left = kept(held, {2, 6, 9})
    assert left.tracks == (2, 6)
    np.testing.assert_array_equal(left.belief.positions_m, held.belief.positions_m[:, [0, 2]])
    np.testing.assert_allclose(left.rows, [[1 / 3, 1 / 3, 1 / 3, 0]] * 2)
    assert kept(held, {9}) is None
    assert kept(held, held.tracks) is held


def test_what_is_kept_of_a_pair_that_may_be_swapped_is_compact():
    """Eq 6, not eq 5: half of the particles hold the pair the other way round."""
    one = np.random.default_rng(1).normal([[0, 0], [100, 0]], 2.0, (100, 2, 2))
    held = replace(group((0, 0), (100, 0)), belief=equal_weights(np.concatenate([one, one[:60, ::-1], one[:30]])))
    for index, track in enumerate(held.tracks):
        left = kept(held, {track})
        np.testing.assert_allclose(left.belief.estimate_m[0], places_of(held)[index])
        assert np.sqrt(left.belief.covariance_m2(0).trace()) < 4.0
