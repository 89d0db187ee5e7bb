"""Where targets are, told at readings and when they come and go."""

from netsim.models.tracks import Track
from netsim.problems.target_truth import later_targets, targets_at

S = 1_000_000_000


def test_targets_are_told_at_readings_and_at_their_coming_and_going():
    """The second is there from 1.5 s to 3 s; at the nanosecond after that it is gone."""
    tracks = (Track((0, 4 * S), ((0.0, 0.0), (40.0, 0.0))), Track((3 * S // 2, 3 * S), ((5.0, 5.0), (5.0, 8.0))))
    told = [(time_ns, event.target) for time_ns, event in later_targets(tracks, 2.0, 4 * S)]
    both = [0, 1]
    assert told == [(3 * S // 2, both), (2 * S, both), (3 * S, both), (3 * S + 1, [0]), (4 * S, [0])]
    there = targets_at(tracks, 2 * S)
    assert (there.x_m, there.y_m) == ([20.0, 5.0], [0.0, 6.0])
