"""A packet capture for Wireshark: every frame as IEEE 802.15.4, with what a receiver would say of it in front (TAP).

The file is that of libpcap with times in nanoseconds; its link type 283 is IEEE 802.15.4 TAP (J. R. Kemp et al., "IEEE
802.15.4 TAP Link Type Specification", 2018): a header of typed fields, each padded to four bytes, then the frame itself.
"""

import math
import struct
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from netsim.errors import TraceError
from netsim.export.ieee802154 import (
    ACK_BYTE,
    BROADCAST_ADDRESS,
    DATA_OVERHEAD_BYTE,
    MAX_ADDRESS,
    acknowledgement,
    data_frame,
)
from netsim.export.job import ExportWarning, Job
from netsim.export.ordering import ByStart, longest_wait_ns
from netsim.export.sequences import SequenceNumbers
from netsim.export.setting import Setting, load_setting
from netsim.trace.events import BROADCAST, OUTCOME_CODE, Event, Frame
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

_LINK_TYPE = 283
_FILE_HEAD = struct.Struct("<IHHiIII").pack(0xA1B23C4D, 2, 4, 0, 0, 65535, _LINK_TYPE)
_RECORD_HEAD = struct.Struct("<IIII")
_TAP_HEAD = struct.Struct("<BxH")
_FCS_TYPE = struct.pack("<HHB3x", 0, 1, 1)  # a checksum of 16 bits
_RSS = struct.Struct("<HHf")
_CHANNEL = struct.Struct("<HHHBx")
_INSTANT = struct.Struct("<HHQ")
_RSS_ID, _CHANNEL_ID, _START_ID, _END_ID = 1, 3, 5, 6
_DECODED = (OUTCOME_CODE["received"], OUTCOME_CODE["overheard"])


class Capture:
    """Writes a capture, frames in the order in which they begin.

    Args:
        path: File to write.
        job: What is exported.

    Raises:
        OSError: If the file cannot be written.
        TraceError: If the trace cannot be read or is damaged.
    """

    def __init__(self, path: Path, job: Job) -> None:
        self._selection = job.selection
        self._node = job.pcap_node
        self._setting = load_setting(job.trace)
        _warn(self._setting)
        self._numbers = SequenceNumbers()
        self._order = ByStart(longest_wait_ns(job.trace, job.selection.start_ns, job.selection.end_ns))
        self._is_empty = True
        self._stream: BinaryIO = path.open("wb")
        self._stream.write(_FILE_HEAD)

    def handlers(self) -> Mapping[type[Event], Handler]:
        """It reads frames."""
        return {Frame: self._on_frame}

    def close(self) -> None:
        """Write what was held back, and close the file."""
        self._write(self._order.rest())
        self._stream.close()
        if self._is_empty:
            warnings.warn("pcap: no frame is in the part that was asked for", ExportWarning, stacklevel=2)

    def abort(self) -> None:
        """Close the file as it is."""
        self._stream.close()

    def _on_frame(self, frame: Frame, time_ns: int) -> None:
        sequence = self._numbers.of(frame)  # of those left out too: they count
        if not self._selection.has_frame(frame) or not self._is_heard(frame):
            return
        packet = tap(frame, self._rss_dbm(frame), self._setting.channel) + psdu(
            frame, sequence, self._setting.acknowledges
        )
        seconds, rest_ns = divmod(frame.t_start_ns, NS_PER_S)
        record = _RECORD_HEAD.pack(seconds, rest_ns, len(packet), len(packet)) + packet
        self._write(self._order.add(frame.t_start_ns, time_ns, frame.frame_id, record))

    def _write(self, records: Iterable[bytes]) -> None:
        for record in records:
            self._stream.write(record)
            self._is_empty = False

    def _is_heard(self, frame: Frame) -> bool:
        """Whether the capturing node sent or decoded a frame; a sniffer that hears all hears it."""
        if self._node is None or frame.source == self._node:
            return True
        heard = np.asarray(frame.rx_node) == self._node
        return bool(np.isin(np.asarray(frame.rx_outcome)[heard], _DECODED).any())

    def _rss_dbm(self, frame: Frame) -> float:
        """Received power where it is captured; NaN where there is none."""
        nodes, powers = np.asarray(frame.rx_node), np.asarray(frame.rx_rssi_dbm)
        if self._setting.is_ideal or self._node == frame.source or not len(nodes):
            return math.nan
        if self._node is not None:
            powers = powers[nodes == self._node]
        elif frame.destination != BROADCAST:
            powers = powers[nodes == frame.destination]
        return float(powers.max(initial=-math.inf))


def tap(frame: Frame, rss_dbm: float, channel: int | None) -> bytes:
    """The header in front of a frame: kind of checksum, received power, channel, when it began and ended.

    Args:
        frame: The frame.
        rss_dbm: Received power; left out if it is not finite.
        channel: IEEE 802.15.4 channel of page 0; None to leave it out.
    """
    fields = _FCS_TYPE
    if math.isfinite(rss_dbm):
        fields += _RSS.pack(_RSS_ID, 4, rss_dbm)
    if channel is not None:
        fields += _CHANNEL.pack(_CHANNEL_ID, 3, channel, 0)
    fields += _INSTANT.pack(_START_ID, 8, frame.t_start_ns) + _INSTANT.pack(_END_ID, 8, frame.t_end_ns)
    return _TAP_HEAD.pack(0, _TAP_HEAD.size + len(fields)) + fields


def psdu(frame: Frame, sequence: int, acknowledges: bool) -> bytes:
    """A frame as it is on the air, of its true size; the trace keeps no payload, so that is filling.

    Args:
        frame: The frame.
        sequence: Its data sequence number.
        acknowledges: Whether frames to one node ask for an acknowledgement (wake-up frames never do).

    Raises:
        TraceError: If the frame is too short, or its ends have no short address.
    """
    if frame.is_ack and frame.size_byte == ACK_BYTE:
        return acknowledgement(sequence)
    to_all = frame.destination == BROADCAST
    destination = BROADCAST_ADDRESS if to_all else frame.destination
    if frame.is_ack or frame.size_byte < DATA_OVERHEAD_BYTE:
        msg = f"frame {frame.frame_id}: {frame.size_byte} bytes are no frame of IEEE 802.15.4: it cannot be captured"
        raise TraceError(msg)
    if frame.source > MAX_ADDRESS or (not to_all and destination > MAX_ADDRESS):
        msg = f"frame {frame.frame_id}: its nodes {frame.source}, {destination} have no 16-bit address"
        raise TraceError(msg)
    wants_ack = acknowledges and not to_all and not frame.is_strobe
    return data_frame(frame.source, destination, sequence, frame.size_byte, wants_ack=wants_ack)


def _warn(setting: Setting) -> None:
    said = "frames are written as IEEE 802.15.4, of their true size and at their true times"
    if setting.other_radios:
        names = ", ".join(setting.other_radios)
        message = f"pcap: the radio {names} is not of IEEE 802.15.4: {said}, but with no channel"
        warnings.warn(message, ExportWarning, stacklevel=2)
    elif setting.is_ideal:
        message = f"pcap: the medium is ideal: {said}, but with neither received power nor channel"
        warnings.warn(message, ExportWarning, stacklevel=2)
