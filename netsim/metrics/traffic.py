"""Communication: messages, frames, bytes and airtime, in total and by message kind."""

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from netsim.trace.events import BROADCAST, OUTCOMES, Frame, MessageDelivered, MessageDropped, MessageSent
from netsim.trace.recorder import Handler
from netsim.units import NS_PER_S

DATA_ROLES = ("data", "retry")
"""Roles of the frames that carry a message or a part of one (see `role_of`)."""


class Traffic:
    """Counts what went over the air."""

    def __init__(self) -> None:
        self._sent: defaultdict[str, int] = defaultdict(int)
        self._sent_byte: defaultdict[str, int] = defaultdict(int)
        self._unicast = 0
        self._delivered: defaultdict[str, int] = defaultdict(int)
        self._delivered_unicast = 0
        self._dropped: defaultdict[str, int] = defaultdict(int)
        self._latency_ns = 0
        self._largest_latency_ns = 0
        self._frames: defaultdict[str, int] = defaultdict(int)
        self._air: defaultdict[str, int] = defaultdict(int)
        self._air_byte: defaultdict[str, int] = defaultdict(int)
        self._airtime_ns: defaultdict[str, int] = defaultdict(int)
        self._broadcasts: set[int] = set()
        self._addressed = 0
        self._lost: defaultdict[str, int] = defaultdict(int)

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {
            MessageSent: self._on_sent,
            MessageDelivered: self._on_delivered,
            MessageDropped: self._on_dropped,
            Frame: self._on_frame,
        }

    def figures(self) -> dict[str, Any]:
        """The metrics; units in the keys."""
        delivered = sum(self._delivered.values())
        frames = sum(self._frames.values())
        received = self._addressed - sum(self._lost.values())
        return {
            "radio_messages": sum(self._sent.values()),
            "radio_messages_by_kind": dict(sorted(self._sent.items())),
            "message_payload_byte": sum(self._sent_byte.values()),
            "message_payload_by_kind_byte": dict(sorted(self._sent_byte.items())),
            "deliveries": delivered,
            "unicasts_undelivered": self._unicast - self._delivered_unicast,
            "delivery_ratio_unicast": self._delivered_unicast / self._unicast if self._unicast else None,
            "drops_by_reason": dict(sorted(self._dropped.items())),
            "latency_mean_s": self._latency_ns / delivered / NS_PER_S if delivered else None,
            "latency_max_s": self._largest_latency_ns / NS_PER_S if delivered else None,
            "frames": frames,
            "frames_data": self._frames["data"],
            "frames_retry": self._frames["retry"],
            "frames_ack": self._frames["ack"],
            "frames_strobe": self._frames["strobe"],
            "frames_by_kind": dict(sorted(self._air.items())),
            "frame_byte": sum(self._air_byte.values()),
            "frame_by_kind_byte": dict(sorted(self._air_byte.items())),
            "airtime_s": sum(self._airtime_ns.values()) / NS_PER_S,
            "airtime_by_kind_s": {kind: time / NS_PER_S for kind, time in sorted(self._airtime_ns.items())},
            "frames_unicast_data": self._addressed,
            "frame_reception_ratio_unicast": received / self._addressed if self._addressed else None,
            "frames_lost_by_reason": dict(sorted(self._lost.items())),
        }

    def _on_sent(self, event: MessageSent, _: int) -> None:
        self._sent[event.kind] += 1
        self._sent_byte[event.kind] += event.size_byte
        if event.destination == BROADCAST:
            self._broadcasts.add(event.message_id)
        else:
            self._unicast += 1

    def _on_delivered(self, event: MessageDelivered, _: int) -> None:
        self._delivered[event.kind] += 1
        self._delivered_unicast += event.message_id not in self._broadcasts
        self._latency_ns += event.latency_ns
        self._largest_latency_ns = max(self._largest_latency_ns, event.latency_ns)

    def _on_dropped(self, event: MessageDropped, _: int) -> None:
        self._dropped[event.reason] += 1

    def _on_frame(self, event: Frame, _: int) -> None:
        role = role_of(event)
        self._frames[role] += 1
        self._air[event.kind] += 1
        self._air_byte[event.kind] += event.size_byte
        self._airtime_ns[event.kind] += event.t_end_ns - event.t_start_ns
        if event.destination != BROADCAST and role in DATA_ROLES:
            self._on_addressed(event)

    def _on_addressed(self, frame: Frame) -> None:
        self._addressed += 1
        outcome = outcome_at_addressee(frame)
        if outcome != "received":
            self._lost[outcome] += 1


def outcome_at_addressee(frame: Frame) -> str:
    """What became of a unicast frame at the node it was sent to; a trace of any detail tells that.

    Returns:
        One of `netsim.trace.events.OUTCOMES`, or `out_of_reach`: so weak there that the medium did not decide about it.
    """
    return outcome_at(frame, frame.destination)


def outcome_at(frame: Frame, node: int) -> str:
    """What became of a frame at a node; `out_of_reach` where the medium did not decide or the trace does not tell it."""
    for listener, outcome in zip(frame.rx_node, frame.rx_outcome, strict=True):
        if listener == node:
            return OUTCOMES[outcome]
    return "out_of_reach"


def role_of(frame: Frame) -> str:
    """What a frame is for: `data` or `retry`, which carry a message, `ack`, or `strobe` of low-power listening."""
    if frame.is_strobe:
        return "strobe"
    return "ack" if frame.is_ack else ("retry" if frame.attempt else "data")
