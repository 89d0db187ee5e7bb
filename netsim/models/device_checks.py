"""Traps that device tables fall into: such a table runs, but the figures it gives mislead."""

import math

import numpy as np

from netsim.models.batteries import PeukertParameters
from netsim.models.devices import BatteryDevice, CpuDevice, RadioDevice
from netsim.units import dbm_to_mw

FASTEST_OPERATION_PJ = 1.0
"""No sensor node's processor of today needs less for a floating-point operation, memory included."""
DEAF_DB = 6.0
"""Noise this far above what the sensitivity presumes is worth a warning."""
SENSITIVITY_BITS = 8 * 21
"""A PSDU of 20 bytes and its length octet: what sensitivities are stated for (IEEE 802.15.4-2006 6.1.7)."""


def device_findings(device: RadioDevice | CpuDevice | BatteryDevice) -> list[str]:
    """Known traps that a device falls into, one sentence each; empty if none. They are warnings."""
    if isinstance(device, RadioDevice):
        traps = _radio_traps(device)
    else:
        traps = _cpu_traps(device) if isinstance(device, CpuDevice) else _battery_traps(device)
    return [f"{device.name}: {sentence}" for sentence, caught in traps.items() if caught]


def supply_finding(radio: RadioDevice, battery: BatteryDevice) -> str | None:
    """A battery that is too small for a radio: a linear cell would give a lifetime that a real one does not reach."""
    listen_ma = radio.listen_mw / radio.supply_v
    if battery.continuous_ma is None or listen_ma <= battery.continuous_ma:
        return None
    return (
        f"{battery.name}: good for {battery.continuous_ma:g} mA over longer times, but {radio.name} draws {listen_ma:g} mA "
        "while it listens; the real cell would give less energy than its table says"
    )


def noise_finding(radio: RadioDevice, noise_dbm: float) -> str | None:
    """A medium's noise that makes a radio deaf: at its sensitivity, most short frames are lost."""
    meant_dbm = noise_of_sensitivity_dbm(radio)
    if radio.amplifier is not None or noise_dbm < meant_dbm + DEAF_DB:
        return None  # the first-order model has no sensitivity to speak of
    return (
        f"medium.noise_dbm is {noise_dbm:g}, with which {radio.name} is {noise_dbm - meant_dbm:.0f} dB deafer than its "
        f"sensitivity of {radio.sensitivity_dbm:g} dBm says; {meant_dbm:.1f} dBm meets it"
    )


def noise_of_sensitivity_dbm(radio: RadioDevice) -> float:
    """Noise at which a frame of 20 bytes (PSDU) at the radio's sensitivity arrives in 99 of 100 cases."""
    signal, none = np.array([dbm_to_mw(radio.sensitivity_dbm)]), np.zeros(1)
    quiet_dbm, loud_dbm = radio.sensitivity_dbm - 60.0, radio.sensitivity_dbm + 60.0
    while loud_dbm - quiet_dbm > 1e-3:
        middle_dbm = (quiet_dbm + loud_dbm) / 2.0
        log_success = radio.modulation.log_bit_success(signal, none, np.array([dbm_to_mw(middle_dbm)]))[0]
        heard = SENSITIVITY_BITS * log_success >= math.log(0.99)
        quiet_dbm, loud_dbm = (middle_dbm, loud_dbm) if heard else (quiet_dbm, middle_dbm)
    return quiet_dbm


def _radio_traps(radio: RadioDevice) -> dict[str, bool]:
    """INET issue 757 and OTNS price listening as sleep or the reverse; `sleep` of the CC2420 is idle in Castalia."""
    listen, receive, down, idle = radio.listen_mw, radio.receive_mw, radio.power_down_mw, radio.idle_mw
    return {
        f"listening draws {listen:g} mW but receiving {receive:g} mW; a receiver that waits for a frame draws what "
        "receiving draws": listen < 0.9 * receive,
        f"power-down draws {down:g} mW, more than idle ({idle:g} mW)": down > idle,
        f"power-down draws {down:g} mW as idle does; in power-down the oscillator is off (a source's `sleep` may be "
        "either)": down == idle,
        f"off draws {radio.off_mw:g} mW, more than power-down ({down:g} mW)": radio.off_mw > down,
        "waking from power-down takes no time, though an oscillator has to start": radio.wake_ns == 0,
        "turnaround takes no time, though a synthesiser has to lock": radio.turnaround_ns == 0,
        "it radiates more than it draws": any(mw < dbm_to_mw(dbm) for dbm, mw in radio.transmit_mw.items()),
        f"it assesses the channel as clear up to {radio.cca_threshold_dbm:g} dBm, below its own sensitivity of "
        f"{radio.sensitivity_dbm:g} dBm": radio.lora is None and radio.cca_threshold_dbm < radio.sensitivity_dbm - 10.0,
    }


def _cpu_traps(cpu: CpuDevice) -> dict[str, bool]:
    energy_pj = 1e9 * cpu.active_mw / cpu.operations_per_s
    return {
        f"asleep it draws {cpu.sleep_mw:g} mW, as much as active ({cpu.active_mw:g} mW) or more": (
            cpu.sleep_mw >= cpu.active_mw > 0.0
        ),
        f"an operation costs {energy_pj:.2g} pJ; is operations_per_s a clock rate, or a peak of many cores?": (
            energy_pj < FASTEST_OPERATION_PJ
        ),
        "computing draws nothing": cpu.active_mw == 0.0,
    }


def _battery_traps(battery: BatteryDevice) -> dict[str, bool]:
    chemistry = battery.chemistry
    is_peukert = isinstance(chemistry, PeukertParameters)
    hours = chemistry.capacity_mah / chemistry.rated_current_ma if isinstance(chemistry, PeukertParameters) else 10.0
    return {
        f"its rated current would empty it in {hours:g} h; cells are rated for 5 to 100 h": (
            is_peukert and not 1.0 <= hours <= 1000.0
        ),
        "an exponent of 1 makes Peukert's cell a linear one": (
            isinstance(chemistry, PeukertParameters) and chemistry.exponent == 1.0
        ),
    }
