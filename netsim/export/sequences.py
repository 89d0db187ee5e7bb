"""Data sequence numbers of frames, which a trace does not keep, from what it does keep."""

from dataclasses import dataclass

from netsim.trace.events import Frame

_MOST_ATTEMPTS = 255  # attempts are counted up to here


@dataclass(slots=True)
class _Sender:
    sequence: int
    last: Frame


class SequenceNumbers:
    """Numbers the frames of each sender as its MAC does: one number a frame and all its repetitions, modulo 256.

    The numbers of each sender begin with 0 at the first frame seen, where a MAC begins anywhere; and a frame that found the
    channel busy until it was given up took a number, but was never on the air. An acknowledgement has the number of the last
    frame from its destination to its source. Frames are to be given in the order in which they were recorded.
    """

    def __init__(self) -> None:
        self._senders: dict[int, _Sender] = {}
        self._last: dict[tuple[int, int], int] = {}

    def of(self, frame: Frame) -> int:
        """The number of the next frame."""
        if frame.is_ack:
            return self._last.get((frame.destination, frame.source), 0)
        sender = self._senders.get(frame.source)
        if sender is None:
            sender = self._senders[frame.source] = _Sender(0, frame)
        elif _is_new(sender.last, frame):
            sender.sequence = (sender.sequence + 1) % 256
        sender.last = frame
        self._last[frame.source, frame.destination] = sender.sequence
        return sender.sequence


def _is_new(before: Frame, frame: Frame) -> bool:
    """Whether a frame is no repetition of the one its sender sent before, nor the one that this announced."""
    if (before.message_id, before.kind) != (frame.message_id, frame.kind) or frame.attempt < before.attempt:
        return True
    if not before.is_strobe and not frame.is_strobe and frame.destination != before.destination:
        return True
    return frame.attempt == before.attempt and not before.is_strobe and frame.attempt < _MOST_ATTEMPTS
