"""Frames as arrows from sender to listener: in the colour of their kind, red after a collision, grey when lost.

An arrow appears when its frame has ended, for then it is known what became of it, and stays a while. Each message kind has
a topic of its own, so that a viewer can hide it; acknowledgements and wake-up frames too.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from netsim.export.foxglove.shapes import Rgba, arrow, entity
from netsim.export.foxglove.stage import Stage
from netsim.replay import style
from netsim.trace.events import BROADCAST, OUTCOMES, Event, Frame, LinkTable
from netsim.trace.recorder import Handler
from netsim.units import s_to_ns

HOLD_NS = s_to_ns(0.15)
"""How long an arrow stays; true airtimes are too short to be seen."""
_DECODED = ("received", "overheard")
_ALWAYS = ("received", *style.INTERFERENCE)


class Flights:
    """Draws each frame that is exported."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._kinds: dict[str, Rgba] = {}
        self._expected: set[tuple[int, int]] = set()

    def handlers(self) -> Mapping[type[Event], Handler]:
        """Frames, and the links they can be expected to cross."""
        return {Frame: self._on_frame, LinkTable: self._on_links}

    def _on_links(self, event: LinkTable, time_ns: int) -> None:
        good = np.asarray(event.prr) >= style.EXPECTED_PRR
        ends = (np.asarray(each)[good].tolist() for each in (event.source, event.destination))
        self._expected = set(zip(*ends, strict=True))

    def _on_frame(self, frame: Frame, time_ns: int) -> None:
        if not self._stage.job.selection.has_frame(frame) or frame.source not in self._stage.places:
            return
        topic, rgba = self._layer(frame)
        unit_m = self._stage.unit_m
        width_m = (0.08 if frame.is_ack or frame.is_strobe else 0.2) * unit_m
        made = entity(f"{frame.source}", time_ns, lifetime_ns=HOLD_NS, notes=_notes(frame))
        tail = self._stage.places[frame.source]
        for listener, outcome in self._shown(frame):
            shade = rgba if outcome in _DECODED else style.COLLIDED if outcome in style.INTERFERENCE else style.LOST
            made.arrows.append(arrow(tail, self._stage.places[listener], 0.5 * unit_m, width_m, shade))
        self._stage.show(topic, SceneUpdate(entities=[made]), time_ns)

    def _layer(self, frame: Frame) -> tuple[str, Rgba]:
        """The topic of a frame, and its colour."""
        if frame.is_ack:
            return "/scene/acknowledgements", style.ACKNOWLEDGEMENT
        rgba = self._kinds.setdefault(frame.kind, style.kind_colour(len(self._kinds)))
        return f"/scene/{'strobes' if frame.is_strobe else 'messages'}/{frame.kind or 'none'}", rgba

    def _shown(self, frame: Frame) -> Iterator[tuple[int, str]]:
        """The listeners to whom an arrow goes, and what became of the frame there."""
        heard = {int(node): OUTCOMES[code] for node, code in zip(frame.rx_node, frame.rx_outcome, strict=True)}
        if frame.destination != BROADCAST:
            heard = {frame.destination: heard.get(frame.destination, "weak")}
        for listener, outcome in heard.items():
            is_meant = outcome in _ALWAYS or (frame.source, listener) in self._expected
            if listener in self._stage.places and (frame.destination != BROADCAST or is_meant):
                yield listener, outcome


def _notes(frame: Frame) -> dict[str, str]:
    """What a viewer tells of an arrow that is clicked on."""
    reasons = [OUTCOMES[code] for code in frame.rx_outcome]
    counted = ", ".join(f"{reasons.count(name)} {name}" for name in OUTCOMES if name in reasons)
    return {
        "frame": str(frame.frame_id),
        "message": str(frame.message_id),
        "kind": frame.kind,
        "bytes": str(frame.size_byte),
        "attempt": str(frame.attempt),
        "listeners": counted,
    }
