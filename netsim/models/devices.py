"""Radios, CPUs and batteries as the simulator uses them: milliwatts and whole nanoseconds.

They are read from device tables, in the units of data sheets, by `netsim.models.device_tables`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from netsim.errors import InvariantError, ScenarioError
from netsim.models.batteries import NonlinearParameters
from netsim.models.first_order import FirstOrderAmplifier
from netsim.models.lora import LoraParameters, LoraPhy
from netsim.models.modulation import O_QPSK, LoraChirps, Modulation
from netsim.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class RadioDevice:
    """A radio chip: what each state draws, and its timing.

    Attributes:
        name: Its name.
        supply_v: Supply voltage at which it draws these powers.
        bitrate_bps: Data rate on the air.
        off_mw: Draw with everything off.
        power_down_mw: Draw in power-down, registers kept and oscillator off, from which it wakes in `wake_ns`. Not called
            sleep, a word that means three states a thousandfold apart in other simulators.
        idle_mw: Draw with oscillator on, receiver and transmitter off.
        listen_mw: Draw of the receiver waiting for a frame.
        receive_mw: Draw while a frame comes in.
        transmit_mw: Draw by output power in dBm; empty where `amplifier` says it.
        switching_mw: Draw during turnaround and from idle to listening.
        wake_mw: Mean draw on the way from power-down to listening: oscillator start, then synthesiser.
        turnaround_ns: From receiving to transmitting, or back.
        wake_ns: From power-down to listening.
        idle_wake_ns: From idle to listening.
        sensitivity_dbm: Weakest signal the data sheet vouches for.
        cca_threshold_dbm: Received power from which the channel counts as busy.
        phy_header_byte: Preamble, start-of-frame and length fields: what precedes the PSDU on the air.
        max_psdu_byte: Longest physical-layer payload.
        symbol_ns: Duration of a symbol, the unit of MAC timing.
        preamble_ns: Duration of what must be heard for the receiver to lock: preamble and start of frame.
        preamble_lock_sinr_db: Lowest SINR at which a preamble is caught.
        capture_sinr_db: SINR from which the receiver leaves a frame it is locked on for one that begins later; None for
            a receiver that never does.
        modulation: How powers become right and wrong bits.
        amplifier: What sending draws, where a formula says it.
        lora: The modem and its settings, for LoRa; None for every other radio.
    """

    name: str
    supply_v: float
    bitrate_bps: int
    off_mw: float
    power_down_mw: float
    idle_mw: float
    listen_mw: float
    receive_mw: float
    transmit_mw: Mapping[float, float]
    switching_mw: float
    wake_mw: float
    turnaround_ns: int
    wake_ns: int
    idle_wake_ns: int
    sensitivity_dbm: float
    cca_threshold_dbm: float
    phy_header_byte: int
    max_psdu_byte: int
    symbol_ns: int
    preamble_ns: int
    preamble_lock_sinr_db: float
    capture_sinr_db: float | None = None
    modulation: Modulation = O_QPSK
    amplifier: FirstOrderAmplifier | None = None
    lora: LoraPhy | None = None

    def transmit_power_mw(self, tx_power_dbm: float) -> float:
        """What sending draws: the table's value at its levels, a straight line over dBm between two of them.

        Args:
            tx_power_dbm: Output power, between the lowest and the highest level of the table; any where an amplifier's
                formula stands in its place.

        Returns:
            Power drawn from the supply, in mW.

        Raises:
            ScenarioError: If the radio has no such output power; the levels are named.
        """
        if self.amplifier is not None:
            return self.amplifier.transmit_power_mw(tx_power_dbm, self.bitrate_bps)
        levels = sorted(self.transmit_mw)
        if not levels[0] <= tx_power_dbm <= levels[-1]:
            named = ", ".join(f"{level:g}" for level in levels)
            message = f"{self.name} cannot send at {tx_power_dbm:g} dBm: expected between its levels {named} dBm"
            raise ScenarioError(message)
        low = max(level for level in levels if level <= tx_power_dbm)
        high = min(level for level in levels if level >= tx_power_dbm)
        share = 0.0 if high == low else (tx_power_dbm - low) / (high - low)
        return (1.0 - share) * self.transmit_mw[low] + share * self.transmit_mw[high]

    def airtime_ns(self, psdu_byte: int) -> int:
        """How long a frame is on the air, physical header included, to the nearest nanosecond.

        Args:
            psdu_byte: Physical-layer payload: MAC header, payload and checksum; at most `max_psdu_byte`.

        Raises:
            InvariantError: If the frame is too long for the radio: the link layer must split it first.
        """
        if not 0 <= psdu_byte <= self.max_psdu_byte:
            message = f"a frame of {psdu_byte} bytes was given to {self.name}, which takes 0 to {self.max_psdu_byte}"
            raise InvariantError(message)
        if self.lora is not None:
            return self.lora.settings.airtime_ns(psdu_byte)
        bits = 8 * (self.phy_header_byte + psdu_byte)
        return (2 * bits * NS_PER_S + self.bitrate_bps) // (2 * self.bitrate_bps)


def lora_radio(radio: RadioDevice, settings: LoraParameters) -> RadioDevice:
    """The radio with other settings of its LoRa modem: symbol, preamble, bit rate and sensitivity follow from them.

    As in LoRaSim, a frame that is `capture_db` above all else survives whichever began first: unless its table says
    otherwise, the receiver leaves a frame for one that begins later and is so much above it and the noise.

    Raises:
        ScenarioError: If the radio has no LoRa modem.
    """
    if radio.lora is None:
        message = f"{radio.name} is not a LoRa radio: it has no spreading factor or bandwidth to set"
        raise ScenarioError(message)
    phy = replace(radio.lora, settings=settings)
    return replace(
        radio,
        lora=phy,
        bitrate_bps=settings.bitrate_bps,
        symbol_ns=settings.symbol_ns,
        preamble_ns=settings.preamble_ns,
        sensitivity_dbm=phy.sensitivity_dbm,
        preamble_lock_sinr_db=phy.threshold_db,
        capture_sinr_db=phy.capture_db if radio.capture_sinr_db is None else radio.capture_sinr_db,
        modulation=LoraChirps(phy.threshold_db, phy.capture_db),
    )


@dataclass(frozen=True, slots=True)
class CpuDevice:
    """A processor.

    Attributes:
        name: Its name.
        active_mw: Draw while it computes.
        sleep_mw: Draw while it waits, in the deepest mode from which its own timer wakes it.
        operations_per_s: Elementary floating-point operations a second.
    """

    name: str
    active_mw: float
    sleep_mw: float
    operations_per_s: float


@dataclass(frozen=True, slots=True)
class BatteryDevice:
    """An energy supply.

    Attributes:
        name: Its name.
        energy_j: Usable energy when full, drawn gently; infinity for mains power.
        chemistry: What heavy loads do to it; None for a linear cell, of which every joule can be had at any load.
        continuous_ma: Largest current its maker vouches for over longer times; None where that is not known.
    """

    name: str
    energy_j: float
    chemistry: NonlinearParameters | None = None
    continuous_ma: float | None = None


MAINS = BatteryDevice(name="ideal", energy_j=math.inf)
"""Mains power, called `ideal` in scenarios: it never runs out (what is drawn is still counted)."""
