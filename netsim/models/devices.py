"""Radios, CPUs and batteries as the simulator uses them: milliwatts and whole nanoseconds.

They are read from device tables, in the units of data sheets, by `netsim.models.device_tables`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from netsim.errors import InvariantError, ScenarioError
from netsim.models.modulation import O_QPSK, Modulation
from netsim.units import NS_PER_S, dbm_to_mw


@dataclass(frozen=True, slots=True)
class RadioDevice:
    """A radio chip: what each state draws, and its timing.

    Attributes:
        name: Its name.
        supply_v: Supply voltage at which it draws these powers.
        bitrate_bps: Data rate on the air.
        off_mw: Draw with everything off.
        sleep_mw: Draw in the power-down state, from which it wakes in `wake_ns`.
        idle_mw: Draw with oscillator on, receiver and transmitter off.
        listen_mw: Draw of the receiver waiting for a frame.
        receive_mw: Draw while a frame comes in.
        transmit_mw: Draw by output power in dBm.
        switching_mw: Draw during turnaround and wake-up.
        turnaround_ns: From receiving to transmitting, or back.
        wake_ns: From power-down to listening.
        sensitivity_dbm: Weakest signal the data sheet vouches for.
        cca_threshold_dbm: Received power from which the channel counts as busy.
        phy_header_byte: Preamble, start-of-frame and length fields: what precedes the PSDU on the air.
        max_psdu_byte: Longest physical-layer payload.
        symbol_ns: Duration of a symbol, the unit of MAC timing.
        preamble_lock_sinr_db: Lowest SINR at which a preamble is caught.
        capture_sinr_db: SINR from which the receiver leaves a frame it is locked on for one that begins later; None for
            a receiver that never does.
        modulation: How powers become right and wrong bits.
    """

    name: str
    supply_v: float
    bitrate_bps: int
    off_mw: float
    sleep_mw: float
    idle_mw: float
    listen_mw: float
    receive_mw: float
    transmit_mw: Mapping[float, float]
    switching_mw: float
    turnaround_ns: int
    wake_ns: int
    sensitivity_dbm: float
    cca_threshold_dbm: float
    phy_header_byte: int
    max_psdu_byte: int
    symbol_ns: int
    preamble_lock_sinr_db: float
    capture_sinr_db: float | None = None
    modulation: Modulation = O_QPSK

    def transmit_power_mw(self, tx_power_dbm: float) -> float:
        """What sending draws: the table's value at its levels, a straight line over dBm between two of them.

        Args:
            tx_power_dbm: Output power, between the lowest and the highest level of the table.

        Returns:
            Power drawn from the supply, in mW.

        Raises:
            ScenarioError: If the radio has no such output power; the levels are named.
        """
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
        bits = 8 * (self.phy_header_byte + psdu_byte)
        return (2 * bits * NS_PER_S + self.bitrate_bps) // (2 * self.bitrate_bps)


@dataclass(frozen=True, slots=True)
class CpuDevice:
    """A processor.

    Attributes:
        name: Its name.
        active_mw: Draw while it computes.
        sleep_mw: Draw while it waits.
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
        energy_j: Usable energy when full; infinity for mains power.
    """

    name: str
    energy_j: float


MAINS = BatteryDevice(name="ideal", energy_j=math.inf)
"""Mains power, called `ideal` in scenarios: it never runs out (what is drawn is still counted)."""


def device_findings(radio: RadioDevice) -> list[str]:
    """Known traps of radio tables that `radio` falls into, one sentence each; empty if none.

    They are warnings: such a table runs, but the lifetimes it gives mislead. INET issue 757 and OTNS price listening as
    sleep or the reverse; "sleep" of the CC2420 is the idle state in Castalia.
    """
    traps = {
        f"listening draws {radio.listen_mw:g} mW but receiving {radio.receive_mw:g} mW; a receiver that waits for a "
        "frame draws what receiving draws": radio.listen_mw < 0.9 * radio.receive_mw,
        f"sleep draws {radio.sleep_mw:g} mW, more than idle ({radio.idle_mw:g} mW)": radio.sleep_mw > radio.idle_mw,
        f"sleep draws {radio.sleep_mw:g} mW as idle does; sleep is the power-down state, idle has the oscillator on": (
            radio.sleep_mw == radio.idle_mw
        ),
        f"off draws {radio.off_mw:g} mW, more than sleep ({radio.sleep_mw:g} mW)": radio.off_mw > radio.sleep_mw,
        "waking from sleep takes no time, though an oscillator has to start": radio.wake_ns == 0,
        "it radiates more than it draws": any(mw < dbm_to_mw(dbm) for dbm, mw in radio.transmit_mw.items()),
    }
    return [f"{radio.name}: {sentence}" for sentence, caught in traps.items() if caught]
