"""Particles on the air: nothing of a belief is lost, and nothing is sent twice."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.algorithms.joint_particles import decode_particles, encode_particles
from netsim.codec import decode_floats, encode_floats, size_byte
from netsim.errors import ScenarioError
from netsim.scenario.load import load

widths = st.sampled_from(["float64", "float32", "float16"])


@st.composite
def particles(draw):
    """Copies of a few places in any order, shape (P, M, 2)."""
    targets, distinct = draw(st.integers(1, 3)), draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    places_m = rng.choice([-500.0, -0.0, 0.0, 0.1, 333.3], (distinct, targets, 2))
    return places_m[rng.integers(distinct, size=draw(st.integers(1, 60)))]


def sent(positions_m, width):
    """What is left of coordinates at the precision that they are sent in, sorted."""
    rounded_m = decode_floats(encode_floats(positions_m, width), width)
    return sorted(map(tuple, rounded_m.reshape(len(positions_m), -1).tolist()))


@given(particles(), widths)
def test_the_same_particles_arrive_as_often(positions_m, width):
    there_m = decode_particles(*encode_particles(positions_m, width), positions_m.shape[1], width)
    assert list(map(tuple, there_m.reshape(len(there_m), -1).tolist())) == sent(positions_m, width)


@given(particles(), widths, st.randoms())
def test_their_order_does_not_tell(positions_m, width, random):
    shuffled_m = np.array(random.sample(positions_m.tolist(), len(positions_m)))
    assert encode_particles(shuffled_m, width) == encode_particles(positions_m, width)


@given(particles(), widths)
def test_what_arrives_is_sent_on_unchanged(positions_m, width):
    first = encode_particles(positions_m, width)
    there_m = decode_particles(*first, positions_m.shape[1], width)
    assert encode_particles(there_m, width) == first


@given(particles(), widths)
def test_they_never_take_more_than_one_by_one(positions_m, width):
    assert len(encode_particles(positions_m, width)[0]) <= size_byte(positions_m.size, width)


@pytest.mark.parametrize(("copies", "expected_byte"), [(1, 8), (200, 8 + 2), (70_000, 8 + 6)])
def test_copies_of_one_joint_particle_take_its_bytes_and_a_count(copies, expected_byte):
    positions_m = np.tile([[[1.0, 2.0], [3.0, 4.0]]], (copies, 1, 1))
    payload, named, has_counts = encode_particles(positions_m, "float16")
    assert (len(payload), named, has_counts) == (expected_byte, 1, copies > 1)
    np.testing.assert_array_equal(decode_particles(payload, named, has_counts, 2, "float16"), positions_m)


def test_particles_that_all_differ_go_without_counts():
    positions_m = np.arange(40.0).reshape(10, 2, 2)
    payload, named, has_counts = encode_particles(positions_m, "float32")
    assert (len(payload), named, has_counts) == (160, 10, False)


def test_more_particles_than_a_belief_can_name_are_refused(scenarios):
    with pytest.raises(ScenarioError, match="joint_particles"):
        load(scenarios / "liu2004" / "crossing.yaml", ["algorithm.joint_particles=65536"])
