"""Logs drawn from known parameters: they are found again, within the errors stated; what cannot be found is said."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest
from testbed import ASYMMETRY_DB, EXPONENT, FRAME_BYTE, LOSS_DB, NOISE_DBM, SHADOWING_DB, Testbed

from netsim.calibrate import Options, calibrate, medium_yaml, read_log, tables
from netsim.calibrate.reception import half_success_snr_db
from netsim.errors import ScenarioError
from netsim.models.node_files import read_nodes
from netsim.models.reception import frame_success_probability

SPREAD_DB = math.hypot(SHADOWING_DB, 0.5 * ASYMMETRY_DB)


def calibrated(log: Path, nodes: Path | None = None, **options: object):
    positions = tuple(read_nodes(nodes)) if nodes else ()
    return calibrate(read_log(log), Options(positions=positions, frame_byte=FRAME_BYTE, **options))  # type: ignore[arg-type]


def fit_within(found, errors: float) -> None:
    """The path loss lies within so many of its standard errors."""
    fit = found.path_loss.fit
    assert abs(fit.exponent - EXPONENT) < errors * fit.exponent_se
    assert abs(fit.reference_loss_db - LOSS_DB) < errors * fit.reference_loss_se_db
    assert abs(fit.sd_db - SPREAD_DB) < errors * fit.sd_se_db
    assert abs(found.path_loss.asymmetry_sd_db - ASYMMETRY_DB) < errors * found.path_loss.asymmetry_se_db


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("form", ["all listed", "heard ones listed, positions", "heard ones listed, distances"])
def test_path_loss_is_found_within_its_errors(seed: int, form: str, tmp_path: Path) -> None:
    """Twelve figures of 3.3 standard errors in each of fifteen cases: all hold by chance in 95 of 100 sets of seeds."""
    bed = Testbed(seed)
    nodes = bed.write_positions(tmp_path / "nodes.csv")
    if form == "all listed":
        found = calibrated(bed.write_counts(tmp_path / "log.csv"), nodes)
    elif form.endswith("positions"):
        found = calibrated(bed.write_counts(tmp_path / "log.csv", listed_only=True), nodes)
    else:
        found = calibrated(bed.write_counts(tmp_path / "log.csv", listed_only=True, distances=True))
    assert found.path_loss.fit.truncated is form.endswith("distances")
    fit_within(found, 3.3)
    assert found.path_loss.plain.exponent < found.path_loss.fit.exponent  # least squares falls short


def test_a_log_of_frames_and_one_of_counts_say_the_same(tmp_path: Path) -> None:
    bed = Testbed(3, nodes=20, frames=30)
    nodes = bed.write_positions(tmp_path / "nodes.csv")
    frames = calibrated(bed.write_frames(tmp_path / "frames.csv"), nodes)
    counts = calibrated(bed.write_counts(tmp_path / "counts.csv"), nodes)
    assert frames.prr[0].half_dbm == pytest.approx(counts.prr[0].half_dbm, abs=1e-4)
    assert frames.path_loss.fit.exponent == pytest.approx(counts.path_loss.fit.exponent, abs=1e-4)
    assert frames.log.per_frame
    assert not counts.log.per_frame


def test_the_noise_is_that_of_the_formula_with_the_same_half_point(tmp_path: Path) -> None:
    """The formula is not quite logistic: a tenth of a dB is allowed besides the error."""
    found = calibrated(Testbed(1).write_counts(tmp_path / "log.csv"))
    assert found.noise_dbm == pytest.approx(NOISE_DBM, abs=0.1 + 3.3 * found.noise_se_db)
    snr_db = found.prr[0].half_dbm - found.noise_dbm
    assert frame_success_probability(10.0 ** (snr_db / 10.0), 8 * (FRAME_BYTE + 1)) == pytest.approx(0.5, abs=1e-9)


def test_without_distances_path_loss_is_left_out_and_said_to_be(tmp_path: Path) -> None:
    found = calibrated(Testbed(1).write_counts(tmp_path / "log.csv"))
    assert found.path_loss is None
    assert any("path loss, shadowing and asymmetry are left out" in note for note in found.notes)
    assert "exponent:" not in medium_yaml(found)
    assert "noise_dbm: -9" in medium_yaml(found)


def test_losses_of_strong_links_are_not_taken_for_noise(tmp_path: Path) -> None:
    found = calibrated(Testbed(2, ceiling=0.9).write_counts(tmp_path / "log.csv"))
    assert found.prr[0].ceiling == pytest.approx(0.9, abs=3.3 * found.prr[0].ceiling_se)
    assert found.noise_dbm == pytest.approx(NOISE_DBM, abs=0.1 + 3.3 * found.noise_se_db)
    assert any("interference of" in note for note in found.notes)


def test_receivers_that_report_no_less_than_a_floor(tmp_path: Path) -> None:
    """The curve lies below it, so it cannot be told; path loss can, with what lies at the floor as no stronger."""
    bed = Testbed(4, floor_dbm=-90.0)
    found = calibrated(bed.write_counts(tmp_path / "log.csv"), bed.write_positions(tmp_path / "nodes.csv"))
    assert found.floor_dbm == pytest.approx(-90.0)
    assert found.prr == ()
    assert found.noise_dbm is None
    most_dbm = -90.0 - half_success_snr_db(FRAME_BYTE)
    assert any(f"noise is at most {most_dbm:.1f} dBm" in note for note in found.notes)
    fit_within(found, 3.3)


def k7_log(path: Path, bed: Testbed, summed: bool) -> Path:
    """A K7 file whose powers are whole dB, either means or sums of exponentials."""
    header = {
        "location": "bed",
        "tx_length": 60,
        "start_date": "2020-01-01T00:00:00",
        "stop_date": "2020-01-01T01:00:00",
    }
    lines = [json.dumps(header), "datetime,src,dst,channel,mean_rssi,pdr,tx_count"]
    for row in np.flatnonzero(bed.received > 0).tolist():
        power = round(float(bed.power_dbm[row])) + (math.log(bed.received[row]) if summed else 0.0)
        ratio = bed.received[row] / bed.sent[row]
        ends = f"{bed.source[row]},{bed.destination[row]}"
        lines.append(f"2020-01-01T00:10:00,{ends},{11 + row % 2},{power:.2f},{ratio:.2f},{bed.sent[row]}")
    path.write_bytes(gzip.compress("\n".join(lines).encode()))
    return path


def test_means_that_are_sums_are_put_right_and_said_to_be(tmp_path: Path) -> None:
    bed = Testbed(5)
    right = read_log(k7_log(tmp_path / "right.k7.gz", bed, summed=False))
    wrong = read_log(k7_log(tmp_path / "wrong.k7.gz", bed, summed=True))
    assert right.corrected == ""
    assert "not means" in wrong.corrected
    assert wrong.rssi_dbm == pytest.approx(right.rssi_dbm, abs=0.01)


def test_a_k7_file_is_replayed_and_its_channels_are_told_apart(tmp_path: Path) -> None:
    log = read_log(k7_log(tmp_path / "bed.k7.gz", Testbed(5), summed=False))
    both, one = calibrate(log), calibrate(log, Options(channel=12))
    assert sorted(both.by_channel) == [11, 12]
    assert one.by_channel == {}
    text = medium_yaml(one, tmp_path)
    assert '  file: "bed.k7.gz"' in text
    assert "  channel: 12\n" in text
    with pytest.raises(ScenarioError, match="no row of channel 13; channels in the log: 11, 12"):
        calibrate(log, Options(channel=13))


def test_a_node_without_a_position_is_named(tmp_path: Path) -> None:
    bed = Testbed(1, nodes=8)
    (tmp_path / "nodes.csv").write_text("id,x_m,y_m\n0,0,0\n1,5,5\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match="none for 2, 3, 4, 5, 6, 7"):
        calibrated(bed.write_counts(tmp_path / "log.csv"), tmp_path / "nodes.csv")


def test_power_that_changes_between_frames_is_measured(tmp_path: Path) -> None:
    generator = np.random.default_rng(1)
    powers = -60.0 + generator.normal(0.0, 2.0, 4000)
    rows = [f"a,b,{power:.4f},1" for power in powers[:2000]] + [f"b,a,{power:.4f},1" for power in powers[2000:]]
    (tmp_path / "log.csv").write_text("\n".join(["source,destination,rssi_dbm,received", *rows]), encoding="utf-8")
    found = calibrate(read_log(tmp_path / "log.csv"))
    assert found.variation.between == "frames"
    assert found.variation.median_sd_db == pytest.approx(2.0, rel=0.06)
    assert any("No fit of reception" in note for note in found.notes)


def test_every_table_has_rows_of_its_width(tmp_path: Path) -> None:
    bed = Testbed(1)
    found = calibrated(bed.write_counts(tmp_path / "log.csv"), bed.write_positions(tmp_path / "nodes.csv"))
    for table in tables(found):
        assert {len(row) for row in table.rows} == {len(table.header) or 2}


def test_the_grenoble_log(measured_data: Path) -> None:
    """Its powers are sums, its receivers report no less than -91 dBm, and wireless networks take some channels."""
    found = calibrate(read_log(measured_data / "grenoble.k7.gz"))
    assert "not means" in found.log.corrected
    assert found.floor_dbm == pytest.approx(-91.0, abs=0.02)
    assert found.prr == ()
    clean = [ratio for channel, ratio in found.strong_ratio.items() if channel in (15, 20, 25, 26)]
    assert min(clean) > 0.999
    assert found.strong_ratio[12] < 0.96


@pytest.mark.parametrize("seed", range(3))
def test_the_noise_of_few_frames_is_no_asymmetry(seed: int, tmp_path: Path) -> None:
    """Links alike both ways, eight frames each with 3 dB of noise: a difference of 1.5 dB if it were not taken off."""
    generator = np.random.default_rng(seed)
    lines = ["source,destination,rssi_dbm,received,distance_m"]
    for i in range(20):
        for j in range(i):
            metres = float(generator.uniform(2.0, 30.0))
            power = -40.0 - 28.0 * math.log10(metres) + float(generator.normal(0.0, 4.0))
            for a, b in ((i, j), (j, i)):
                lines += [f"{a},{b},{each:.3f},1,{metres:.3f}" for each in generator.normal(power, 3.0, 8)]
    log = tmp_path / "log.csv"
    log.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = calibrated(log)
    loss = found.path_loss
    assert loss.asymmetry_sd_db < 3.0 * loss.asymmetry_se_db
    assert loss.asymmetry_sd_db < 0.75
    assert abs(loss.shadowing_sd_db - 4.0) < 3.0 * 4.0 / math.sqrt(2 * 190)
    assert any("taken off the shadowing" in note for note in found.notes)


def test_means_without_their_frames_keep_the_noise_and_say_so(tmp_path: Path) -> None:
    found = calibrated(Testbed(1).write_counts(tmp_path / "log.csv", listed_only=True, distances=True))
    assert any("come out too large by it" in note for note in found.notes)
