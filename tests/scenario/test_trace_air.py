"""The `trace` medium: links of gain files and of recordings, what does not fit the scenario, and files that go along."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from air_rig import air_of, scenario

from netsim.errors import ScenarioError
from netsim.models.k7 import read_k7
from netsim.models.noise import GaussianNoise, ReplayedNoise
from netsim.models.reception import frame_success_probability
from netsim.scenario.inputs import Gathering
from netsim.scenario.links import Air
from netsim.units import s_to_ns

TWO = "{type: grid, rows: 1, columns: 2, spacing_m: 10}"
GAINS = "gain 0 1 -60\ngain 1 0 -95\ngain 0 5 -50\nnoise 0 -98 2\nnoise 1 -104 4\n"
RECORDING = """\
{"tx_length": 100, "interframe_duration": 100, "start_date": "2018-01-11T16:00:00", "stop_date": "2018-01-11T17:00:00"}
datetime,src,dst,channel,mean_rssi,pdr,tx_count
2018-01-11T16:00:00.0,0,1,11,-70,0.9,100
2018-01-11T16:00:00.0,0,5,11,-80,0.5,100
2018-01-11T16:00:20.0,1,0,11,-71,0.05,100
2018-01-11T16:30:00.0,0,1,11,-74,0.3,100
2018-01-11T16:30:00.0,0,1,26,-60,1.0,100
"""


def trace_air(folder: Path, medium: str, placement: str = TWO, power: float = 0.0) -> Air:
    (folder / "gains.txt").write_text(GAINS)
    (folder / "links.k7").write_text(RECORDING)
    return air_of(scenario(folder, medium, placement, power))


def refusal(folder: Path, medium: str, placement: str = TWO, power: float = 0.0) -> str:
    with pytest.raises(ScenarioError) as raised:
        trace_air(folder, medium, placement, power)
    return str(raised.value)


def test_gains_are_links_and_noise_is_each_node_s(tmp_path: Path) -> None:
    air = trace_air(tmp_path, "{type: trace, file: gains.txt, format: tossim}", power=-3)
    assert isinstance(air.noise, GaussianNoise)
    assert (air.noise.level_dbm.tolist(), air.noise.sd_db.tolist()) == ([-98.0, -104.0], [2.0, 4.0])
    assert air.noise.step_ns == 1_000_000
    assert {
        (s, x.destination): round(10 * np.log10(x.power_mw), 9) for s, links in air.paths.items() for x in links
    } == {
        (0, 1): -63.0,
        (1, 0): -98.0,
    }
    assert air.paths[0][0].prr == pytest.approx(1.0)
    assert air.paths[1][0].prr == pytest.approx(frame_success_probability(1.0, 8 * 128), rel=1e-4)
    assert air.delivery is None
    assert not air.can_relocate
    with pytest.raises(ScenarioError, match="cannot move"):
        air.relocate({0: (1.0, 1.0)})


def test_noise_of_one_s_own_over_a_gain_file(tmp_path: Path) -> None:
    (tmp_path / "n.txt").write_text("-90\n-80\n-85\n")
    replayed = trace_air(
        tmp_path, "{type: trace, file: gains.txt, format: tossim, noise: {type: replayed, file: n.txt}}"
    )
    assert isinstance(replayed.noise, ReplayedNoise)
    assert 10 * np.log10(replayed.noise.typical_mw) == pytest.approx([-85.0, -85.0])
    steady = trace_air(tmp_path, "{type: trace, file: gains.txt, format: tossim, noise: {type: constant}}")
    assert steady.noise.step_ns is None
    assert 10 * np.log10(steady.noise.typical_mw) == pytest.approx([-98.0, -104.0])


def test_nodes_without_a_noise_line_have_the_scenario_s(tmp_path: Path) -> None:
    three = "{type: grid, rows: 1, columns: 3, spacing_m: 10}"
    (tmp_path / "g.txt").write_text("gain 0 1 -60\ngain 2 1 -70\nnoise 1 -104 0\n")
    air = trace_air(tmp_path, "{type: trace, file: g.txt, format: tossim, noise_dbm: -99}", three)
    assert 10 * np.log10(air.noise.typical_mw) == pytest.approx([-99.0, -104.0, -99.0])


def test_a_recording_is_links_with_its_ratios(tmp_path: Path) -> None:
    air = trace_air(tmp_path, "{type: trace, file: links.k7, format: k7}")
    assert {s: [x.destination for x in links] for s, links in air.paths.items()} == {0: [1], 1: [0]}
    assert [10 * np.log10(air.paths[s][0].power_mw) for s in (0, 1)] == pytest.approx([-72.0, -71.0])
    assert [air.paths[s][0].prr for s in (0, 1)] == [0.9, 0.05]
    assert [[other.id for other in air.neighbours[s]] for s in (0, 1)] == [[1], []]
    assert air.delivery is not None
    assert [air.delivery.ratios(0, s_to_ns(t)).tolist() for t in (0, 1799.9, 1800, 1e5)] == [[0.9], [0.9], [0.3], [0.3]]
    assert not air.can_relocate


def test_channel_start_speed_and_loop(tmp_path: Path) -> None:
    other = trace_air(tmp_path, "{type: trace, file: links.k7, format: k7, channel: 26}")
    assert (other.paths[0][0].prr, other.paths[1]) == (1.0, [])
    later = trace_air(tmp_path, "{type: trace, file: links.k7, format: k7, start_s: 1700, speed: 10, at_end: loop}")
    assert later.delivery is not None
    assert later.paths[0][0].prr == 0.9
    assert [later.delivery.ratios(0, s_to_ns(t)).tolist() for t in (9.9, 10, 189.9, 190)] == [
        [0.9],
        [0.3],
        [0.3],
        [0.9],
    ]
    perfect = trace_air(tmp_path, "{type: trace, file: links.k7, format: k7, reception: perfect}")
    assert perfect.delivery is None
    assert {s: [(x.destination, x.prr) for x in links] for s, links in perfect.paths.items()} == {0: [(1, 1.0)], 1: []}


def test_the_power_at_which_it_was_recorded(tmp_path: Path) -> None:
    medium = "{type: trace, file: links.k7, format: k7}"
    said = refusal(tmp_path, medium, power=-5)
    assert "small.yaml:9: nodes[0].tx_power_dbm: expected 0 dBm" in said
    assert "got -5 dBm; set it to 0, or medium.transmit_power_dbm" in said
    air = trace_air(tmp_path, medium.replace("}", ", transmit_power_dbm: -5}"), power=-5)
    assert 10 * np.log10(air.paths[0][0].power_mw) == pytest.approx(-72.0)


@pytest.mark.parametrize(("file", "form"), [("gains.txt", "tossim"), ("links.k7", "k7")])
def test_nodes_that_the_file_does_not_know(tmp_path: Path, file: str, form: str) -> None:
    four = "{type: grid, rows: 2, columns: 2, spacing_m: 10}"
    said = refusal(tmp_path, f"{{type: trace, file: {file}, format: {form}}}", four)
    assert f"small.yaml:11: medium.file: expected a file that knows every node of the scenario; {file} knows 3" in said
    assert "got no line about node 2, 3; give fewer nodes, or number them as in the file" in said


def test_nodes_numbered_as_in_the_file(tmp_path: Path) -> None:
    (tmp_path / "nodes.csv").write_text("id,x_m,y_m\n5,1,1\n0,2,2\n")
    air = trace_air(tmp_path, "{type: trace, file: gains.txt, format: tossim}", "{type: csv, file: nodes.csv}")
    assert {s: [x.destination for x in links] for s, links in air.paths.items()} == {0: [5], 5: []}


@pytest.mark.parametrize(
    ("medium", "place"),
    [
        ("{type: trace, file: none.txt, format: tossim}", "none.txt:1: expected a text file of gains"),
        ("{type: trace, file: none.k7, format: k7}", "none.k7:1: expected a K7 file that can be read"),
        ("{type: trace, file: gains.txt, format: k7}", "gains.txt:1: expected a JSON object"),
        ("{type: trace, file: links.k7, format: tossim}", "links.k7:1: expected `gain SOURCE LISTENER dB`"),
        ("{type: trace, file: links.k7, format: k7, channel: 15}", "11: medium.channel: expected a channel in links.k7: 11"),
        ("{type: trace, file: links.k7, format: k7, start_s: 3600}", "11: medium.start_s: expected a time within"),
    ],
)  # fmt: skip
def test_files_and_settings_that_do_not_fit(tmp_path: Path, medium: str, place: str) -> None:
    assert place in refusal(tmp_path, medium)


def test_a_run_takes_its_files_along(tmp_path: Path) -> None:
    (tmp_path / "n.txt").write_text("-90\n")
    (tmp_path / "gains.txt").write_text(GAINS)
    noise = "noise: {type: replayed, file: n.txt}"
    loaded = scenario(tmp_path, f"{{type: trace, file: gains.txt, format: tossim, {noise}}}", TWO)
    portable, inputs = Gathering(loaded).gather()
    assert (portable.medium.file, portable.medium.noise.file) == ("inputs/gains.txt", "inputs/n.txt")
    assert {each.name: each.source for each in inputs} == {
        "inputs/n.txt": tmp_path / "n.txt",
        "inputs/gains.txt": tmp_path / "gains.txt",
    }
    portable, inputs = Gathering(scenario(tmp_path, f"{{type: log-distance, {noise}}}", TWO)).gather()
    assert (portable.medium.noise.file, len(inputs)) == ("inputs/n.txt", 1)


def test_the_grenoble_testbed(tmp_path: Path, measured_data: Path) -> None:
    """Fifty nodes, channel 20: every measured link, with the ratios of its first round at the start."""
    (tmp_path / "grenoble.k7.gz").symlink_to(measured_data / "grenoble.k7.gz")
    k7 = read_k7(tmp_path / "grenoble.k7.gz")
    fifty = "{type: grid, rows: 5, columns: 10, spacing_m: 5}"
    air = trace_air(tmp_path, "{type: trace, file: grenoble.k7.gz, format: k7, channel: 20}", fifty)
    mine = k7.channel == 20
    measured = set(zip(k7.source[mine].tolist(), k7.destination[mine].tolist(), strict=True))
    assert {(s, x.destination) for s, links in air.paths.items() for x in links} == measured
    rows = list(zip(*(c[mine].tolist() for c in (k7.source, k7.destination, k7.time_s, k7.pdr)), strict=True))
    began = {sender: min(time for source, _, time, _ in rows if source == sender) for sender in range(50)}
    first = {(s, d): pdr for s, d, time, pdr in rows if time <= began[s] + 20.0}
    assert {(s, x.destination): x.prr for s, links in air.paths.items() for x in links if x.prr} == first
    told = {(s, other.id) for s, known in air.neighbours.items() for other in known}
    assert told == {pair for pair, ratio in first.items() if ratio >= 0.1}
    (tmp_path / "short.k7.gz").write_bytes((measured_data / "grenoble.k7.gz").read_bytes()[:-1000])
    assert "short.k7.gz:1: expected a whole gzip file" in refusal(
        tmp_path, "{type: trace, file: short.k7.gz, format: k7}", fifty
    )
    assert gzip.decompress((measured_data / "grenoble.k7.gz").read_bytes())[:1] == b"{"


def test_the_225_nodes(tmp_path: Path, measured_data: Path) -> None:
    (tmp_path / "grid.txt").symlink_to(measured_data / "15-15-medium-mica2-grid.txt")
    grid = "{type: grid, rows: 15, columns: 15, spacing_m: 10}"
    air = trace_air(tmp_path, "{type: trace, file: grid.txt, format: tossim}", grid)
    assert len(air.noise.typical_mw) == 225
    assert next(link for link in air.paths[0] if link.destination == 1).power_mw == pytest.approx(10**-8.704)
