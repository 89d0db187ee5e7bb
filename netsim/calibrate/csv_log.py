"""A log of one's own as CSV.

The file has a header. `source`, `destination` and `rssi_dbm` must be among its columns, and what was received, in one of
three ways:

    received          1 or 0: a row a frame; rssi_dbm is that frame's, empty where it was lost
    sent, received    counts: a row a measurement; rssi_dbm is the mean over the frames received, empty if none was
    pdr, tx_count     the same, as a ratio of the frames sent

Optional: `distance_m`, `tx_power_dbm`, `time_s`, `channel`. Other columns are passed over. Nodes are named as one likes.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from netsim.calibrate.columns import Floats, TestbedLog, refusal
from netsim.errors import Finding, ScenarioError

NEEDED: Final = ("source", "destination", "rssi_dbm")
COUNTS: Final = (("sent", "received"), ("pdr", "tx_count"), ("received",))
"""The ways of saying what was received; the first whose columns are there counts."""
OPTIONAL: Final = ("distance_m", "tx_power_dbm", "time_s", "channel")
KNOWN: Final = (*NEEDED, "received", "sent", "pdr", "tx_count", *OPTIONAL)
FINDINGS_SHOWN: Final = 20


def from_csv(path: Path, text: str) -> TestbedLog:
    """Read the text of a CSV log; errors as of `netsim.calibrate.log.read_log`."""
    reader = csv.reader(io.StringIO(text, newline=""))
    try:
        rows = [(reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise refusal(path, reader.line_num, "", "CSV", str(error)) from error
    header = [name.strip() for name in rows[0][1]] if rows else []
    counts = _counts(path, rows[0][0] if rows else 1, header)
    if len(rows) == 1:
        raise refusal(path, rows[0][0], "", "at least one row below the header", "none")
    wrong = [(line, row) for line, row in rows[1:] if len(row) != len(header)]
    if wrong:
        line, row = wrong[0]
        raise refusal(
            path, line, "", f"{len(header)} columns, as in the header", str(len(row)), "is the row cut short?"
        )
    cells = dict(zip(header, zip(*(row for _, row in rows[1:]), strict=True), strict=True))
    return _Columns(path, [line for line, _ in rows[1:]], cells).log(counts)


def _counts(path: Path, line: int, header: Sequence[str]) -> tuple[str, ...]:
    """Which columns say what was received; complains of a header that does not say enough."""
    missing = [name for name in NEEDED if name not in header]
    counts = next((names for names in COUNTS if set(names) <= set(header)), ())
    if not missing and counts and len(set(header)) == len(header):
        return counts
    expected = f"the columns {', '.join(NEEDED)} and one of: received; sent and received; pdr and tx_count"
    if not header:
        raise refusal(path, line, "", expected, "an empty file")
    other = next(
        (name for mark, name in ((";", "semicolons"), ("\t", "tabs")) if len(header) == 1 and mark in header[0]), None
    )
    if other is not None:
        remedy = f"the columns seem to be separated by {other}: separate them by commas, with decimal points in numbers"
        raise refusal(path, line, "", expected, f"`{header[0]}`", remedy)
    repeated = next((name for name in header if header.count(name) > 1), "")
    near = [
        f"rename `{name}` to `{match[0]}`"
        for name in header
        if name not in KNOWN and (match := get_close_matches(name.lower(), [*missing, "received", "sent", "pdr"], n=1))
    ]
    remedy = f"`{repeated}` comes twice" if repeated else "; ".join(near) or "name the columns in the first line"
    raise refusal(path, line, "", expected, f"`{','.join(header)}`", remedy)


class _Columns:
    """Turns cells into arrays and keeps what is wrong with them."""

    def __init__(self, path: Path, lines: Sequence[int], cells: Mapping[str, Sequence[str]]) -> None:
        self._path = path
        self._lines = lines
        self._cells = cells
        self._findings: list[Finding] = []

    def log(self, counts: tuple[str, ...]) -> TestbedLog:
        """The log, or every finding."""
        sent, received = self._sent_and_received(counts)
        labels = [cell.strip() for name in ("source", "destination") for cell in self._cells[name]]
        names, index = np.unique(np.array(labels), return_inverse=True)
        source, destination = index[: len(sent)], index[len(sent) :]
        rssi_dbm = self._numbers("rssi_dbm", -150.0, 30.0, "a power in dBm from -150 to 30", optional=True)
        self._refuse(np.isnan(rssi_dbm) & (received > 0), "rssi_dbm", "a power where frames were received", "none")
        self._refuse(source == destination, "destination", "another node than the source", "the same")
        for column in ("source", "destination"):
            empty = np.array([not cell.strip() for cell in self._cells[column]])
            self._refuse(empty, column, "the name of a node", "nothing")
        log = TestbedLog(
            path=self._path,
            format="csv",
            names=tuple(names.tolist()),
            source=source,
            destination=destination,
            rssi_dbm=np.where(received > 0, rssi_dbm, np.nan),
            received=received,
            sent=sent,
            distance_m=self._optional("distance_m", 1e-3, 1e6, "a distance above 0, in metres"),
            tx_power_dbm=self._optional("tx_power_dbm", -60.0, 60.0, "a power in dBm from -60 to 60"),
            time_s=self._optional("time_s", -np.inf, np.inf, "a number of seconds"),
            channel=np.nan_to_num(self._optional("channel", 0.0, 1e6, "a channel number")).astype(np.intp),
            per_frame=counts == ("received",),
        )
        if self._findings:
            raise ScenarioError(self._findings[:FINDINGS_SHOWN])
        return log

    def _sent_and_received(self, counts: tuple[str, ...]) -> tuple[Floats, Floats]:
        if counts == ("received",):
            received = self._numbers("received", 0.0, 1.0, "1 or 0 (for counts give `sent` too)", whole=True)
            return np.ones(len(received)), received
        if counts == ("pdr", "tx_count"):
            ratio = self._numbers("pdr", 0.0, 1.0, "a ratio from 0 to 1")
            sent = self._numbers("tx_count", 1.0, 1e9, "a whole number of at least 1", whole=True)
            return sent, np.round(ratio * sent)
        sent = self._numbers("sent", 1.0, 1e9, "a whole number of at least 1", whole=True)
        received = self._numbers("received", 0.0, 1e9, "a whole number of at least 0", whole=True)
        self._refuse(received > sent, "received", "at most as many as were sent", "more")
        return sent, received

    def _optional(self, name: str, low: float, high: float, expected: str) -> Floats:
        if name not in self._cells:
            return np.full(len(self._lines), np.nan)
        return self._numbers(name, low, high, expected, optional=True)

    def _numbers(
        self, name: str, low: float, high: float, expected: str, *, optional: bool = False, whole: bool = False
    ) -> Floats:
        """A column as numbers, NaN where it is empty (if it may be) or wrong."""
        cells = self._cells[name]
        numbers = np.array([_number(cell, optional) for cell in cells])
        wrong = ~((numbers >= low) & (numbers <= high)) & ~np.isnan(numbers) | np.isinf(numbers)
        if whole:
            wrong |= numbers != np.round(numbers)
        for place in np.flatnonzero(wrong)[:FINDINGS_SHOWN].tolist():
            self._findings.append(
                Finding(str(self._path), self._lines[place], name, expected, f"`{cells[place].strip()}`")
            )
        return np.where(wrong, np.nan, numbers)

    def _refuse(self, wrong: NDArray[np.bool_], column: str, expected: str, got: str) -> None:
        already = {(finding.line, finding.path) for finding in self._findings}
        for place in np.flatnonzero(wrong)[:FINDINGS_SHOWN].tolist():
            if (self._lines[place], column) not in already:
                self._findings.append(Finding(str(self._path), self._lines[place], column, expected, got))


def _number(text: str, optional: bool) -> float:
    """The number; NaN for an empty cell that may be empty, infinity for what is no number."""
    if optional and not text.strip():
        return float("nan")
    try:
        number = float(text)
    except ValueError:
        return float("inf")
    return number if np.isfinite(number) else float("inf")
