"""What a chart says in words: labels of arrows, and what is told of a thing that is pointed at."""

import math
from collections.abc import Iterable, Iterator, Sequence

from netsim.metrics.causes import Sending
from netsim.sequence.records import Arm, Exchange, Noted, Transmission
from netsim.trace.events import BROADCAST, AlgorithmRecord, GraphMessages, MessageDropped
from netsim.units import NS_PER_MS, NS_PER_S, NS_PER_US

_LISTED = 8
_LONGEST = 400  # characters of a note


def duration(time_ns: float) -> str:
    """A time in the unit that suits."""
    for unit, size in (("s", NS_PER_S), ("ms", NS_PER_MS), ("µs", NS_PER_US)):
        if time_ns >= size:
            return f"{time_ns / size:.3g} {unit}" if time_ns < 1000 * size else f"{time_ns / size:,.0f} {unit}"
    return f"{time_ns:.0f} ns"


def instant(time_ns: int) -> str:
    """An instant in seconds, to the microsecond."""
    return f"{time_ns / NS_PER_S:.6f}"


def energy(joules: float) -> str:
    """An energy in the unit that suits."""
    for unit, size in (("J", 1.0), ("mJ", 1e-3), ("µJ", 1e-6)):
        if joules >= size:
            return f"{joules / size:.3g} {unit}"
    return f"{joules * 1e9:.3g} nJ"


def reason(outcome: str) -> str:
    """What became of a frame, in words."""
    return outcome.replace("_", " ")


def labels(sent: Transmission, parts: int = 1) -> list[str]:
    """What may stand on an arrow, the longest first; nothing on that of an acknowledgement.

    Args:
        sent: The transmission.
        parts: In how many parts its message goes out.
    """
    number = f"#{sent.message_id} " if sent.message_id else ""
    kind = sent.kind or "control"
    if sent.role == "ack":
        return []
    if sent.role == "strobe":
        times = f"{sent.count} × wake-up" if sent.count > 1 else "wake-up"
        return [f"{times} for {number}{kind}", times]
    again = f", try {sent.attempt + 1}" if sent.attempt else ""
    part = f" {sent.part}/{parts}" if sent.part and parts > 1 else ""
    to = _reach(sent) if sent.destination == BROADCAST else ""
    if sent.part > 1 and part:
        return [f"{kind}{part}{again}", f"{sent.part}/{parts}{again}", f"{sent.part}/{parts}"]
    return [
        f"{number}{kind}{part}, {sent.size_byte} byte{again}{to}",
        f"{kind}{part}, {sent.size_byte} byte{again}",
        f"{kind}{part}{again}",
        *([kind] if again or part else []),
        *([number.strip()] if number else []),
    ]


def _reach(sent: Transmission) -> str:
    received = sum(arm.is_received for arm in sent.arms)
    return f" → {received} of {len(sent.arms)}" if received < len(sent.arms) else f" → {received}"


def told(exchange: Exchange, sent: Transmission) -> str:
    """All about a transmission, in lines."""
    return "\n".join(_lines(exchange, sent))


def _lines(exchange: Exchange, sent: Transmission) -> Iterator[str]:
    to = "all in range" if sent.destination == BROADCAST else exchange.name(sent.destination)
    number = f" #{sent.message_id}" if sent.message_id else ""
    what = {"ack": "acknowledgement of ", "strobe": "wake-up for ", "retry": "", "data": ""}[sent.role]
    again = f", try {sent.attempt + 1}" if sent.attempt else ""
    yield f"{what}{sent.kind or 'control'}{number}: {exchange.name(sent.source)} → {to}{again}"
    sending = exchange.sendings.get(sent.message_id)
    frames = f"{sent.count} frames of {sent.size_byte} byte" if sent.count > 1 else f"frame of {sent.size_byte} byte"
    yield f"{frames}, {instant(sent.start_ns)} to {instant(sent.end_ns)} s, {duration(sent.airtime_ns)} on the air"
    yield from _outcomes(exchange, sent.arms)
    if sent.spent_j is not None:
        yield f"the sender's radio drew {energy(sent.spent_j)}"
    if sending is not None and sent.carries_message:
        yield from _of_message(exchange, sending, sent)


def _outcomes(exchange: Exchange, arms: Sequence[Arm]) -> Iterator[str]:
    if not arms:
        yield "nobody it was meant for is shown or in range"
    if len(arms) == 1:
        arm = arms[0]
        yield f"{reason(arm.outcome)} at {exchange.name(arm.node)}{_strength(arm)}"
        return
    by_outcome: dict[str, list[str]] = {}
    for arm in arms:
        by_outcome.setdefault(arm.outcome, []).append(exchange.name(arm.node))
    for outcome, names in by_outcome.items():
        yield f"{reason(outcome)}: {_listed(names)}"


def _strength(arm: Arm) -> str:
    rssi = "" if math.isnan(arm.rssi_dbm) or arm.rssi_dbm == 0.0 else f", {arm.rssi_dbm:.1f} dBm"
    return f"{rssi}, SINR {arm.sinr_db:.1f} dB" if math.isfinite(arm.sinr_db) else rssi


def _of_message(exchange: Exchange, sending: Sending, sent: Transmission) -> Iterator[str]:
    of_round = "" if sending.round is None else f" of round {sending.round}"
    which = f" (this is {sent.part})" if sent.part else ""
    parts = f" in {sending.fragments} fragments{which}" if sending.fragments > 1 else ""
    yield f"message{of_round}: {sending.size_byte} byte{parts}, handed over at {instant(sending.sent_ns)} s"
    if sending.source == sent.source and sent.start_ns > sending.sent_ns:
        yield f"on the air {duration(sent.start_ns - sending.sent_ns)} later"
    arrivals = list(exchange.delivered.get(sending.message_id, {}).values())
    if len(arrivals) == 1:
        event = arrivals[0].event
        hops = f"{event.hops} hop{'' if event.hops == 1 else 's'}"
        yield f"delivered to {exchange.name(event.node)} after {duration(event.latency_ns)}, {hops}"
    elif arrivals:
        yield f"delivered to {len(arrivals)} nodes, last after {duration(max(n.event.latency_ns for n in arrivals))}"
    if sending.causes:
        yield f"caused by {_listed(f'#{cause}' for cause in sending.causes)}"


def round_words(exchange: Exchange, note: Noted[GraphMessages]) -> str:
    """All about a round of a node."""
    event = note.event
    late = f"; {duration(event.late_ns)} late: the processor was busy" if event.late_ns else ""
    which = f"{'round' if event.is_synchronous else 'step'} {event.round}"
    return (
        f"{exchange.name(event.node)}, {which}, {instant(note.time_ns)} s\n"
        f"{event.computed} graph messages computed, {len(event.source)} sent, {int(sum(event.remote))} of them to other "
        f"nodes; largest change {event.largest_change:.3g}{late}"
    )


def note_words(exchange: Exchange, note: Noted[AlgorithmRecord]) -> str:
    """All about what an algorithm noted."""
    event = note.event
    return (
        f"{exchange.name(event.node)} notes {event.kind} at {instant(note.time_ns)} s\n{event.fields_json[:_LONGEST]}"
    )


def drop_words(exchange: Exchange, note: Noted[MessageDropped]) -> str:
    """All about what was given up."""
    event = note.event
    number = f" #{event.message_id}" if event.message_id else ""
    return (
        f"{exchange.name(event.node)} gave up {event.kind}{number} at {instant(note.time_ns)} s: {reason(event.reason)}"
    )


def _listed(names: Iterable[str]) -> str:
    found = list(names)
    rest = f" and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    return ", ".join(found[:_LISTED]) + rest
