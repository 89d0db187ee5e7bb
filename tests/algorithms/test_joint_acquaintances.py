"""Copies of an acquaintance group: matrices whatever gets lost, alike once all is known, and exact for two tracks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.algorithms.joint_acquaintances import Acquaintances
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_identity_messages import (
    Word,
    decode_acquaintances,
    decode_word,
    encode_acquaintances,
    encode_word,
)
from netsim.errors import AlgorithmError

TOLERANCE = 1e-9


def alone(track, identities):
    return Acquaintances.alone(track, np.eye(identities)[track], Place(0, track))


def together(*copies):
    known, *others = copies
    for other in others:
        known = known.merged(other)
    return known


def group(identities):
    return together(*(alone(track, identities) for track in range(identities)))


def check_sums(known):
    """Rows sum to one, and so do the columns of as many identities as there are tracks."""
    np.testing.assert_allclose(known.rows.sum(axis=1), 1.0, atol=TOLERANCE)
    columns = known.rows.sum(axis=0)
    np.testing.assert_allclose(columns, np.rint(columns), atol=TOLERANCE)
    assert np.rint(columns).sum() == len(known.tracks)
    assert columns.max() < 1.5


def test_one_crossing_and_evidence_of_94_percent():
    """Liu et al. 2004, section 6: (.94, .06) and (.06, .94)."""
    met = together(alone(0, 2), alone(1, 2)).met((0, 1))
    np.testing.assert_array_equal(met.rows, 0.5)
    clear = met.learned(1, [0.94, 0.06])
    np.testing.assert_allclose(clear.rows, [[0.06, 0.94], [0.94, 0.06]], atol=1e-7)


def test_who_has_met_nobody_keeps_the_identity_bit_for_bit():
    known = group(3).met((0, 1)).learned(0, [0.9, 0.1, 0.5])
    np.testing.assert_array_equal(known.row(2), [0.0, 0.0, 1.0])


def test_evidence_that_contradicts_all_that_is_possible_is_refused():
    known = together(alone(0, 3), alone(1, 3)).met((0, 1))
    with pytest.raises(ValueError, match="contradicts"):
        known.learned(0, [0.0, 0.0, 1.0])


def test_evidence_at_once_that_cannot_both_be_is_refused_by_all_alike():
    met = together(alone(0, 2), alone(1, 2)).met((0, 1))
    one, other = met.learned(0, [1.0, 0.0]), met.learned(1, [1.0, 0.0])
    for known in (one.merged(other), other.merged(one)):
        assert len(known.refused) == 1
        np.testing.assert_allclose(known.rows, np.eye(2))  # of two authors at once the lower node is first


def test_tracks_that_are_all_there_are_begin_a_new_era_when_they_meet():
    known = together(alone(0, 2), alone(1, 2)).met((0, 1)).learned(0, [0.9, 0.1])
    again = known.met((0, 1))
    assert again.changes == ()
    assert again.merged(known).state == known.merged(again).state == again.state
    assert again.knows(known)
    assert not known.knows(again)


def test_hearsay_gives_way_to_what_is_known_exactly():
    exact = together(alone(0, 2), alone(1, 2)).met((0, 1)).learned(0, [0.9, 0.1])
    hearsay = exact.hearsay().recovered()
    np.testing.assert_allclose(hearsay.rows, exact.rows, atol=1e-7)
    check_sums(hearsay)
    later = exact.learned(1, [0.2, 0.8])
    assert later.merged(hearsay).state == hearsay.merged(later).state == later.state
    went_on = hearsay.learned(1, [0.2, 0.8])
    np.testing.assert_allclose(went_on.merged(exact).rows, later.rows, atol=1e-12)


def test_copies_that_contradict_each_other_are_reconciled():
    """Two nodes have led track 0, and each has let it meet another track."""
    one = together(alone(0, 3), alone(1, 3)).met((0, 1))
    other = together(alone(0, 3), alone(2, 3)).met((0, 2))
    assert one.merged(other) is None
    check_sums(one.reconciled(other))
    check_sums(other.reconciled(one))


def test_tracks_whose_identity_is_open_learn_each_for_itself():
    """Nobody knows that they are all there are: what one is tells nothing of the other."""
    one, other = (Acquaintances.alone(track, np.full(3, 1 / 3), Place(0, 4)) for track in (70_000, 70_001))
    learned = one.learned(70_000, [0.94, 0.03, 0.03])
    np.testing.assert_allclose(learned.rows, [[0.94, 0.03, 0.03]], atol=1e-7)
    both = learned.merged(other)
    np.testing.assert_allclose(both.rows, [[0.94, 0.03, 0.03], [1 / 3, 1 / 3, 1 / 3]], atol=1e-7)
    met = both.met((70_000, 70_001))
    np.testing.assert_allclose(met.rows.sum(axis=1), 1.0, atol=TOLERANCE)
    np.testing.assert_array_equal(met.rows[0], met.rows[1])
    again, _ = decode_acquaintances(encode_acquaintances(met))
    np.testing.assert_array_equal(again.rows, met.rows)
    np.testing.assert_allclose(met.hearsay().recovered().rows, met.rows, atol=1e-7)


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["meet", "evidence", "tell"]),
        st.integers(0, 4),
        st.integers(0, 4),
        st.lists(st.floats(0.01, 1.0), min_size=5, max_size=5),
    ),
    max_size=30,
)


def run_through(targets, steps):
    """Each track has a leader with a copy of its own; words that are not in `steps` are lost."""
    copies = [alone(track, targets) for track in range(targets)]
    for what, a, b, likelihood in steps:
        one, other = a % targets, b % targets
        if what == "evidence":
            try:
                copies[one] = copies[one].learned(one, likelihood[:targets])
            except ValueError:
                continue
        elif one != other:
            both = copies[one].merged(copies[other])
            copies[one] = both.met((one, other)) if what == "meet" else both
            if what == "meet":
                copies[other] = copies[one]
        for known in copies:
            check_sums(known)
    return copies


@settings(max_examples=60, deadline=None)
@given(targets=st.integers(2, 5), steps=STEPS, order=st.randoms(use_true_random=False))
def test_every_copy_is_a_matrix_and_all_agree_when_all_is_told(targets, steps, order):
    copies = run_through(targets, steps)
    rows = []
    for _ in range(2):
        order.shuffle(copies)
        known = together(*copies)
        check_sums(known)
        rows.append(known)
    assert rows[0].state == rows[1].state
    np.testing.assert_array_equal(rows[0].rows, rows[1].rows)


@settings(max_examples=40, deadline=None)
@given(targets=st.integers(2, 5), steps=STEPS)
def test_bytes_keep_every_bit(targets, steps):
    for known in run_through(targets, steps):
        data = encode_acquaintances(known)
        again, end = decode_acquaintances(b"xyz" + data, 3)
        assert end == len(data) + 3
        assert (again.state, again.places, again.changes) == (known.state, known.places, known.changes)
        np.testing.assert_array_equal(again.rows, known.rows)
        hearsay = known.hearsay()
        told, _ = decode_acquaintances(encode_acquaintances(hearsay, "float32"), 0, "float32")
        np.testing.assert_array_equal(told.start, hearsay.start)
        assert told.state == hearsay.state
        check_sums(told.recovered())


def test_shares_of_particles_survive_the_air():
    shares = np.array([[0.75, 0.25], [0.25, 0.75]])
    known = group(3).met((0, 1), shares)
    np.testing.assert_array_equal(known.rows[:2, :2], shares)
    word = decode_word(encode_word(Word(7, 3, 1, 2, known)))
    assert (word.number, word.origin, word.track, word.passed) == (7, 3, 1, 2)
    np.testing.assert_array_equal(word.known.rows, known.rows)


def test_a_broken_word_is_told():
    data = encode_word(Word(7, 3, 1, 2, group(3)))
    with pytest.raises(AlgorithmError, match="a word of 9 bytes"):
        decode_word(data[:9])
