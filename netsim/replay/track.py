"""What all parts of a conversion share: the window, the message kinds' colours, and how arrays become Rerun chunks."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.options import Pace, ReplayOptions
from netsim.replay.scene import Scene
from netsim.replay.source import Batch, batches
from netsim.trace.events import MessageSent

TIMELINE = "simulated_time"


class Track(Protocol):
    """Converts the events of some topics, batch by batch."""

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics it wants to see."""
        ...

    @property
    def past(self) -> bool:
        """Whether it wants what was before the window too, because that still holds or is still in the air."""
        ...

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """What a batch adds to the replay."""
        ...

    def finish(self) -> Iterator[Chunk]:
        """What can only be told at the end."""
        ...


@dataclass
class Kinds:
    """Message kinds in the order in which they are met.

    Their colours are by the order in which messages of them were first sent in the run, whatever is shown of it, so that
    pictures of one run agree.
    """

    wanted: frozenset[str] | None
    names: list[str] = field(default_factory=list)
    places: dict[str, int] = field(default_factory=dict)
    """Place of each kind in the order of colours."""
    placed_ns: int = 0
    """Up to when the run has been looked through for kinds."""

    def place(self, trace: Path, end_ns: int) -> None:
        """Look through a trace for kinds of messages sent before an instant, from where that ended last.

        Raises:
            TraceError: If the trace is damaged.
        """
        for batch in batches(trace, [MessageSent.topic], self.placed_ns, end_ns):
            for word in batch.words("kind")[1]:
                self.places.setdefault(word, len(self.places))
        self.placed_ns = max(self.placed_ns, end_ns)

    def numbers(self, words: Iterable[str]) -> NDArray[np.int64]:
        """The number of each kind; -1 for kinds that are not wanted."""
        return np.array([self._number(word) for word in words], np.int64)

    def _number(self, kind: str) -> int:
        self.places.setdefault(kind, len(self.places))
        if self.wanted is not None and kind not in self.wanted:
            return -1
        if kind not in self.names:
            self.names.append(kind)
        return self.names.index(kind)

    def colour(self, number: int) -> style.Rgba:
        """The colour of a kind."""
        return style.kind_colour(self.places[self.names[number]])


@dataclass(frozen=True)
class Setting:
    """What every track needs to know.

    Attributes:
        scene: The still parts.
        pace: Window and steps.
        options: What the user asked for.
        kinds: Message kinds met so far.
        shown: Whether each row of the node table is to be shown.
        drained: Whether some battery is drained so far that what is left is worth a plot.
    """

    scene: Scene
    pace: Pace
    options: ReplayOptions
    kinds: Kinds
    shown: NDArray[np.bool_]
    drained: bool

    def label(self, node: int) -> str:
        """The name of a node id."""
        return self._names.get(node) or f"node {node}"

    @cached_property
    def _names(self) -> dict[int, str]:
        return {int(node): name for node, name in zip(self.scene.nodes.node, self.scene.nodes.name, strict=True)}


def entity(*parts: str) -> str:
    """The path of an entity, whatever characters its parts have."""
    return "".join(f"/{rr.escape_entity_path_part(part)}" for part in parts)


def timed(path: str, time_ns: NDArray[np.int64], columns: Iterable[Any]) -> Chunk:
    """A chunk of rows in simulated time."""
    index = rr.TimeColumn(TIMELINE, duration=time_ns.astype("timedelta64[ns]"))
    return Chunk.from_columns(path, [index], columns)


def scalars(path: str, time_ns: NDArray[np.int64], values: NDArray[Any]) -> Chunk:
    """A chunk of numbers to plot."""
    return timed(path, time_ns, rr.Scalars.columns(scalars=np.asarray(values, np.float64)))


def line_names(batch: Batch) -> NDArray[np.str_]:
    """What the entities of estimates, beliefs and hand-offs are called: by their track, and thread if it has several."""
    parts = zip(batch.numbers("target").tolist(), batch.numbers("thread").tolist(), strict=True)
    return np.array([f"{track}_thread_{thread + 1}" if thread else f"{track}" for track, thread in parts], np.str_)
