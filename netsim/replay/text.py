"""The log: what is given up and why, who starts, ends and dies, roles, decisions, and lines for people."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import BROADCAST, Association, Log, MessageDropped, NodeLife, Role

_LEVELS = ("TRACE", "DEBUG", "INFO", "WARN", "ERROR", "CRITICAL")
_LIFE_LEVELS = {"failed": "ERROR", "died": "ERROR"}
_Lines = tuple[Sequence[str], Sequence[str]]


class LogTrack:
    """One text log of all that a reader of a log would look for."""

    topics = (Log.topic, MessageDropped.topic, NodeLife.topic, Role.topic, Association.topic)
    past = False

    def __init__(self, setting: Setting) -> None:
        self._label = setting.label
        self._lines: dict[str, Callable[[Batch], _Lines]] = {
            Log.topic: self._log,
            MessageDropped.topic: self._drops,
            NodeLife.topic: self._lives,
            Role.topic: self._roles,
            Association.topic: self._decisions,
        }

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """The lines of a batch."""
        texts, levels = self._lines[batch.topic](batch)
        yield timed("/log", batch.time_ns, rr.TextLog.columns(text=list(texts), level=list(levels)))

    def finish(self) -> Iterator[Chunk]:
        """Nothing."""
        yield from ()

    def _names(self, batch: Batch, field: str) -> list[str]:
        return [self._label(int(node)) if node != BROADCAST else "all" for node in batch.numbers(field)]

    def _log(self, batch: Batch) -> _Lines:
        texts = [f"{name}: {text}" for name, text in zip(batch.texts("name"), batch.texts("message"), strict=True)]
        return texts, [_LEVELS[min(int(level), len(_LEVELS) - 1)] for level in batch.numbers("level")]

    def _drops(self, batch: Batch) -> _Lines:
        parts = zip(
            self._names(batch, "node"),
            batch.texts("kind"),
            batch.numbers("message_id"),
            self._names(batch, "source"),
            self._names(batch, "destination"),
            batch.texts("reason"),
            strict=True,
        )
        texts = [
            f"{node}: gave up {kind} #{number} from {source} to {destination}: {reason.replace('_', ' ')}"
            for node, kind, number, source, destination, reason in parts
        ]
        return texts, ["WARN"] * len(texts)

    def _lives(self, batch: Batch) -> _Lines:
        parts = zip(self._names(batch, "node"), batch.texts("event"), batch.texts("reason"), strict=True)
        texts = [f"{node}: {event}" + (f": {reason}" if reason else "") for node, event, reason in parts]
        return texts, [_LIFE_LEVELS.get(event, "INFO") for event in batch.texts("event")]

    def _roles(self, batch: Batch) -> _Lines:
        parts = zip(self._names(batch, "node"), batch.texts("role"), batch.numbers("holds"), strict=True)
        texts = [f"{node}: {'becomes' if holds else 'is no longer'} {role}" for node, role, holds in parts]
        return texts, ["INFO"] * len(texts)

    def _decisions(self, batch: Batch) -> _Lines:
        target, lengths = batch.rows("target")
        rows = np.split(target, np.cumsum(lengths)[:-1])
        parts = zip(self._names(batch, "node"), batch.numbers("round"), rows, strict=True)
        texts = [f"{node}: round {number}: measurements from targets {_targets(row)}" for node, number, row in parts]
        return texts, ["DEBUG"] * len(texts)


def _targets(row: Iterable[int]) -> str:
    return ", ".join("none" if target < 0 else str(target) for target in row) or "(no measurements)"
