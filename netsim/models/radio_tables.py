"""Tables of radios: what each state and each change of state draws, how long it takes, what the physical layer is.

Currents are at `supply_v`. The word sleep is avoided: see `SLEEP_MEANS`.
"""

from typing import Annotated, Final, Literal

from annotated_types import MinLen

from netsim.models.devices import RadioDevice, lora_radio
from netsim.models.first_order import FirstOrderAmplifier
from netsim.models.lora import LoraParameters, LoraPhy
from netsim.models.modulation import O_QPSK, Cc2420Fit, Modulation, NcFsk
from netsim.models.sourced import NonNegativeNumber, Number, PositiveCount, PositiveNumber
from netsim.parameters import Name, parameters
from netsim.units import NS_PER_US

SLEEP_MEANS: Final = (
    "`sleep` of the CC2420 is the idle state in Castalia (424 uA), power-down in ns-3 (20 uA), the regulator off in WSNet "
    "(20 nA): give off_ma, power_down_ma (registers kept, oscillator off) and idle_ma (oscillator on) apart"
)
REMEDIES: Final = {
    "sleep_ma": SLEEP_MEANS,
    "wake_us": "give the two steps apart: power_down_to_idle_us (oscillator start) and idle_to_listen_us (synthesiser)",
}
"""What to write instead of keys that are refused on purpose."""


@parameters
class OQpskTable:
    """IEEE 802.15.4 O-QPSK at 2.4 GHz: the standard's bit error curve."""

    type: Literal["o-qpsk"] = "o-qpsk"
    source: Name
    """Where it says so."""

    def modulation(self, bitrate_bps: int) -> Modulation:
        """The modulation at a bit rate."""
        return O_QPSK


@parameters
class NcFskTable:
    """Non-coherent FSK."""

    type: Literal["nc-fsk"] = "nc-fsk"
    noise_bandwidth_khz: PositiveNumber
    """Noise bandwidth of the receiver."""

    def modulation(self, bitrate_bps: int) -> Modulation:
        """The modulation at a bit rate."""
        return NcFsk(1e3 * self.noise_bandwidth_khz.value / bitrate_bps)


@parameters
class Cc2420FitTable:
    """TOSSIM's fit to measurements of the CC2420, in place of the standard's curve."""

    type: Literal["cc2420-fit"] = "cc2420-fit"
    source: Name
    """Where it says so."""

    def modulation(self, bitrate_bps: int) -> Modulation:
        """The modulation at a bit rate."""
        return Cc2420Fit()


ModulationTable = OQpskTable | NcFskTable | Cc2420FitTable


@parameters
class FirstOrderTable:
    """An amplifier whose draw is what it puts out, beside a constant energy a bit; any output power can be asked for."""

    electronics_nj_per_bit: PositiveNumber
    """E_elec."""
    free_space_pj_per_bit_per_m2: PositiveNumber
    """eps_fs: energy of the amplifier below the crossover distance, over its square."""
    multipath_pj_per_bit_per_m4: PositiveNumber
    """eps_mp: energy of the amplifier from the crossover distance on, over its fourth power."""

    def amplifier(self) -> FirstOrderAmplifier:
        """The amplifier as the simulator uses it."""
        return FirstOrderAmplifier(
            self.electronics_nj_per_bit.value,
            self.free_space_pj_per_bit_per_m2.value,
            self.multipath_pj_per_bit_per_m4.value,
        )


@parameters
class _States:
    """What every radio's table has."""

    kind: Literal["radio"] = "radio"
    """What this file is."""
    name: Name
    """The chip."""
    supply_v: PositiveNumber
    """Supply voltage."""
    off_ma: NonNegativeNumber
    """Everything off."""
    power_down_ma: NonNegativeNumber
    """Registers kept, oscillator off."""
    idle_ma: NonNegativeNumber
    """Oscillator on, receiver and transmitter off."""
    listen_ma: NonNegativeNumber
    """Receiver on, waiting for a frame: what receiving draws."""
    receive_ma: NonNegativeNumber
    """A frame comes in."""
    transmit_ma: Annotated[dict[float, NonNegativeNumber], MinLen(1)] | None = None
    """By output power in dBm."""
    switching_ma: NonNegativeNumber
    """During turnaround and from idle to listening: the synthesiser locks."""
    turnaround_us: NonNegativeNumber
    """From receiving to transmitting, or back."""
    power_down_to_idle_us: NonNegativeNumber
    """The oscillator starts, at the idle current."""
    idle_to_listen_us: NonNegativeNumber
    """The synthesiser locks, at the switching current."""
    cca_threshold_dbm: Number
    """Received power from which the channel counts as busy."""
    max_psdu_byte: PositiveCount
    """Longest physical-layer payload."""
    capture_sinr_db: Number | None = None
    """SINR from which it leaves a frame it is locked on for a later one; without the key it never does."""

    def common(self) -> dict[str, object]:
        """Fields of the device that every radio has."""
        volt = self.supply_v.value
        start_us, lock_us = self.power_down_to_idle_us.value, self.idle_to_listen_us.value
        wake_uc = start_us * self.idle_ma.value + lock_us * self.switching_ma.value
        return {
            "name": self.name,
            "supply_v": volt,
            "off_mw": volt * self.off_ma.value,
            "power_down_mw": volt * self.power_down_ma.value,
            "idle_mw": volt * self.idle_ma.value,
            "listen_mw": volt * self.listen_ma.value,
            "receive_mw": volt * self.receive_ma.value,
            "transmit_mw": {dbm: volt * current.value for dbm, current in (self.transmit_ma or {}).items()},
            "switching_mw": volt * self.switching_ma.value,
            "wake_mw": volt * wake_uc / (start_us + lock_us) if start_us + lock_us else 0.0,
            "turnaround_ns": round(self.turnaround_us.value * NS_PER_US),
            "wake_ns": round((start_us + lock_us) * NS_PER_US),
            "idle_wake_ns": round(lock_us * NS_PER_US),
            "cca_threshold_dbm": self.cca_threshold_dbm.value,
            "max_psdu_byte": self.max_psdu_byte.value,
            "capture_sinr_db": None if self.capture_sinr_db is None else self.capture_sinr_db.value,
        }


@parameters
class RadioTable(_States):
    """A radio's table. Currents are at `supply_v`."""

    transmit_first_order: FirstOrderTable | None = None
    """In place of `transmit_ma`: what sending draws by the first-order model."""
    bitrate_bps: PositiveCount
    """Data rate on the air."""
    modulation: ModulationTable
    """How powers become right and wrong bits."""
    sensitivity_dbm: Number
    """Weakest signal the data sheet vouches for."""
    phy_header_byte: PositiveCount
    """What precedes the PSDU on the air."""
    preamble_byte: PositiveCount
    """Of that, what must be heard to lock: preamble and start of frame."""
    symbol_us: PositiveNumber
    """Duration of a symbol, the unit of MAC timing; where a standard names none, the time of four bits."""
    preamble_lock_sinr_db: Number
    """Lowest SINR at which a preamble is caught."""

    def __post_init__(self) -> None:
        """Refuse a radio that sends in no way or in two."""
        if (self.transmit_ma is None) == (self.transmit_first_order is None):
            message = "either transmit_ma or transmit_first_order"
            raise ValueError(message)
        if self.preamble_byte.value > self.phy_header_byte.value:
            message = "preamble_byte of at most phy_header_byte"
            raise ValueError(message)

    def device(self) -> RadioDevice:
        """The radio in the simulator's units."""
        bitrate_bps = self.bitrate_bps.value
        preamble_us = 8e6 * self.preamble_byte.value / bitrate_bps
        first_order = self.transmit_first_order
        return RadioDevice(
            **self.common(),  # type: ignore[arg-type]
            bitrate_bps=bitrate_bps,
            modulation=self.modulation.modulation(bitrate_bps),
            sensitivity_dbm=self.sensitivity_dbm.value,
            phy_header_byte=self.phy_header_byte.value,
            preamble_ns=round(preamble_us * NS_PER_US),
            symbol_ns=round(self.symbol_us.value * NS_PER_US),
            preamble_lock_sinr_db=self.preamble_lock_sinr_db.value,
            amplifier=None if first_order is None else first_order.amplifier(),
        )


@parameters
class LoraModemTable:
    """A LoRa modem: bit rate, symbol, preamble and sensitivity follow from a node group's `lora` settings."""

    type: Literal["lora"] = "lora"
    sensitivity_125khz_dbm: Annotated[dict[int, Number], MinLen(1)]
    """Weakest signal by spreading factor, 7 to 12, at 125 kHz."""
    noise_figure_db: NonNegativeNumber
    """Noise of the receiver above the thermal noise, with which those sensitivities become ratios."""
    capture_db: NonNegativeNumber
    """How far a frame must be above the summed interference of its spreading factor."""

    def __post_init__(self) -> None:
        """Refuse spreading factors that are missing."""
        if set(self.sensitivity_125khz_dbm) != set(range(7, 13)):
            message = "a sensitivity for every spreading factor from 7 to 12"
            raise ValueError(message)


@parameters
class LoraRadioTable(_States):
    """A LoRa radio's table. Currents are at `supply_v`."""

    modulation: LoraModemTable
    """The modem."""

    def __post_init__(self) -> None:
        """Refuse a radio that cannot send."""
        if self.transmit_ma is None:
            message = "transmit_ma"
            raise ValueError(message)

    def device(self) -> RadioDevice:
        """The radio in the simulator's units, at the default settings of the modem."""
        modem, settings = self.modulation, LoraParameters()
        sensitivity = {factor: number.value for factor, number in modem.sensitivity_125khz_dbm.items()}
        phy = LoraPhy(settings, sensitivity, modem.noise_figure_db.value, modem.capture_db.value)
        bare = RadioDevice(
            **self.common(),  # type: ignore[arg-type]
            bitrate_bps=settings.bitrate_bps,
            sensitivity_dbm=phy.sensitivity_dbm,
            phy_header_byte=0,
            preamble_ns=settings.preamble_ns,
            symbol_ns=settings.symbol_ns,
            preamble_lock_sinr_db=phy.threshold_db,
            lora=phy,
        )
        return lora_radio(bare, settings)
