"""LoRa: what a spreading factor, a bandwidth and a coding rate mean for airtime and sensitivity.

Airtime: Semtech AN1200.13 "LoRa modem designer's guide", section 4, as in the SX1276 data sheet, section 4.1.1.7.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.parameters import parameters

THERMAL_NOISE_DBM_PER_HZ = -174.0
REFERENCE_BANDWIDTH_KHZ = 125
LONG_SYMBOL_NS = 16_000_000
"""From symbols of this length on, low-data-rate optimisation is required (SX1276 data sheet 4.1.1.6)."""
SYNC_SYMBOLS_TIMES_4 = 17
"""Synchronisation symbols after the programmed preamble, times four: 4.25."""


@parameters
class LoraParameters:
    """Settings of a LoRa radio. All radios of a medium must have the same: others would not be heard."""

    spreading_factor: Annotated[int, Ge(7), Le(12)] = 7
    """Bits a symbol; a symbol is 2^spreading_factor chips long."""
    bandwidth_khz: Literal[125, 250, 500] = 125
    """Bandwidth; chips a second."""
    coding_rate: Annotated[int, Ge(1), Le(4)] = 1
    """Redundant bits on every four: 1 is 4/5, 4 is 4/8."""
    preamble_symbols: Annotated[int, Ge(6), Le(65535)] = 8
    """Programmed length of the preamble; 4.25 symbols of synchronisation follow it."""
    explicit_header: bool = True
    """Whether the frame says how long it is and how it is coded."""
    payload_crc: bool = True
    """Whether the radio adds a checksum of 16 bits."""
    low_data_rate_optimisation: Literal["auto", "on", "off"] = "auto"
    """Two bits a symbol less against drift; `auto`: for symbols of 16 ms and longer, as the data sheet demands."""

    @property
    def symbol_ns(self) -> int:
        """Length of a symbol: 2^SF / bandwidth; a whole number of nanoseconds."""
        return (1_000_000 << self.spreading_factor) // self.bandwidth_khz

    @property
    def preamble_ns(self) -> int:
        """Length of preamble and synchronisation."""
        return (4 * self.preamble_symbols + SYNC_SYMBOLS_TIMES_4) * self.symbol_ns // 4

    @property
    def optimises_low_rate(self) -> bool:
        """Whether low-data-rate optimisation is on."""
        if self.low_data_rate_optimisation == "auto":
            return self.symbol_ns >= LONG_SYMBOL_NS
        return self.low_data_rate_optimisation == "on"

    @property
    def bitrate_bps(self) -> int:
        """Payload bits a second, redundancy taken off: SF * bandwidth / 2^SF * 4 / (4 + coding rate)."""
        return round(self.spreading_factor * 1e9 / self.symbol_ns * 4 / (4 + self.coding_rate))

    def airtime_ns(self, payload_byte: int) -> int:
        """Time on the air of a frame, preamble included.

        Args:
            payload_byte: Physical-layer payload, at least 0.
        """
        factor = self.spreading_factor
        bits = 8 * payload_byte - 4 * factor + 28 + 16 * self.payload_crc - 20 * (not self.explicit_header)
        blocks = -(-bits // (4 * (factor - 2 * self.optimises_low_rate)))
        symbols = 8 + max(blocks, 0) * (self.coding_rate + 4)
        return self.preamble_ns + symbols * self.symbol_ns


@dataclass(frozen=True, slots=True)
class LoraPhy:
    """A LoRa modem with its settings.

    Attributes:
        settings: What the modem is set to.
        sensitivity_125khz_dbm: Weakest signal by spreading factor, at 125 kHz.
        noise_figure_db: How much noise the receiver adds to the thermal noise, at which those were found.
        capture_db: How far a frame must be above the summed interference.
    """

    settings: LoraParameters
    sensitivity_125khz_dbm: Mapping[int, float]
    noise_figure_db: float
    capture_db: float

    @property
    def threshold_db(self) -> float:
        """Lowest ratio of signal to noise that is demodulated: the sensitivity less the noise it was found at.

        It belongs to the spreading factor; the bandwidth changes the noise, not the ratio.
        """
        noise_dbm = noise_floor_dbm(REFERENCE_BANDWIDTH_KHZ, self.noise_figure_db)
        return self.sensitivity_125khz_dbm[self.settings.spreading_factor] - noise_dbm

    @property
    def sensitivity_dbm(self) -> float:
        """Weakest signal at the bandwidth of the settings, where only the receiver's own noise disturbs it."""
        return self.threshold_db + noise_floor_dbm(self.settings.bandwidth_khz, self.noise_figure_db)


def noise_floor_dbm(bandwidth_khz: float, noise_figure_db: float) -> float:
    """Thermal noise at room temperature in a bandwidth, plus the receiver's noise figure."""
    return THERMAL_NOISE_DBM_PER_HZ + 10.0 * math.log10(bandwidth_khz * 1e3) + noise_figure_db
