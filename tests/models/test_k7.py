"""The K7 reader: rows, header, gzip, what it refuses, and the Grenoble file."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from netsim.errors import ScenarioError
from netsim.models.k7 import read_k7

HEADER = (
    '{"tx_length": 100, "interframe_duration": 50, "start_date": "2018-01-11T16:00:00.0", '
    '"stop_date": "2018-01-11T17:00:00.0"}'
)
COLUMNS = "datetime,src,dst,channel,mean_rssi,pdr,tx_count"
ROWS = ["2018-01-11T16:00:10.0,0,7,11,-70.5,1.0,100", "2018-01-11T16:30:00.5,7,0,26,-85,0.25,100"]


def file_of(folder: Path, *lines: str) -> Path:
    path = folder / "links.k7"
    path.write_text("\n".join(lines) + "\n")
    return path


def refusal(path: Path) -> str:
    with pytest.raises(ScenarioError) as raised:
        read_k7(path)
    return str(raised.value)


@pytest.mark.parametrize("packed", [False, True])
def test_rows_and_header(tmp_path: Path, packed: bool) -> None:
    path = file_of(tmp_path, HEADER, COLUMNS, *ROWS)
    if packed:
        path.write_bytes(gzip.compress(path.read_bytes()))
    k7 = read_k7(path)
    assert k7.time_s.tolist() == [10.0, 1800.5]
    assert (k7.source.tolist(), k7.destination.tolist(), k7.channel.tolist()) == ([0, 7], [7, 0], [11, 26])
    assert (k7.mean_rssi_dbm.tolist(), k7.pdr.tolist(), k7.tx_count.tolist()) == ([-70.5, -85], [1, 0.25], [100, 100])
    assert (k7.duration_s, k7.round_s, k7.header["tx_length"]) == (3600.0, 5.0, 100)


def test_without_dates_the_rows_give_them(tmp_path: Path) -> None:
    k7 = read_k7(file_of(tmp_path, "{}", COLUMNS, *ROWS))
    assert (k7.time_s.tolist(), k7.round_s, k7.duration_s) == ([0.0, 1790.5], 10.0, 1800.5)


def test_other_columns_and_empty_lines_are_skipped(tmp_path: Path) -> None:
    k7 = read_k7(file_of(tmp_path, "{}", "run," + COLUMNS, "", "1," + ROWS[0], "", "1," + ROWS[1]))
    assert k7.destination.tolist() == [7, 0]


@pytest.mark.parametrize(
    ("lines", "place", "text"),
    [
        (("not json", COLUMNS, *ROWS), ":1", "JSON object"),
        ((HEADER, "a,b", *ROWS), ":2", "datetime"),
        ((HEADER, COLUMNS), ":3", "at least one row"),
        ((HEADER, COLUMNS, *ROWS, "2018-01-11T16:00"), ":5", "7 columns"),
        ((HEADER, COLUMNS, ROWS[0].replace("-70.5", "loud")), ":3: mean_rssi", "'loud'"),
        ((HEADER, COLUMNS, ROWS[0], ROWS[1].replace("0.25", "1.25")), ":4: pdr", "from 0 to 1"),
        ((HEADER, COLUMNS, ROWS[0].replace(",0,7", ",0.5,7")), ":3: src", "whole number"),
        ((HEADER, COLUMNS, ROWS[0].replace(",100", ",0")), ":3: tx_count", "1 or more"),
        ((HEADER, COLUMNS, ROWS[0], ROWS[1].replace("2018-01", "yesterday")), ":4: datetime", "a date"),
        ((HEADER.replace("2018-01-11T16:00:00.0", "noon"), COLUMNS, *ROWS), ":1: start_date", "'noon'"),
        ((HEADER.replace("50", '"x"'), COLUMNS, *ROWS), ":1: tx_length", "above 0"),
    ],
)
def test_each_refusal_names_its_line(tmp_path: Path, lines: tuple[str, ...], place: str, text: str) -> None:
    message = refusal(file_of(tmp_path, *lines))
    assert f"links.k7{place}" in message
    assert text in message


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    assert "check the path" in refusal(tmp_path / "none.k7")
    packed = tmp_path / "short.k7.gz"
    packed.write_bytes(gzip.compress("\n".join([HEADER, COLUMNS, *ROWS * 500]).encode())[:-50])
    assert "cut short or damaged" in refusal(packed)
    packed.write_bytes(b"\x1f\x8b\x08\x00garbage that is not deflated")
    assert "cut short or damaged" in refusal(packed)
    packed.write_bytes(b"PK\x03\x04\xff\xfe")
    assert "text or gzip" in refusal(packed)
    packed.write_bytes(b"")
    assert "an empty line" in refusal(packed)


def test_the_grenoble_file(measured_data: Path) -> None:
    k7 = read_k7(measured_data / "grenoble.k7.gz")
    assert len(k7.time_s) == 108_659
    assert k7.duration_s == 172_148.0
    assert np.unique(k7.source).tolist() == list(range(50))
    assert np.unique(k7.channel).tolist() == list(range(11, 27))
    assert (k7.mean_rssi_dbm.min(), k7.mean_rssi_dbm.max()) == (-91.0, -26.39)
    power_dbm = k7.power_dbm()  # its means are sums: nothing below the receivers' floor is left once that is put right
    assert power_dbm.min() == pytest.approx(-91.0, abs=0.01)
    assert np.mean(np.abs(power_dbm - np.round(power_dbm)) < 0.011) > 0.4
    assert set(k7.tx_count.tolist()) == {100}
    assert (k7.pdr == 1.0).mean() == pytest.approx(0.68583, abs=1e-5)
