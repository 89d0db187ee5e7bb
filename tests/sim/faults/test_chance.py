"""Chance of faults: equal whoever asks, and distributed as it says."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.rng import Streams
from netsim.sim.faults.chance import KeyedUniforms, Means, TwoStates

S = 1_000_000_000


def chain(seed=1, good_s=2.0, bad_s=0.5):
    return TwoStates(Streams(seed).generator("link"), Means(good_s, bad_s))


def flip_times(process, until_ns):
    """Every change, by asking for the next one again and again."""
    times, now_ns = [], 0
    while (now_ns := process.next_change_ns(now_ns)) < until_ns:
        times.append(now_ns)
    return times


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 400 * S), max_size=50), st.integers(1, 5))
def test_states_depend_on_time_alone_not_on_who_asked_before(times, seed):
    flips = flip_times(chain(seed), 400 * S)
    starts_bad = chain(seed).is_bad(0)
    asked = chain(seed)
    for time_ns in sorted(times):
        changes = sum(flip <= time_ns for flip in flips)
        assert asked.is_bad(time_ns) == (starts_bad ^ bool(changes % 2))


def test_a_change_happens_at_its_instant():
    flips = flip_times(chain(), 200 * S)
    assert len(flips) > 100  # more than one block of draws
    assert flips == sorted(set(flips))
    process = chain()
    state = process.is_bad(0)
    for flip in flips:
        assert process.is_bad(flip - 1) == state
        assert process.is_bad(flip) != state
        state = not state


def test_mean_times_and_equilibrium():
    """1,000 sojourns each: the mean has a standard error of 3.2 %; 4 of them are allowed."""
    process = chain(seed=7)
    bad = process.is_bad(0)
    flips = flip_times(process, 2600 * S)
    gaps_s = np.diff(np.array(flips) / S)
    first = gaps_s[0::2] if bad else gaps_s[1::2]  # after the first change it is in the other state
    good_s, bad_s = first, (gaps_s[1::2] if bad else gaps_s[0::2])
    for gaps, mean_s in ((good_s, 2.0), (bad_s, 0.5)):
        assert abs(gaps.mean() - mean_s) < 4 * mean_s / math.sqrt(len(gaps))
    starts = [chain(seed).is_bad(0) for seed in range(2000)]
    assert abs(np.mean(starts) - 0.2) < 4 * math.sqrt(0.2 * 0.8 / 2000)


def test_keyed_uniforms_are_uniform_and_differ_by_every_key():
    uniforms, others = KeyedUniforms(Streams(1), "a"), KeyedUniforms(Streams(1), "b")
    numbers = np.array([uniforms.of(1, 2, time_ns) for time_ns in range(20_000)])
    counts = np.histogram(numbers, 20, (0, 1))[0]
    assert ((counts - 1000) ** 2 / 1000).sum() < 43.8  # chi-square, 19 degrees of freedom, 99.9 %
    assert uniforms.of(1, 2, 3) == uniforms.of(1, 2, 3)
    assert len({uniforms.of(1, 2, 3), uniforms.of(2, 1, 3), uniforms.of(1, 2, 4), others.of(1, 2, 3)}) == 4
    times_s = [uniforms.exponential_ns(0.25, n) / S for n in range(10_000)]
    assert abs(np.mean(times_s) - 0.25) < 4 * 0.25 / 100
