"""Replayed delivery: rows into rounds, which round holds when, and the Grenoble ratios inside binomial intervals."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from netsim.models.delivery import ReplayedRatios, rounds_of
from netsim.models.k7 import K7, read_k7
from netsim.units import s_to_ns

# time, source, destination, channel, RSSI, ratio; node 1's rounds start at 0, 100 and 200 s, node 2's at 50 s.
ROWS = [
    (0.0, 1, 3, 11, -70.0, 1.0),
    (1.0, 1, 2, 11, -80.0, 0.5),
    (50.0, 2, 1, 11, -81.0, 0.4),
    (60.0, 1, 2, 12, -60.0, 0.9),
    (103.0, 1, 3, 11, -74.0, 0.8),
    (100.0, 1, 4, 11, -90.0, 0.1),
    (200.0, 1, 2, 11, -84.0, 0.25),
    (215.0, 1, 2, 11, -84.0, 0.75),
]


def recording(rows: list[tuple[float, int, int, int, float, float]] = ROWS) -> K7:
    time, source, destination, channel, rssi, pdr = (np.array(column) for column in zip(*rows, strict=True))
    return K7({}, time, source, destination, channel, rssi, pdr, np.full(len(rows), 100), 300.0, 10.0)


def test_rows_become_rounds() -> None:
    """A row within two round lengths belongs to the round, unless its listener is in it already."""
    rounds = rounds_of(recording(), 11, [1, 2, 3, 4])
    assert sorted(rounds) == [1, 2]
    one = rounds[1]
    assert one.listeners.tolist() == [2, 3, 4]
    assert one.start_s.tolist() == [0.0, 100.0, 200.0, 215.0]
    assert one.ratio.tolist() == [[0.5, 1.0, 0.0], [0.0, 0.8, 0.1], [0.25, 0.0, 0.0], [0.75, 0.0, 0.0]]
    assert one.rssi_dbm == pytest.approx([-(80 + 84 + 84) / 3, -72.0, -90.0])


def test_only_known_nodes_and_the_channel_count() -> None:
    assert rounds_of(recording(), 11, [1, 3])[1].listeners.tolist() == [3]
    assert sorted(rounds_of(recording(), 12, [1, 2])) == [1]
    assert rounds_of(recording(), 13, [1, 2]) == {}


@pytest.mark.parametrize(
    ("settings", "time_s", "expected"),
    [
        ({}, 0.0, [0.5, 1.0, 0.0]),
        ({}, 99.999, [0.5, 1.0, 0.0]),
        ({}, 100.0, [0.0, 0.8, 0.1]),
        ({}, 1e6, [0.75, 0.0, 0.0]),
        ({"start_s": 190.0}, 9.0, [0.0, 0.8, 0.1]),
        ({"start_s": 190.0}, 10.0, [0.25, 0.0, 0.0]),
        ({"speed": 60.0}, 2.0, [0.0, 0.8, 0.1]),
        ({"loop_s": 300.0}, 301.0, [0.5, 1.0, 0.0]),
        ({"loop_s": 300.0, "start_s": 290.0, "speed": 2.0}, 56.0, [0.0, 0.8, 0.1]),
    ],
)
def test_a_round_holds_until_the_next(settings: dict[str, float], time_s: float, expected: list[float]) -> None:
    delivery = ReplayedRatios(rounds_of(recording(), 11, [1, 2, 3, 4]), **settings)
    assert delivery.ratios(1, s_to_ns(time_s)).tolist() == expected


def test_before_its_first_round_a_sender_s_first_round_holds() -> None:
    delivery = ReplayedRatios(rounds_of(recording(), 11, [1, 2, 3, 4]))
    assert delivery.ratios(2, 0).tolist() == [0.4]
    assert delivery.ratios(3, 0).tolist() == []


@pytest.fixture(scope="module")
def grenoble(measured_data: Path) -> K7:
    return read_k7(measured_data / "grenoble.k7.gz")


def test_every_measurement_is_replayed_at_its_time(grenoble: K7) -> None:
    """All rows of all channels: the ratio at the row's time (and until the round is over) is the row's."""
    for channel in (11, 20, 26):
        rounds = rounds_of(grenoble, channel, range(50))
        delivery, rows = ReplayedRatios(rounds), np.flatnonzero(grenoble.channel == channel)
        assert sum(np.count_nonzero(each.ratio) for each in rounds.values()) == len(rows)
        assert {len(each.start_s) for each in rounds.values()} == {19}
        for row in rows.tolist():
            source = int(grenoble.source[row])
            place = np.searchsorted(rounds[source].listeners, grenoble.destination[row])
            for later_s in (0.0, 9.0, 600.0):
                at_ns = s_to_ns(grenoble.time_s[row] + later_s)
                assert delivery.ratios(source, at_ns)[place] == grenoble.pdr[row]


def test_a_link_without_a_row_in_a_round_delivers_nothing_then(grenoble: K7) -> None:
    rounds = rounds_of(grenoble, 11, range(50))
    silent = [(source, each, np.argwhere(each.ratio == 0.0)) for source, each in rounds.items()]
    source, each, where = next(found for found in silent if len(found[2]))
    number, column = where[0].tolist()
    present = (grenoble.source == source) & (grenoble.destination == each.listeners[column]) & (grenoble.channel == 11)
    near = np.abs(grenoble.time_s[present] - each.start_s[number]) <= 20.0
    assert not near.any()
    assert ReplayedRatios(rounds).ratios(source, s_to_ns(each.start_s[number]))[column] == 0.0


def test_frames_drawn_at_the_ratios_lie_in_binomial_intervals_of_the_measured_ones(grenoble: K7) -> None:
    """Twenty links of every quality, 400 frames each over ten minutes: each count inside the 99.95 % interval of its ratio.

    (1 - 0.9995) * 20 is 1 %: the whole test is one at 99 %.
    """
    delivery, rng = ReplayedRatios(rounds_of(grenoble, 15, range(50))), np.random.default_rng(11)
    rows = np.flatnonzero((grenoble.channel == 15) & (grenoble.pdr < 1.0))
    rows = rows[np.argsort(grenoble.pdr[rows], kind="stable")][np.linspace(0, len(rows) - 1, 20).astype(int)]
    assert grenoble.pdr[rows[0]] < 0.05
    for row in rows.tolist():
        source, start_s = int(grenoble.source[row]), float(grenoble.time_s[row])
        place = np.searchsorted(delivery.rounds[source].listeners, grenoble.destination[row])
        chances = [delivery.ratios(source, s_to_ns(start_s + 1.5 * frame))[place] for frame in range(400)]
        arrived = int(np.count_nonzero(rng.random(400) < chances))
        assert binomtest(arrived, 400, float(grenoble.pdr[row])).pvalue > 1 - 0.9995
