"""The log: what is given up and why, who starts, ends and dies, incidents, roles, decisions, and lines for people."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import groupby

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay.incidents import Lines, RouteLines, budget_lines, crowd, fault_lines
from netsim.replay.source import Batch
from netsim.replay.track import Setting, line_names, timed
from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    OUTCOMES,
    Association,
    EnergyBudget,
    Fault,
    Frame,
    Handoff,
    Identity,
    Log,
    MessageDropped,
    NodeLife,
    Role,
    RouteChange,
)

_LEVELS = ("TRACE", "DEBUG", "INFO", "WARN", "ERROR", "CRITICAL")
_FAULTS = "faults["  # how log lines about fault rules are named
_LIFE_LEVELS = {"failed": "ERROR", "died": "ERROR", "crashed": "ERROR"}


class LogTrack:
    """One text log of all that a reader of a log would look for."""

    past = False

    @property
    def topics(self) -> tuple[str, ...]:
        """See `Track.topics`."""
        return (Frame.topic, MessageDropped.topic, *self._lines)

    def __init__(self, setting: Setting) -> None:
        self._label = setting.label
        self._nodes, self._kinds = setting.options.nodes, setting.options.kinds
        self._decided: dict[int, str] = {}
        self._identified: dict[int, int] = {}
        self._dropped: list[Batch] = []
        self._losses: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
        self._lines: dict[str, Callable[[Batch], Lines]] = {
            Log.topic: self._log,
            NodeLife.topic: self._lives,
            Role.topic: self._roles,
            Association.topic: self._decisions,
            Identity.topic: self._identities,
            Handoff.topic: self._handoffs,
            Fault.topic: partial(fault_lines, label=setting.label),
            EnergyBudget.topic: partial(budget_lines, label=setting.label),
            RouteChange.topic: RouteLines(setting.label),
        }

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """The lines of a batch; what was given up waits for the end, since its last frame may be in a later batch."""
        if batch.topic == Frame.topic:
            self._losses.append(_losses(batch))
        elif batch.topic == MessageDropped.topic:
            self._dropped.append(batch.where(self._is_shown(batch)))
        else:
            yield from _chunks(*self._lines[batch.topic](batch))

    def finish(self) -> Iterator[Chunk]:
        """What was given up."""
        outcome_of: dict[int, int] = {}
        if self._dropped:
            for message, outcome in self._losses:
                outcome_of.update(zip(message.tolist(), outcome.tolist(), strict=True))
        for batch in self._dropped:
            yield from _chunks(*self._drops(batch, outcome_of))

    def _is_shown(self, batch: Batch) -> NDArray[np.bool_]:
        """Which messages that were given up are of the kinds, and from, to or at the nodes, that are asked for."""
        shown = np.ones(len(batch.time_ns), bool)
        if self._kinds is not None:
            shown &= np.array([kind in self._kinds for kind in batch.texts("kind")], bool)
        if self._nodes is not None:
            ids = list(self._nodes)
            shown &= np.any([np.isin(batch.numbers(field), ids) for field in ("node", "source", "destination")], axis=0)
        return shown

    def _names(self, batch: Batch, field: str) -> list[str]:
        return [self._label(int(node)) if node != BROADCAST else "all" for node in batch.numbers(field)]

    def _log(self, batch: Batch) -> Lines:
        """Lines for people; those that repeat a fault for other viewers are left to the fault itself."""
        batch = batch.where(np.array([not name.startswith(_FAULTS) for name in batch.texts("name")], bool))
        texts = [f"{name}: {text}" for name, text in zip(batch.texts("name"), batch.texts("message"), strict=True)]
        return batch.time_ns, texts, [_LEVELS[min(int(level), len(_LEVELS) - 1)] for level in batch.numbers("level")]

    def _drops(self, batch: Batch, outcome_of: dict[int, int]) -> Lines:
        parts = zip(
            self._names(batch, "node"),
            batch.texts("kind"),
            batch.numbers("message_id").tolist(),
            self._names(batch, "source"),
            self._names(batch, "destination"),
            batch.texts("reason"),
            strict=True,
        )
        texts = [
            f"{node}: gave up {kind}{f' #{number}' if number else ''}"
            + f"{'' if source == node else f' from {source}'} to {destination}: "
            + reason.replace("_", " ")
            + (_last_frame(outcome_of.get(number)) if reason == "no_ack" else "")
            for node, kind, number, source, destination, reason in parts
        ]
        return batch.time_ns, texts, ["WARN"] * len(texts)

    def _lives(self, batch: Batch) -> Lines:
        """Nodes that do the same at the same instant share a line."""
        parts = zip(
            batch.time_ns.tolist(), batch.texts("event"), batch.texts("reason"), self._names(batch, "node"), strict=True
        )
        groups = [(key, [node for *_, node in group]) for key, group in groupby(parts, key=lambda part: part[:3])]
        texts = [f"{crowd(nodes)} {event}" + (f": {reason}" if reason else "") for (_, event, reason), nodes in groups]
        levels = [_LIFE_LEVELS.get(event, "INFO") for (_, event, _), _ in groups]
        return np.array([time_ns for (time_ns, *_), _ in groups], np.int64), texts, levels

    def _roles(self, batch: Batch) -> Lines:
        parts = zip(self._names(batch, "node"), batch.texts("role"), batch.numbers("holds"), strict=True)
        texts = [
            f"{node}: {'becomes' if holds else 'is no longer'} {role.replace('leader ', 'leader of track ')}"
            for node, role, holds in parts
        ]
        return batch.time_ns, texts, ["INFO"] * len(texts)

    def _handoffs(self, batch: Batch) -> Lines:
        parts = zip(
            self._names(batch, "node"),
            line_names(batch).tolist(),
            self._names(batch, "destination"),
            batch.rows("candidate")[1].tolist(),
            batch.numbers("payload_byte").tolist(),
            strict=True,
        )
        texts = [
            f"{node}: hands track {track.replace('_', ' ')} to {chosen}, chosen among {count} ({size_byte} byte)"
            for node, track, chosen, count, size_byte in parts
        ]
        return batch.time_ns, texts, ["INFO"] * len(texts)

    def _decisions(self, batch: Batch) -> Lines:
        """Which targets a node's measurements came from, when it thinks otherwise than before."""
        target, lengths = batch.rows("target")
        rows = np.split(target, np.cumsum(lengths)[:-1])
        changed: list[tuple[int, str]] = []
        for time_ns, node, row in zip(batch.time_ns.tolist(), batch.numbers("node").tolist(), rows, strict=True):
            decision = ", ".join("none" if number < 0 else str(number) for number in row.tolist())
            if decision != self._decided.get(node, ""):
                self._decided[node] = decision
                changed.append((time_ns, f"{self._label(node)} decides its measurements' targets: {decision}"))
        times = np.array([time_ns for time_ns, _ in changed], np.int64)
        return times, [text for _, text in changed], ["INFO"] * len(changed)

    def _identities(self, batch: Batch) -> Lines:
        """Whom a node takes a track for, when nobody did before."""
        flat, lengths = batch.rows("probability")
        tracks, nodes = batch.numbers("track").tolist(), batch.numbers("node").tolist()
        changed: list[tuple[int, str]] = []
        for time_ns, node, track, row in zip(
            batch.time_ns.tolist(), nodes, tracks, np.split(flat, np.cumsum(lengths)[:-1]), strict=True
        ):
            best = int(np.argmax(row)) if len(row) else -1
            if best >= 0 and self._identified.get(track) != best:
                self._identified[track] = best
                chance = f"{100 * row[best]:.0f} %"
                changed.append((time_ns, f"{self._label(node)} takes track {track} for target {best} ({chance})"))
        times = np.array([time_ns for time_ns, _ in changed], np.int64)
        return times, [text for _, text in changed], ["INFO"] * len(changed)


def _chunks(time_ns: NDArray[np.int64], texts: Sequence[str], levels: Sequence[str]) -> Iterator[Chunk]:
    """An entity a level: of an entity with several levels Rerun 0.41 shows wrong ones, such as INFO for a death."""
    for level in sorted(set(levels)):
        mine = np.array([number for number, other in enumerate(levels) if other == level])
        lines = rr.TextLog.columns(text=[texts[number] for number in mine], level=[level] * len(mine))
        yield timed(f"/log/{level.lower()}", time_ns[mine], lines)


def _losses(batch: Batch) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Message and outcome of the frames with data that did not arrive where they were sent to."""
    listener, lengths = batch.rows("rx_node")
    frame = np.repeat(np.arange(len(lengths)), lengths)
    outcome = batch.rows("rx_outcome")[0]
    mine = (listener == batch.numbers("destination")[frame]) & (outcome != OUTCOME_CODE["received"])
    mine &= ~(batch.flags("is_ack") | batch.flags("is_strobe"))[frame]
    return batch.numbers("message_id")[frame[mine]].astype(np.int64), outcome[mine].astype(np.int64)


def _last_frame(outcome: int | None) -> str:
    return "" if outcome is None else f" (last loss: {OUTCOMES[outcome].replace('_', ' ')})"
