"""A testbed's log as columns."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from netsim.errors import Finding, ScenarioError

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class TestbedLog:
    """A log as columns of one length.

    Attributes:
        path: Where it was read.
        format: `k7` or `csv`.
        names: The nodes, as the log names them.
        source: Index into `names` of the sender.
        destination: Index of the listener.
        rssi_dbm: Mean received power over the frames received; NaN where none was.
        received: Frames received.
        sent: Frames sent.
        distance_m: Distance of the two nodes; NaN where the log does not say.
        tx_power_dbm: Transmit power; NaN where the log does not say.
        time_s: Time of the row; NaN where the log does not say.
        channel: Channel; 0 where the log does not say.
        per_frame: Whether a row is one frame.
        frame_byte: Length of the frames, if the log says it.
        corrected: What had to be put right when it was read; empty for nothing.
    """

    path: Path
    format: Literal["csv", "k7"]
    names: tuple[str, ...]
    source: Ints
    destination: Ints
    rssi_dbm: Floats
    received: Floats
    sent: Floats
    distance_m: Floats
    tx_power_dbm: Floats
    time_s: Floats
    channel: Ints
    per_frame: bool
    frame_byte: int | None = None
    corrected: str = ""

    @property
    def link(self) -> Ints:
        """A number for each ordered pair of nodes, by row."""
        return self.source * len(self.names) + self.destination

    def only(self, kept: NDArray[np.bool_]) -> "TestbedLog":
        """Some of the rows."""
        columns = ("source", "destination", "rssi_dbm", "received", "sent", "distance_m", "tx_power_dbm", "time_s")
        chosen = {name: getattr(self, name)[kept] for name in (*columns, "channel")}
        return replace(self, **chosen)


def refusal(path: Path, line: int, where: str, expected: str, got: str, remedy: str = "") -> ScenarioError:
    """An error of one finding."""
    return ScenarioError([Finding(str(path), line, where, expected, got, remedy)])
