"""Combinations of MAC, medium and radio that cannot work, as findings before anything runs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from netsim.errors import Finding
from netsim.models.devices import RadioDevice
from netsim.models.media import IdealMediumParameters
from netsim.scenario.load import LoadedScenario
from netsim.sim.frames import ACK_PSDU_BYTE, MAC_OVERHEAD_BYTE
from netsim.sim.mac.csma import CsmaParameters
from netsim.sim.mac.lpl_timing import LplParameters, LplTiming, lpl_timing
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
        yield from _low_power_listening(loaded, radio)


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


@dataclass(frozen=True, slots=True)
class _Demand:
    """What a setting of low-power listening must be for the others to work."""

    key: str
    expected: str
    holds: bool
    remedy: str


def _low_power_listening(loaded: LoadedScenario, radio: RadioDevice) -> Iterator[Finding]:
    """Sleepers must be able to notice a train of strobes, and to hear one whole before they sleep again."""
    mac, document = loaded.scenario.mac, loaded.document
    if not isinstance(mac, LplParameters):
        return
    medium = loaded.scenario.medium
    reception = "none" if isinstance(medium, IdealMediumParameters) else medium.reception
    if reception != "sinr":
        yield document.finding(
            ("mac", "type"),
            "a medium on which a channel can be sensed, one with propagation and `reception: sinr`",
            f"lpl on {medium.type} with reception {reception}",
            "use such a medium, or another mac",
        )
        return
    if not MAC_OVERHEAD_BYTE <= (mac.strobe_byte or MAC_OVERHEAD_BYTE) <= radio.max_psdu_byte:
        span = f"{MAC_OVERHEAD_BYTE} to {radio.max_psdu_byte} bytes, what {radio.name} can send"
        yield document.finding(("mac", "strobe_byte"), span, f"{mac.strobe_byte}", "change it, or leave it out")
        return
    for demand in _demands(lpl_timing(mac, radio), radio):
        if not demand.holds:
            yield document.finding(("mac", demand.key), demand.expected, f"{getattr(mac, demand.key)}", demand.remedy)


def _demands(times: LplTiming, radio: RadioDevice) -> Iterator[_Demand]:
    answer_ns = radio.turnaround_ns + radio.airtime_ns(ACK_PSDU_BYTE)
    whole_ns = times.silent_ns + 2 * times.strobe_ns
    yield _Demand(
        "gap_ms",
        f"at least {_ms(answer_ns)} ms, the turnaround of {radio.name} and an acknowledgement",
        times.gap_ns == 0 or times.gap_ns >= answer_ns,
        "raise it, or leave it out",
    )
    yield _Demand(
        "samples",
        f"so many that a check lasts more than {_ms(times.silent_ns)} ms, the silence between strobes",
        times.span_ns > times.silent_ns,
        "take more samples, or space them wider",
    )
    yield _Demand(
        "sample_spacing_ms",
        f"at least sample_ms, and less than {_ms(times.strobe_ns)} ms, a strobe, longer: none must fit in between",
        0 <= times.between_ns < times.strobe_ns,
        "take samples closer together, or longer strobes",
    )
    yield _Demand(
        "listen_ms",
        f"at least {_ms(whole_ns)} ms, so that a whole strobe is heard whenever one wakes",
        times.listen_ns >= whole_ns,
        "raise it, or shorten strobe_byte",
    )
    yield _Demand(
        "wake_interval_ms",
        f"more than {_ms(radio.wake_ns + times.span_ns)} ms, the time that {radio.name} takes for a check",
        times.interval_ns > radio.wake_ns + times.span_ns,
        "raise it",
    )


def _ms(time_ns: int) -> str:
    return f"{time_ns / NS_PER_MS:g}"
