"""The air of a scenario: gains to links, link quality, the three kinds of reception, noise by node, nodes that move."""

import math
from pathlib import Path

import numpy as np
import pytest
from air_rig import air_of, nodes_of, scenario
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.errors import ScenarioError
from netsim.models.fading import RayleighFading
from netsim.models.hardware import hardware_offsets
from netsim.models.path_loss import link_gains_db
from netsim.models.reception import frame_success_probability
from netsim.reading import dump_yaml
from netsim.rng import Streams
from netsim.scenario.links import Air
from netsim.scenario.load import load
from netsim.scenario.places import positions_m

BITS = 8 * 128
GRID_KM = "{type: grid, rows: 1, columns: 10, spacing_m: 20}"
MICA2 = "[[3.7, -3.3], [-3.3, 6.0]]"
FLAT = [
    "{type: log-distance, exponent: 3, shadowing_sd_db: 4, noise_dbm: -95.4}",
    "{type: unit-disk, radius_m: 15}",
    "{type: free-space, frequency_hz: 868e6}",
    "{type: two-slope, breakpoint_loss_db: 58.5}",
    f"{{type: two-slope, hardware_covariance: {MICA2}, asymmetry_sd_db: 1, reception: prr}}",
    "{type: unit-disk, noise: {type: gaussian, sd_db: 2}, fading: {type: nakagami, m: 2}, reception: perfect}",
    "{type: free-space, fading: {type: rician, k_db: 3}}",
    "{type: log-distance, fading: {type: log-normal}, noise: {type: constant}}",
    "{type: ideal, range_m: 20}",
]


def pairs(air: Air) -> set[tuple[int, int]]:
    return {(sender, link.destination) for sender, links in air.paths.items() for link in links}


@pytest.mark.parametrize("medium", FLAT)
def test_every_medium_is_written_flat_and_read_back(tmp_path: Path, medium: str) -> None:
    loaded = scenario(tmp_path, medium)
    again = tmp_path / "again.yaml"
    again.write_text(dump_yaml(loaded.scenario))
    assert load(again).scenario.medium == loaded.scenario.medium
    air = air_of(loaded)
    assert pairs(air)
    for sender, links in air.paths.items():
        assert [link.destination for link in links] == sorted({link.destination for link in links} - {sender})


@pytest.mark.parametrize("hardware", ["null", MICA2])
def test_links_are_gains_powers_and_reception_ratios_of_the_listener(tmp_path: Path, hardware: str) -> None:
    loaded = scenario(
        tmp_path, f"{{type: log-distance, asymmetry_sd_db: 1, hardware_covariance: {hardware}}}", power=-5
    )
    nodes, medium = nodes_of(loaded), loaded.scenario.medium
    air, ids = air_of(loaded), [place.id for place in nodes_of(loaded)]
    gains = link_gains_db(positions_m(nodes), ids, medium, Streams(1))
    noise_db = medium.noise_dbm + hardware_offsets(ids, medium.hardware_covariance, Streams(1)).noise_db
    assert 10 * np.log10(air.noise.typical_mw) == pytest.approx(noise_db)
    assert pairs(air) == {(i, j) for i in ids for j in ids if i != j and -5 + gains[i, j] >= noise_db[j] - 10}
    for sender, links in air.paths.items():
        for link in links:
            power_dbm = -5 + gains[sender, link.destination]
            snr_db = power_dbm - noise_db[link.destination]
            assert link.power_mw == pytest.approx(10 ** (power_dbm / 10))
            assert link.decodable == (snr_db >= nodes[0].radio.preamble_lock_sinr_db)
            expected = frame_success_probability(10 ** (snr_db / 10), BITS)
            assert link.prr == pytest.approx(expected, rel=1e-3, abs=1e-9)  # the table's error grows with the loss
        told = {other.id: other.prr for other in air.neighbours[sender]}
        assert told == {link.destination: link.prr for link in links if link.prr >= 0.1}


def test_reception_perfect_and_prr(tmp_path: Path) -> None:
    medium = "{{type: log-distance, exponent: 3.4, reception: {}}}"
    sinr, prr, perfect = (air_of(scenario(tmp_path, medium.format(kind))) for kind in ("sinr", "prr", "perfect"))
    assert sinr.paths == prr.paths
    kept = {(sender, link.destination) for sender, links in sinr.paths.items() for link in links if link.prr >= 0.5}
    assert 0 < len(kept) < len(pairs(sinr))
    assert pairs(perfect) == kept
    assert {(link.prr, link.decodable) for links in perfect.paths.values() for link in links} == {(1.0, True)}
    assert set(perfect.table.prr) == {1.0}


def test_a_disk_reaches_its_radius_and_no_farther(tmp_path: Path) -> None:
    loaded = scenario(tmp_path, "{type: unit-disk, radius_m: 17, received_power_dbm: -70}")
    nodes = nodes_of(loaded)
    near = {(a.id, b.id) for a in nodes for b in nodes if a is not b and math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) <= 17}
    air = air_of(loaded)
    assert pairs(air) == near
    assert {round(link.power_mw * 1e7, 9) for links in air.paths.values() for link in links} == {1.0}
    assert all(link.prr == 1.0 and link.decodable for links in air.paths.values() for link in links)


def test_fading_averages_reception_ratios_and_widens_the_reach(tmp_path: Path) -> None:
    """The mean over 100,000 drawn gains, within five standard errors and what 32 points leave out."""
    steady = air_of(scenario(tmp_path, "{type: log-distance, exponent: 4.5}"))
    fading = air_of(scenario(tmp_path, "{type: log-distance, exponent: 4.5, fading: {type: rayleigh}}"))
    assert isinstance(fading.fading, RayleighFading)
    assert pairs(fading) > pairs(steady)
    gains = RayleighFading().gains(np.random.default_rng(1), 100_000)
    noise_mw = float(fading.noise.typical_mw[0])
    for sender in (0, 5):
        for link in fading.paths[sender]:
            drawn = frame_success_probability(gains * link.power_mw / noise_mw, BITS)
            assert abs(link.prr - drawn.mean()) < 5 * drawn.std() / math.sqrt(100_000) + 1 / 32
    mean_steady = {(s, link.destination): link.power_mw for s, links in steady.paths.items() for link in links}
    mean_fading = {(s, link.destination): link.power_mw for s, links in fading.paths.items() for link in links}
    assert mean_fading | mean_steady == mean_fading


def test_what_a_quiet_moment_lets_through_is_a_link(tmp_path: Path) -> None:
    steady = air_of(scenario(tmp_path, "{type: log-distance, exponent: 4}"))
    varying = air_of(scenario(tmp_path, "{type: log-distance, exponent: 4, noise: {type: gaussian, sd_db: 4}}"))
    assert pairs(varying) > pairs(steady)
    decodable = [
        {(s, x.destination) for s, links in air.paths.items() for x in links if x.decodable}
        for air in (steady, varying)
    ]
    assert decodable[1] > decodable[0]
    assert varying.neighbours == steady.neighbours


def test_links_far_below_the_noise_of_a_radio_that_decodes_them(tmp_path: Path) -> None:
    """LoRa at spreading factor 12 hears 16 dB below the noise and is disturbed still below; without shadowing, by range."""
    medium = "{type: log-distance, reference_loss_db: 90, shadowing_sd_db: 0, noise_dbm: -117.03}"
    loaded = scenario(tmp_path, medium, GRID_KM, 14.0, "radio: sx1276\n    lora: {spreading_factor: 12}")
    place, air = nodes_of(loaded)[0], air_of(loaded)
    assert place.radio.lora is not None
    threshold_db, capture_db = place.radio.lora.threshold_db, place.radio.lora.capture_db
    assert threshold_db < -15
    where = {each.id: (each.x_m, each.y_m) for each in nodes_of(loaded)}
    snr_db = {
        (a, b): 14 - 90 - 30 * math.log10(math.dist(where[a], where[b])) + 117.03
        for a in where
        for b in where
        if a != b
    }
    decodable = {(s, x.destination) for s, links in air.paths.items() for x in links if x.decodable}
    assert pairs(air) == {pair for pair, ratio in snr_db.items() if ratio >= threshold_db - capture_db}
    assert decodable == {pair for pair, ratio in snr_db.items() if ratio >= threshold_db}
    assert 0 < len(decodable) < len(pairs(air)) < len(snr_db)
    assert {x.prr for links in air.paths.values() for x in links if x.decodable} == {1.0}


MOVING = [
    f"{{type: log-distance, exponent: 3.3, asymmetry_sd_db: 1, hardware_covariance: {MICA2}}}",
    "{type: log-distance, exponent: 3.3, reception: perfect}",
    "{type: ideal, range_m: 20}",
]
somewhere = st.tuples(st.floats(0, 60), st.floats(0, 60))
journeys = st.lists(st.dictionaries(st.integers(0, 15), somewhere, min_size=1, max_size=3), min_size=1, max_size=3)


@pytest.mark.parametrize("medium", MOVING)
def test_relocated_air_is_that_of_a_fresh_start_there(tmp_path: Path, medium: str) -> None:
    loaded = scenario(tmp_path, medium)

    @settings(max_examples=25, deadline=None)
    @given(steps=journeys)
    def holds(steps: list[dict[int, tuple[float, float]]]) -> None:
        air, where = air_of(loaded), {}
        assert air.can_relocate
        for step in steps:
            where |= step
            before = {sender: list(links) for sender, links in air.paths.items()}
            changed = air.relocate(step)
            fresh = air_of(loaded, where)
            assert air.paths == fresh.paths
            assert air.neighbours == fresh.neighbours
            assert dict(changed) == {s: links for s, links in air.paths.items() if links != before[s]}

    holds()


def test_shadowing_moves_with_the_pair(tmp_path: Path) -> None:
    """Two nodes carried elsewhere together keep their link to the digit; a third one keeps its shadowing to both."""
    loaded = scenario(tmp_path, "{type: log-distance}")
    air = air_of(loaded)
    before = next(link for link in air.paths[0] if link.destination == 1)
    a, b = (nodes_of(loaded)[node] for node in (0, 1))
    air.relocate({0: (a.x_m + 32.0, a.y_m + 64.0), 1: (b.x_m + 32.0, b.y_m + 64.0)})
    assert next(link for link in air.paths[0] if link.destination == 1) == before


def test_no_move_changes_nothing(tmp_path: Path) -> None:
    air = air_of(scenario(tmp_path, "{type: log-distance}"))
    assert dict(air.relocate({})) == {}
    place = nodes_of(scenario(tmp_path, "{type: log-distance}"))[3]
    assert dict(air.relocate({3: (place.x_m, place.y_m)})) == {}


@pytest.mark.parametrize(
    ("medium", "where", "text"),
    [
        ("{type: log-distance, hardware_covariance: [[1, 2], [2, 1]]}", "medium", "positive semidefinite"),
        ("{type: log-distance, hardware_covariance: [1, 2]}", "medium.hardware_covariance", ""),
        ("{type: log-distance, noise: {type: replayed, file: n.txt}, noise_dbm: -90}", "medium", "noise.median_dbm"),
        ("{type: log-distance, fading: {type: rice}}", "medium.fading.type", "rician"),
        ("{type: unit-disc}", "medium.type", "unit-disk"),
        ("{type: trace, file: x.k7, format: k7, fading: {type: rayleigh}}", "medium", "format k7"),
        ("{type: log-distance, reception: perfekt}", "medium.reception", "perfect"),
    ],
)
def test_bad_settings_are_findings(tmp_path: Path, medium: str, where: str, text: str) -> None:
    with pytest.raises(ScenarioError) as raised:
        scenario(tmp_path, medium)
    assert f"small.yaml:11: {where}" in str(raised.value)
    assert text in str(raised.value)


def test_a_missing_noise_file_is_a_finding(tmp_path: Path) -> None:
    loaded = scenario(tmp_path, "{type: log-distance, noise: {type: replayed, file: none.txt}}")
    with pytest.raises(ScenarioError, match=r"none\.txt:1: expected a text file of noise readings"):
        air_of(loaded)
