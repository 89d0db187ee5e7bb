"""Measured links of a testbed in the K7 format: one row a link, channel and measurement round.

A file is plain or gzip text: a JSON object on the first line, the column names on the second, then rows such as
`2018-01-11T16:32:22.0,0,18,11,-69.9,1.0,100`. `tx_count` frames were sent; `pdr` is the share of them that arrived, and
`mean_rssi` is over those that did, so a poor link looks stronger than it is. Links on which nothing arrived have no row.
Source: the connectivity traces of the 6TiSCH simulator (github.com/keomabrun/dense_connectivity_datasets).
"""

import gzip
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from netsim.errors import Finding, ScenarioError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COLUMNS = ("datetime", "src", "dst", "channel", "mean_rssi", "pdr", "tx_count")
MAX_BYTE = 500_000_000
"""Longest text that is read, so that a file which unpacks without end fills no memory."""
GZIP_MAGIC = b"\x1f\x8b"


@dataclass(frozen=True, slots=True, eq=False)
class K7:
    """A K7 file: its header, and its rows as arrays of one length in the file's order.

    Attributes:
        header: The JSON object of the first line, as it is.
        time_s: Start of the measurement of each row, from the header's `start_date` (else from the first row).
        source: Id of the sender.
        destination: Id of the listener.
        channel: IEEE 802.15.4 channel, 11 to 26 at 2.4 GHz.
        mean_rssi_dbm: Mean received power over the frames that arrived, as the file has it.
        pdr: Packet delivery ratio, above 0 to 1.
        tx_count: Frames sent.
        duration_s: From start to `stop_date` of the header; without it, to the end of the last row's round.
        round_s: How long one sender's measurement lasts: `tx_length` frames `interframe_duration` ms apart; 10 s unless
            the header says so.
    """

    header: Mapping[str, Any]
    time_s: Floats
    source: Ints
    destination: Ints
    channel: Ints
    mean_rssi_dbm: Floats
    pdr: Floats
    tx_count: Ints
    duration_s: float
    round_s: float

    @property
    def received(self) -> Floats:
        """Frames that arrived, of each row."""
        return np.round(self.pdr * self.tx_count)

    def power_dbm(self) -> Floats:
        """Mean received power of each row, put right where the file has sums in its place (see `is_log_sum`)."""
        rssi = np.where(self.received > 0, self.mean_rssi_dbm, np.nan)
        return without_log_sum(rssi, self.received) if is_log_sum(rssi, self.received) else self.mean_rssi_dbm


def is_log_sum(rssi_dbm: Floats, received: Floats) -> bool:
    """Whether mean powers are sums of exponentials that were never divided: those of the IoT-LAB files of 2018 are.

    They are ln(sum(exp(rssi))) over the frames received, so they grow by the natural logarithm of their number, 4.6 dB for
    100 frames. Radios report whole dB: where all frames of a row had the same power, a true mean is a whole number; such a
    sum is one when ln(received) is taken off.

    Args:
        rssi_dbm: Mean powers of rows; NaN where nothing was received.
        received: Frames received of each row.
    """
    many = np.isfinite(rssi_dbm) & (received >= 2)
    if not many.any():
        return False
    as_is, without = (_share_of_whole(power[many]) for power in (rssi_dbm, without_log_sum(rssi_dbm, received)))
    return without > 0.2 and without > 4.0 * as_is


def without_log_sum(rssi_dbm: Floats, received: Floats) -> Floats:
    """Mean powers out of what `is_log_sum` tells; exact where all frames of a row had the same power."""
    return rssi_dbm - np.log(np.maximum(received, 1.0))


def _share_of_whole(power: Floats) -> float:
    return float(np.mean(np.abs(power - np.round(power)) < 0.011))


def read_k7(path: Path) -> K7:
    """Read a K7 file, plain or gzip (told by its content, not by its name).

    Raises:
        ScenarioError: With file, line, what was expected and what was found: no such file, a gzip stream that is cut short
            or damaged, a header that is not a JSON object, missing columns, rows with a wrong number of columns, values
            that are no numbers, times that are no dates, ratios outside [0, 1], counts below 1, negative ids.
    """
    lines = _text(path).splitlines()
    header = _header(path, lines)
    names = [name.strip() for name in lines[1].split(",")] if len(lines) > 1 else []
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        _refuse(path, 2, "", f"the columns {','.join(COLUMNS)}", f"none called {', '.join(missing)}")
    numbers = [number for number, line in enumerate(lines[2:], start=3) if line.strip()]
    rows = [lines[number - 1].split(",") for number in numbers]
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != len(names):
            _refuse(path, number, "", f"{len(names)} columns", str(len(row)), "the file may be cut short")
    if not rows:
        _refuse(path, 3, "", "at least one row below the column names", "none")
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    return _k7(path, header, columns, numbers)


def _k7(path: Path, header: Mapping[str, Any], columns: Mapping[str, Sequence[str]], lines: Sequence[int]) -> K7:
    time = _times(path, columns["datetime"], lines)
    start = _date(path, header, "start_date", time.min())
    time_s = (time - start) / np.timedelta64(1, "s")
    round_s = _round_s(path, header)
    last: np.datetime64 = time.max() + np.timedelta64(round(round_s * 1e9), "ns")
    stop = _date(path, header, "stop_date", last)

    def integers(name: str, low: int) -> Ints:
        return _numbers(path, name, columns[name], lines, np.int64, f"a whole number of {low} or more", low)

    rssi = _numbers(path, "mean_rssi", columns["mean_rssi"], lines, np.float64, "a power in dBm", -300.0, 100.0)
    pdr = _numbers(path, "pdr", columns["pdr"], lines, np.float64, "a ratio from 0 to 1", 0.0, 1.0)
    return K7(
        header=header,
        time_s=time_s,
        source=integers("src", 0),
        destination=integers("dst", 0),
        channel=integers("channel", 0),
        mean_rssi_dbm=rssi,
        pdr=pdr,
        tx_count=integers("tx_count", 1),
        duration_s=float((stop - start) / np.timedelta64(1, "s")),
        round_s=round_s,
    )


def _text(path: Path) -> str:
    try:
        raw = path.read_bytes()
        if raw.startswith(GZIP_MAGIC):
            with gzip.open(path) as stream:
                raw = stream.read(MAX_BYTE + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        reason = "one that is cut short or damaged: " + str(error)
        _refuse(path, 1, "", "a whole gzip file", reason, "copy or download it again", error)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        _refuse(path, 1, "", "a K7 file that can be read", reason, "check the path", error)
    if len(raw) > MAX_BYTE:
        _refuse(path, 1, "", f"at most {MAX_BYTE} bytes of text", "more")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        _refuse(path, line, "", "text or gzip", f"the byte {raw[error.start]:#04x}", "is it a K7 file?", error)


def _header(path: Path, lines: Sequence[str]) -> Mapping[str, Any]:
    first = lines[0] if lines else ""
    try:
        header = json.loads(first)
    except ValueError:
        header = None
    if not isinstance(header, dict):
        _refuse(path, 1, "", "a JSON object, the header of a K7 file", repr(first[:40]) if first else "an empty line")
    return header


def _date(path: Path, header: Mapping[str, Any], name: str, otherwise: np.datetime64) -> np.datetime64:
    if name not in header:
        return otherwise
    found = _time(str(header[name]))
    if np.isnat(found):
        _refuse(path, 1, name, "a date such as 2018-01-11T16:32:22.0", repr(header[name]))
    return found


def _round_s(path: Path, header: Mapping[str, Any]) -> float:
    try:
        round_s = float(header.get("tx_length", 100)) * float(header.get("interframe_duration", 100)) * 1e-3
    except (TypeError, ValueError):
        round_s = float("nan")
    if not 0.0 < round_s < float("inf"):
        _refuse(path, 1, "tx_length and interframe_duration", "numbers above 0", "something else")
    return round_s


def _times(path: Path, texts: Sequence[str], lines: Sequence[int]) -> NDArray[np.datetime64]:
    try:
        times = np.array(texts, dtype="datetime64[ns]")
    except ValueError:
        times = np.array([_time(text) for text in texts])
    wrong = np.isnat(times)
    if wrong.any():
        first = int(np.argmax(wrong))
        _refuse(path, lines[first], "datetime", "a date such as 2018-01-11T16:32:22.0", repr(texts[first]))
    return times


def _time(text: str) -> np.datetime64:
    try:
        return np.datetime64(text, "ns")
    except ValueError:
        return np.datetime64("NaT", "ns")


def _numbers(
    path: Path,
    name: str,
    texts: Sequence[str],
    lines: Sequence[int],
    kind: type[Any],
    expected: str,
    low: float,
    high: float = 1e9,
) -> NDArray[Any]:
    """A column as numbers in [low, high]; the first row where it is not is named."""
    try:
        numbers = np.array(texts).astype(kind)
        wrong = ~((numbers >= low) & (numbers <= high))
    except (ValueError, OverflowError):
        numbers, wrong = np.empty(0, kind), np.array([not _is_number(text, kind) for text in texts])
    if wrong.any():
        first = int(np.argmax(wrong))
        _refuse(path, lines[first], name, expected, repr(texts[first]))
    return numbers


def _is_number(text: str, kind: type[Any]) -> bool:
    try:
        np.array([text]).astype(kind)
    except (ValueError, OverflowError):
        return False
    return True


def _refuse(
    path: Path, line: int, where: str, expected: str, got: str, remedy: str = "", cause: Exception | None = None
) -> NoReturn:
    raise ScenarioError([Finding(str(path), line, where, expected, got, remedy)]) from cause
