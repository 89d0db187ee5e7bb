"""Identity matrices: sums after any history, Bayes where it is exact, and groups that touch nobody else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.kernels.fitting import fitted
from netsim.kernels.identity import (
    EVEN_PAIR,
    even,
    evidence,
    evidence_operations,
    exact_start,
    mix,
    mix_by,
    posterior,
    unmixed,
)

SEEDS = st.integers(0, 2**32 - 1)
PROBABILITIES = st.sampled_from([0.0, 0.03, 0.3, 0.5, 0.97, 1.0])


@st.composite
def meetings(draw, targets: int):
    rows = draw(st.lists(st.integers(0, targets - 1), min_size=2, max_size=min(3, targets), unique=True))
    return "mix", tuple(rows), draw(PROBABILITIES) * even(len(rows)) if len(rows) > 2 else draw(PROBABILITIES)


@st.composite
def learned(draw, targets: int, levels=(0.0, 1e-6, 0.06, 0.5, 0.94)):
    likelihood = draw(st.lists(st.sampled_from(levels), min_size=targets, max_size=targets))
    return "evidence", draw(st.integers(0, targets - 1)), np.array(likelihood)


def histories(targets: int, **evidence_levels):
    return st.lists(st.one_of(meetings(targets), learned(targets, **evidence_levels)), max_size=25)


def fits(identities: np.ndarray, row: int, likelihood: np.ndarray) -> bool:
    """Whether evidence agrees with what is known by a wide margin over rounding."""
    return bool(identities[row] @ likelihood > 1e-6 * likelihood.max())


def after(targets: int, history, group_of=lambda identities, row: None) -> np.ndarray:
    """The matrix after a history; evidence that contradicts what is known is left out."""
    identities = unmixed(targets)
    for kind, who, what in history:
        if kind == "mix":
            identities = mix(identities, who, what)
        elif fits(identities, who, what):
            identities = evidence(identities, who, what, group_of(identities, who))
    return identities


def mixed_with(identities: np.ndarray, row: int) -> list[int]:
    """The rows that share an identity with a row, or with one that does, and so on."""
    group, columns = {row}, identities[row] > 0.0
    while True:
        more = {int(other) for other in np.flatnonzero((identities[:, columns] > 0.0).any(axis=1))} | group
        if more == group:
            return sorted(group)
        group, columns = more, (identities[sorted(more)] > 0.0).any(axis=0)


def assert_sums(identities: np.ndarray, tolerance: float = 1e-9) -> None:
    assert (identities >= 0.0).all()
    np.testing.assert_allclose(identities.sum(axis=0), 1.0, atol=tolerance)
    np.testing.assert_allclose(identities.sum(axis=1), 1.0, atol=tolerance)


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 6).flatmap(lambda m: st.tuples(st.just(m), histories(m))))
def test_rows_and_columns_sum_to_one_after_any_history(case):
    targets, history = case
    assert_sums(after(targets, history))
    assert_sums(after(targets, history, mixed_with))


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 5).flatmap(lambda m: st.tuples(st.just(m), histories(m, levels=(1e-3, 0.06, 0.94)))), SEEDS)
def test_sums_stay_though_members_are_missing(case, seed):
    targets, history = case
    rng = np.random.default_rng(seed)
    found = after(
        targets, history, lambda _, row: sorted({row, *rng.choice(targets, targets - 1, replace=False).tolist()})
    )
    assert_sums(found)


@settings(max_examples=60, deadline=None)
@given(histories(2))
def test_of_two_targets_it_is_exact(history):
    identities, exact = unmixed(2), exact_start(2)
    for kind, who, what in history:
        if kind == "mix":
            identities, exact = mix(identities, who, what), exact.mix(who, what)
        elif fits(identities, who, what):
            identities, exact = evidence(identities, who, what), exact.evidence(who, what)
    np.testing.assert_allclose(identities, exact.marginals(), atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.lists(meetings(5), max_size=12))
def test_without_evidence_it_is_exact_for_any_number(history):
    exact = exact_start(5)
    for _, rows, p in history:
        exact = exact.mix(rows, p)
    np.testing.assert_allclose(after(5, history), exact.marginals(), atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(histories(5), st.integers(0, 4), st.lists(st.sampled_from([0.06, 0.5, 0.94]), min_size=5, max_size=5))
def test_the_row_keeps_its_posterior_and_others_stay_to_the_last_bit(history, row, likelihood):
    before = after(5, history, mixed_with)
    group = mixed_with(before, row)
    found = evidence(before, row, likelihood, group)
    bayes = before[row] * likelihood
    np.testing.assert_array_equal(found[row], bayes / bayes.sum())
    outside = [other for other in range(5) if other not in group]
    np.testing.assert_array_equal(found[outside], before[outside])
    alone = evidence(before[group], group.index(row), likelihood)
    np.testing.assert_allclose(alone, found[group], atol=1e-12)


def test_the_papers_crossing_and_its_evidence():
    crossed = mix(unmixed(2), (0, 1), EVEN_PAIR)
    np.testing.assert_allclose(crossed, np.full((2, 2), 0.5))
    found = evidence(crossed, 0, (0.94, 0.06))
    np.testing.assert_allclose(found, [[0.94, 0.06], [0.06, 0.94]], atol=1e-12)


def test_three_in_a_chain_by_hand():
    met = mix(mix(unmixed(4), (0, 1), 0.5), (1, 2), 0.5)
    np.testing.assert_allclose(met[:3, :3], [[0.5, 0.5, 0.0], [0.25, 0.25, 0.5], [0.25, 0.25, 0.5]])
    found = evidence(
        met, 1, (1.0, 0.0, 0.0, 0.0), (0, 1, 2)
    )  # track 1 is target 0: track 0 must be 1, and track 2 be 2
    np.testing.assert_allclose(found, np.eye(4)[[1, 0, 2, 3]], atol=1e-9)


def test_entries_that_must_vanish_leave_the_sums_whole():
    cyclic = 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))
    np.testing.assert_allclose(evidence(cyclic, 0, (1.0, 0.0, 0.0)), np.eye(3), atol=1e-9)


def test_a_row_gives_way_where_members_are_missing():
    third = np.full((3, 3), 1.0 / 3.0)
    found = evidence(third, 0, (0.98, 0.01, 0.01), (0, 1))
    assert_sums(found)
    np.testing.assert_array_equal(found[2], third[2])
    assert 0.5 < found[0, 0] < 2.0 / 3.0  # the two hold 2/3 of the first identity
    np.testing.assert_array_equal(evidence(third, 0, (0.98, 0.01, 0.01), (0,)), third)


def test_what_cannot_be_is_refused():
    crossed = mix(unmixed(3), (0, 1), 0.5)
    with pytest.raises(ValueError, match="contradicts"):
        evidence(crossed, 0, (0.0, 0.0, 1.0))
    with pytest.raises(ValueError, match="contradicts"):
        evidence(crossed, 0, (0.0, 1e-10, 1.0))
    with pytest.raises(ValueError, match="contradicts"):
        exact_start(3).evidence(1, (1.0, 0.0, 1.0))
    for wrong in ((-0.1, 1.0, 1.0), (np.nan, 1.0, 1.0), (np.inf, 0.0, 0.0)):
        with pytest.raises(ValueError, match="at least 0"):
            evidence(crossed, 0, wrong)
    for rows, p in (((0,), 0.5), ((1, 1), 0.5), ((0, 1), 1.1), ((0, 1), -0.1)):
        with pytest.raises(ValueError, match="expected"):
            mix(crossed, rows, p)
    with pytest.raises(ValueError, match=r"at most 0\.666667"):
        exact_start(3).mix((0, 1, 2), 0.9)
    with pytest.raises(ValueError, match="1 to 8"):
        exact_start(9)


def test_evidence_that_leaves_a_group_no_way_is_refused():
    cyclic = 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))  # rows (.5 .5 0), (0 .5 .5), (.5 0 .5)
    with pytest.raises(ValueError, match="no way"):
        evidence(cyclic, 0, (1.0, 0.0, 0.0), (0, 1))


def test_given_shares_mix_as_they_say():
    shares = np.array([[0.7, 0.3, 0.0], [0.1, 0.6, 0.3], [0.2, 0.1, 0.7]])
    np.testing.assert_allclose(mix_by(unmixed(4), (3, 0, 2), shares)[np.ix_((3, 0, 2), (3, 0, 2))], shares)
    np.testing.assert_allclose(mix(unmixed(3), (0, 1, 2), even(3)), 1.0 / 3.0)


def test_the_exact_posterior_by_hand():
    """Tracks 0 and 1 met, then 1 and 2; evidence for target 0 with .8 on track 1, then .9 for target 2 on track 0."""
    exact = exact_start(3).mix((0, 1), 0.5).mix((1, 2), 0.5)
    weight = dict.fromkeys([(0, 1, 2), (1, 0, 2), (0, 2, 1), (1, 2, 0)], 0.25)
    weight = {who: w * (0.8 if who[1] == 0 else 0.2) for who, w in weight.items()}
    total = sum(weight.values())
    found = exact.evidence(1, (0.8, 0.2, 0.2))
    for who, w in weight.items():
        assert found.probability[np.all(found.assignments == who, axis=1)] == pytest.approx(w / total)
    assert found.marginals()[0, 1] == pytest.approx((0.8 + 0.2) / (0.8 + 3 * 0.2))


@settings(max_examples=20, deadline=None)
@given(histories(4, levels=(0.06, 0.94)), SEEDS)
def test_evidence_commutes_in_the_exact_posterior(history, seed):
    rng = np.random.default_rng(seed)
    exact = exact_start(4)
    for kind, who, what in history:
        exact = exact.mix(who, what) if kind == "mix" else exact.evidence(who, what)
    first, second = rng.uniform(0.1, 1.0, (2, 4))
    a = exact.evidence(0, first).evidence(2, second)
    b = exact.evidence(2, second).evidence(0, first)
    np.testing.assert_allclose(a.probability, b.probability, atol=1e-12)
    assert a.probability.sum() == pytest.approx(1.0, abs=1e-12)


def test_a_very_long_history_keeps_its_sums():
    rng = np.random.default_rng(3)
    identities = unmixed(5)
    for _ in range(600):
        if rng.random() < 0.5:
            identities = mix(identities, rng.choice(5, 2, replace=False).tolist(), 0.5)
        else:
            identities = evidence(identities, int(rng.integers(5)), rng.choice([0.05, 0.5, 0.95], 5))
    assert_sums(identities)


def all_scaled(identities: np.ndarray, row: int, likelihood: np.ndarray) -> np.ndarray:
    """Plain Sinkhorn scaling, in which the row of the evidence takes part."""
    updated = identities.copy()
    updated[row] = posterior(identities[row], likelihood)
    return fitted(updated, np.ones(len(updated)), np.ones(len(updated)))


@pytest.mark.slow
@pytest.mark.parametrize("targets", [3, 4, 5, 6])
def test_keeping_the_row_comes_nearer_to_the_exact_posterior_than_scaling_all(targets):
    errors = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        kept, scaled, exact = unmixed(targets), unmixed(targets), exact_start(targets)
        for _ in range(30):
            if rng.random() < 0.5:
                pair = rng.choice(targets, 2, replace=False).tolist()
                kept, scaled, exact = mix(kept, pair, 0.5), mix(scaled, pair, 0.5), exact.mix(pair, 0.5)
            else:
                row = int(rng.integers(targets))
                likelihood = np.full(targets, 0.06 / (targets - 1))
                likelihood[rng.choice(targets, p=exact.marginals()[row])] = 0.94
                kept, scaled = evidence(kept, row, likelihood), all_scaled(scaled, row, likelihood)
                exact = exact.evidence(row, likelihood)
            errors.append([np.abs(found - exact.marginals()).mean() for found in (kept, scaled)])
    kept_error, scaled_error = np.mean(errors, axis=0)
    assert kept_error < 0.5 * scaled_error
    assert kept_error < 0.02


def test_work_grows_with_the_group():
    assert evidence_operations(4, 6) > evidence_operations(2, 6) > 12
