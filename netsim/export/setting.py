"""What an export has to know of a run before its first event: the radios, the medium, the channel."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from netsim.errors import TraceError
from netsim.trace.events import NodeTable
from netsim.trace.reader import read_trace, trace_attachments

_SCENARIO_FILE = "scenario.yaml"
_IEEE_802_15_4_RADIOS = {"cc2420", "cc2538", "nrf52840"}
_LOWEST_CHANNEL, _HIGHEST_CHANNEL = 11, 26
_CHANNEL_11_HZ, _CHANNEL_SPACING_HZ = 2.405e9, 5e6


@dataclass(frozen=True)
class Setting:
    """What a trace says of its run.

    Attributes:
        radios: Names of the radios, each once.
        medium: The scenario's section `medium`; empty where the trace carries no scenario.
        mac: The scenario's section `mac`.
    """

    radios: tuple[str, ...] = ()
    medium: Mapping[str, Any] = field(default_factory=dict)
    mac: Mapping[str, Any] = field(default_factory=dict)

    @property
    def other_radios(self) -> list[str]:
        """The radios that are not of IEEE 802.15.4 at 2.4 GHz."""
        return [name for name in self.radios if name.lower() not in _IEEE_802_15_4_RADIOS]

    @property
    def is_ideal(self) -> bool:
        """Whether the medium knows no received power."""
        return bool(self.medium.get("type") == "ideal")

    @property
    def acknowledges(self) -> bool:
        """Whether frames to one node ask for an acknowledgement; yes where the trace does not say."""
        return bool(self.mac.get("acknowledge", self.mac.get("type") != "ideal"))

    @property
    def channel(self) -> int | None:
        """The IEEE 802.15.4 channel, 11 to 26; None where there is none, or the trace does not say which.

        It is that of a testbed's recording, or the one at the medium's carrier frequency; media without a frequency have
        losses for channel 11.
        """
        if self.other_radios or self.is_ideal:
            return None
        if self.medium.get("type") == "trace":
            found = self.medium.get("channel")
        else:
            frequency_hz = self.medium.get("frequency_hz") or _CHANNEL_11_HZ
            found = _LOWEST_CHANNEL + round((frequency_hz - _CHANNEL_11_HZ) / _CHANNEL_SPACING_HZ)
        return found if found is not None and _LOWEST_CHANNEL <= found <= _HIGHEST_CHANNEL else None


def load_setting(trace: Path) -> Setting:
    """What a trace says of its run.

    Raises:
        TraceError: If the trace, or the scenario in it, cannot be read.
    """
    radios: dict[str, None] = {}
    for _, event in read_trace(trace, {NodeTable.topic}, end_ns=1):
        if isinstance(event, NodeTable):
            radios |= dict.fromkeys(event.radio)
    scenario = _scenario(trace)
    medium, mac = (scenario.get(part) for part in ("medium", "mac"))
    return Setting(tuple(radios), medium or {}, mac or {})


def _scenario(trace: Path) -> Mapping[str, Any]:
    content = trace_attachments(trace).get(_SCENARIO_FILE, b"")
    try:
        found = YAML(typ="safe", pure=True).load(io.BytesIO(content))
    except YAMLError as error:
        msg = f"{trace}: its {_SCENARIO_FILE} is damaged: {error}"
        raise TraceError(msg) from error
    return found if isinstance(found, Mapping) else {}
