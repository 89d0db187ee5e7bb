"""Curves: messages a second, graph messages a round, and how many decisions are right."""

from collections import defaultdict
from collections.abc import Iterator

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, entity, scalars
from netsim.trace.events import Association, GraphMessages, MessageSent, TruthOrigins

_ROUND_CURVES = {
    "variables that sent": style.MOST,
    "graph messages": style.MEAN,
    "graph messages over the air": style.KIND_COLOURS[0],
}


class RateTrack:
    """Messages a second, by kind."""

    topics = (MessageSent.topic,)
    past = False

    def __init__(self, setting: Setting) -> None:
        self._setting = setting
        self._before = len(setting.kinds.names)
        self._counts: defaultdict[int, defaultdict[int, int]] = defaultdict(lambda: defaultdict(int))

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Count; the bars are told at the end."""
        codes, words = batch.words("kind")
        kind = self._setting.kinds.numbers(words)[codes]
        mine = self._setting.shown[self._setting.scene.rows(batch.numbers("source"))] & (kind >= 0)
        pace = self._setting.pace
        keys = np.column_stack([kind, (batch.time_ns - pace.first_bar_ns) // pace.bin_ns])[mine]
        for (number, slot), count in zip(*np.unique(keys, axis=0, return_counts=True), strict=True):
            self._counts[int(number)][int(slot)] += int(count)
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One curve a kind, with the zeros between."""
        pace = self._setting.pace
        first_ns = pace.first_bar_ns
        slots = np.arange((pace.start_ns - first_ns) // pace.bin_ns, -(-(pace.end_ns - first_ns) // pace.bin_ns))
        # Of a kind that was met before this window, silence is told too.
        for number in sorted({*self._counts, *range(self._before)}):
            counts = self._counts[number]
            name = self._setting.kinds.names[number]
            rate = np.array([counts.get(int(slot), 0) for slot in slots]) / (pace.bin_ns / 1e9)
            path = entity("plots", "messages", name)
            look = rr.SeriesLines(
                colors=[self._setting.kinds.colour(number)],
                names=[name],
                widths=[2.0],
                interpolation_mode=rr.components.InterpolationMode.StepAfter,
            )
            yield static(path, look)
            yield scalars(path, first_ns + slots * pace.bin_ns, rate)


class RoundTrack:
    """What was sent in each round: variables that sent, graph messages, and those that went over the air."""

    topics = (GraphMessages.topic,)
    past = True  # nodes that count for themselves end a round at different instants

    def __init__(self, setting: Setting) -> None:
        self._start_ns = setting.pace.start_ns
        # A round's last instant, variables that sent, messages, messages over the air.
        self._totals: defaultdict[int, NDArray[np.int64]] = defaultdict(lambda: np.zeros(4, np.int64))

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Add up; the curves are told at the end."""
        remote, messages = batch.rows("remote")
        source, _ = batch.rows("source")
        event = np.repeat(np.arange(len(messages)), messages)
        aired = np.bincount(event, remote != 0, len(messages))
        # A variable lives on one node and a node tells of a round once, so no variable is counted twice.
        senders = np.bincount(np.unique(np.column_stack([event, source]), axis=0)[:, 0], minlength=len(messages))
        table = np.column_stack([senders, messages, aired]).astype(np.int64)
        for number, time_ns, row in zip(batch.numbers("round"), batch.time_ns, table, strict=True):
            total = self._totals[int(number)]
            total[0] = max(total[0], time_ns)
            total[1:] += row
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """Three curves over the rounds, each round at its last instant."""
        rounds = [self._totals[number] for number in sorted(self._totals)]
        table = np.array([each for each in rounds if each[0] >= self._start_ns])
        if not len(table):
            return
        for column, (name, colour) in enumerate(_ROUND_CURVES.items(), start=1):
            path = f"/plots/senders/{name.replace(' ', '_')}"
            yield static(path, rr.SeriesLines(colors=[colour], names=[name], widths=[2.0]))
            yield scalars(path, table[:, 0], table[:, column])


class AccuracyTrack:
    """The fraction of measurements that are rightly assigned, over all nodes that have decided."""

    topics = (TruthOrigins.topic, Association.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._start_ns = setting.pace.start_ns
        self._truth: dict[int, NDArray[np.int64]] = {}
        self._decided: list[tuple[int, int, NDArray[np.int64]]] = []

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep truth and decisions; they are compared at the end."""
        target, lengths = batch.rows("target")
        rows = np.split(target.astype(np.int64), np.cumsum(lengths)[:-1])
        for time_ns, node, row in zip(batch.time_ns, batch.numbers("node"), rows, strict=True):
            if batch.topic == TruthOrigins.topic:
                self._truth[int(node)] = row
            else:
                self._decided.append((int(time_ns), int(node), row))
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One curve."""
        right: dict[int, tuple[int, int]] = {}
        curve: dict[int, float] = {}
        for time_ns, node, row in self._decided:
            truth = self._truth.get(node)
            if truth is not None and len(truth) == len(row):
                right[node] = int((truth == row).sum()), len(row)
            total = sum(count for _, count in right.values())
            if total:  # what was decided before the window holds at its start
                curve[max(time_ns, self._start_ns)] = sum(count for count, _ in right.values()) / total
        if curve:
            look = rr.SeriesLines(colors=[style.MOST], names=["rightly assigned"], widths=[2.0])
            yield static("/plots/accuracy", look)
            yield scalars("/plots/accuracy", np.array(list(curve), np.int64), np.array(list(curve.values())))
