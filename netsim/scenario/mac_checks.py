"""Combinations of MAC, medium and radio that cannot work, as findings before anything runs."""

from collections.abc import Iterator, Sequence

from netsim.errors import Finding
from netsim.models.devices import RadioDevice
from netsim.models.path_loss import IdealMediumParameters
from netsim.scenario.load import LoadedScenario
from netsim.sim.frames import ACK_PSDU_BYTE
from netsim.sim.mac.csma import CsmaParameters
from netsim.sim.mac.tdma import TdmaParameters
from netsim.units import NS_PER_MS, s_to_ns


def mac_findings(loaded: LoadedScenario, radios: Sequence[RadioDevice]) -> Iterator[Finding]:
    """Everything that cannot work, each once.

    Args:
        loaded: The scenario.
        radios: Of every node.
    """
    for radio in {radio.name: radio for radio in radios}.values():
        yield from _ack_wait(loaded, radio)
        yield from _slot(loaded, radio)


def _delay_ns(loaded: LoadedScenario) -> int:
    """There and back through the medium, apart from airtimes."""
    medium = loaded.scenario.medium
    return 2 * s_to_ns(medium.delay_s) if isinstance(medium, IdealMediumParameters) else 0


def _ack_wait(loaded: LoadedScenario, radio: RadioDevice) -> Iterator[Finding]:
    """A given wait for acknowledgements must be long enough for one to come."""
    mac = loaded.scenario.mac
    if not isinstance(mac, CsmaParameters) or not mac.acknowledge or mac.ack_wait_symbols is None:
        return
    needed_ns = radio.turnaround_ns + radio.airtime_ns(ACK_PSDU_BYTE) + _delay_ns(loaded)
    if mac.ack_wait_symbols * radio.symbol_ns < needed_ns:
        yield loaded.document.finding(
            ("mac", "ack_wait_symbols"),
            f"at least {-(-needed_ns // radio.symbol_ns)} symbols, the turnaround of {radio.name} and an acknowledgement",
            f"{mac.ack_wait_symbols}",
            "raise it, or leave it out",
        )


def _slot(loaded: LoadedScenario, radio: RadioDevice) -> Iterator[Finding]:
    """A slot must hold the longest frame and its acknowledgement."""
    mac = loaded.scenario.mac
    if not isinstance(mac, TdmaParameters):
        return
    needed_ns = mac.busy_ns(radio) + _delay_ns(loaded)
    if round(mac.slot_ms * NS_PER_MS) < needed_ns:
        yield loaded.document.finding(
            ("mac", "slot_ms"),
            f"at least {needed_ns / NS_PER_MS:g} ms: two guard times, the longest frame of {radio.name}, an acknowledgement",
            f"{mac.slot_ms:g}",
            "raise it, or lower guard_ms",
        )
