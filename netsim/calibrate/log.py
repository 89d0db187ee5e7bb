"""Logs of testbeds: a CSV file of one's own (see `csv_log`), or the K7 format of IoT-LAB and 6TiSCH."""

import gzip
import zlib
from pathlib import Path
from typing import Final

import numpy as np

from netsim.calibrate.columns import TestbedLog as TestbedLog
from netsim.calibrate.columns import refusal
from netsim.calibrate.csv_log import from_csv
from netsim.models.k7 import GZIP_MAGIC, MAX_BYTE, is_log_sum, read_k7, without_log_sum


def read_log(path: Path) -> TestbedLog:
    """Read a log; K7 is told by its first line, a JSON object.

    Raises:
        ScenarioError: With file, line, column and remedy: no such file, a gzip file that is cut short, not text, no rows,
            missing columns, values that are no numbers or out of range.
    """
    text = _text(path)
    if text.lstrip().startswith("{"):
        return _from_k7(path)
    return from_csv(path, text)


def _from_k7(path: Path) -> TestbedLog:
    k7 = read_k7(path)
    ids, index = np.unique(np.concatenate([k7.source, k7.destination]), return_inverse=True)
    count = len(k7.source)
    unknown = np.full(count, np.nan)
    length = k7.header.get("tx_length")
    received = k7.received
    rssi_dbm = np.where(received > 0, k7.mean_rssi_dbm, np.nan)
    corrected = ""
    if is_log_sum(rssi_dbm, received):
        rssi_dbm, corrected = without_log_sum(rssi_dbm, received), LOG_SUM
    return TestbedLog(
        path=path,
        format="k7",
        names=tuple(map(str, ids.tolist())),
        source=index[:count],
        destination=index[count:],
        rssi_dbm=rssi_dbm,
        received=received,
        sent=k7.tx_count.astype(float),
        distance_m=unknown,
        tx_power_dbm=unknown,
        time_s=k7.time_s,
        channel=k7.channel.astype(np.intp),
        per_frame=False,
        frame_byte=length if isinstance(length, int) and 0 < length <= 127 else None,
        corrected=corrected,
    )


LOG_SUM: Final = (
    "The mean powers of this file are not means: they are ln(sum(exp(rssi))) over the frames received, so they grow by the "
    "natural logarithm of the number received (4.6 dB for 100 frames). That logarithm was taken off again."
)


def _text(path: Path) -> str:
    """The file, unpacked, as text."""
    try:
        raw = path.read_bytes()
        if raw.startswith(GZIP_MAGIC):
            with gzip.open(path) as stream:
                raw = stream.read(MAX_BYTE + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise refusal(
            path, 1, "", "a whole gzip file", f"a damaged one: {error}", "copy or download it again"
        ) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise refusal(path, 1, "", "a log that can be read", reason, "check the path") from error
    if len(raw) > MAX_BYTE:
        raise refusal(path, 1, "", f"at most {MAX_BYTE} bytes of text", "more", "cut the log into parts")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise refusal(path, line, "", "text", f"the byte {raw[error.start]:#04x}", "is it a CSV file?") from error
