"""Wake-up frames of low-power listening, which come by the hundred, as one train each."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from netsim.metrics.causes import Sending
from netsim.sequence.aim import best
from netsim.sequence.records import Transmission


def joined(frames: Iterable[Transmission]) -> list[Transmission]:
    """Transmissions in the order in which they begin; wake-up frames in a row that announce one message are one train.

    A frame of anybody else that is shown ends a train, so that nothing is drawn out of order.
    """
    found: list[Transmission] = []
    for frame in sorted(frames, key=lambda each: (each.start_ns, each.frame_id)):
        if found and _continues(found[-1], frame):
            found[-1] = _longer(found[-1], frame)
        else:
            found.append(frame)
    return found


def numbered(sent: Iterable[Transmission], sendings: Mapping[int, Sending]) -> Iterator[Transmission]:
    """Transmissions with the number of the part that they carry, of messages that were handed over in the window."""
    parts: defaultdict[tuple[int, int, int], int] = defaultdict(int)
    for each in sent:
        sending = sendings.get(each.message_id)
        if not each.carries_message or sending is None or sending.fragments < 2:
            yield each
            continue
        way = each.message_id, each.source, each.destination
        parts[way] += each.role == "data"
        yield replace(each, part=parts[way])


def _continues(train: Transmission, frame: Transmission) -> bool:
    same = train.source, train.message_id, train.destination
    return train.role == frame.role == "strobe" and same == (frame.source, frame.message_id, frame.destination)


def _longer(train: Transmission, frame: Transmission) -> Transmission:
    spent_j = None if train.spent_j is None or frame.spent_j is None else train.spent_j + frame.spent_j
    return replace(
        train,
        end_ns=max(train.end_ns, frame.end_ns),
        arms=best(train.arms, frame.arms),
        aired=train.aired + frame.aired,
        spent_j=spent_j,
        heard=train.heard + frame.heard,
    )
