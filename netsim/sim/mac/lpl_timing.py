"""Settings of low-power listening, and the times that follow from them for a radio."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from netsim.models.devices import RadioDevice
from netsim.parameters import NonNegative, Positive, PositiveInt, parameters
from netsim.sim.frames import MAC_OVERHEAD_BYTE
from netsim.sim.mac.exchange import ack_wait_ns
from netsim.units import NS_PER_MS


@parameters
class LplParameters:
    """Low-power listening: radios sleep and sample the channel now and then; senders wake their receivers first.

    The sampling is ContikiMAC's (8 checks a second, listening 1/80 s after something was heard), with three samples so
    that one of them meets a strobe whatever the gap between strobes.
    """

    type: Literal["lpl"] = "lpl"
    variant: Literal["x-mac", "b-mac"] = "x-mac"
    """How a sender wakes its receiver. `x-mac` (Buettner et al., SenSys 2006): short strobes that carry the address, with
    gaps in which the receiver can answer and the others go back to sleep. `b-mac` (Polastre et al., SenSys 2004): a
    preamble as long as the wake interval, on this packet radio made of frames without a gap between them; it carries no
    address, so that whoever hears it stays awake."""
    wake_interval_ms: Positive = 125.0
    """Time between two checks of the channel (ContikiMAC: 1/8 s)."""
    samples: PositiveInt = 3
    """Samples of a check: together they must last longer than the gap between strobes."""
    sample_ms: Positive = 0.128
    """Length of a sample: a clear channel assessment, 8 symbols of 16 us (ContikiMAC: 1/8192 s)."""
    sample_spacing_ms: Positive = 0.5
    """From the start of a sample to the start of the next (ContikiMAC rests 1/2000 s between them); if there is time, the
    radio is idle between them."""
    sample_threshold_dbm: float = -90.0
    """Received power that wakes (Contiki's setting of the CC2420). Links below it are not noticed while they sleep."""
    listen_ms: Positive = 12.5
    """How long a node stays awake after it noticed something, or received (ContikiMAC: 1/80 s)."""
    strobe_byte: PositiveInt | None = None
    """Size of a wake-up frame (PSDU); by default 11 bytes, a bare header, for x-mac and the radio's longest for b-mac."""
    gap_ms: Positive | None = None
    """x-mac: how long a sender waits for an answer after each strobe; by default as long as for any acknowledgement, 0.864
    ms at 2.4 GHz."""
    backoff_ms: NonNegative = 10.0
    """Before a frame's first attempt the sender waits a random time, even between 0 and this (chosen)."""
    max_backoffs: Annotated[int, Ge(0), Le(30)] = 5
    """Busy assessments before the frame is given up as `channel_busy`, less one. After the n-th it waits a random time,
    even between 0 and 2^(n-1) wake intervals (8 at most), and may sleep meanwhile."""
    max_retries: Annotated[int, Ge(0), Le(30)] = 3
    """Further attempts, strobes and all, before the frame is given up as `no_ack`; they wait as after a busy channel."""
    acknowledge: bool = True
    """Whether unicast frames ask for an acknowledgement (the strobes of x-mac do in any case)."""
    queue_frames: PositiveInt = 64
    """Frames that can wait; more are dropped as `queue_full`."""


@dataclass(frozen=True, slots=True)
class LplTiming:
    """The times of low-power listening with a radio, in nanoseconds.

    Attributes:
        interval_ns: From check to check.
        sample_ns: A sample.
        between_ns: From the end of a sample to the start of the next.
        span_ns: From the start of a check's first sample to the end of its last.
        listen_ns: Awake after something was noticed.
        strobe_byte: Size of a wake-up frame.
        strobe_ns: Its airtime.
        gap_ns: Wait after a strobe; 0 for b-mac.
        silent_ns: From the end of a strobe to the start of the next, while nobody answers.
        clear_ns: How long the channel must have been clear before a sender begins: longer than others are silent.
        train_ns: From the first strobe on, new ones begin for so long: until a check has noticed one, wherever it began,
            and one more has come.
        ack_wait_ns: Wait for an acknowledgement of data.
    """

    interval_ns: int
    sample_ns: int
    between_ns: int
    span_ns: int
    listen_ns: int
    strobe_byte: int
    strobe_ns: int
    gap_ns: int
    silent_ns: int
    clear_ns: int
    train_ns: int
    ack_wait_ns: int


def lpl_timing(parameters: LplParameters, device: RadioDevice) -> LplTiming:
    """The times that follow from the settings for a radio."""
    strobed = parameters.variant == "x-mac"
    strobe_byte = parameters.strobe_byte or (MAC_OVERHEAD_BYTE if strobed else device.max_psdu_byte)
    strobe_ns = device.airtime_ns(strobe_byte)
    sample_ns, spacing_ns = _ns(parameters.sample_ms), _ns(parameters.sample_spacing_ms)
    interval_ns = _ns(parameters.wake_interval_ms)
    span_ns = (parameters.samples - 1) * spacing_ns + sample_ns
    wait_ns = ack_wait_ns(device)
    gap_ns = (wait_ns if parameters.gap_ms is None else _ns(parameters.gap_ms)) if strobed else 0
    silent_ns = gap_ns + device.turnaround_ns if strobed else 0
    return LplTiming(
        interval_ns=interval_ns,
        sample_ns=sample_ns,
        between_ns=spacing_ns - sample_ns,
        span_ns=span_ns,
        listen_ns=_ns(parameters.listen_ms),
        strobe_byte=strobe_byte,
        strobe_ns=strobe_ns,
        gap_ns=gap_ns,
        silent_ns=silent_ns,
        clear_ns=silent_ns + sample_ns,
        train_ns=interval_ns + span_ns + silent_ns + strobe_ns,
        ack_wait_ns=wait_ns,
    )


def _ns(time_ms: float) -> int:
    return round(time_ms * NS_PER_MS)
