"""Link gains and noise floors from a file of TOSSIM's topology generator.

Lines of `gain SOURCE LISTENER dB` and `noise NODE FLOOR_dBm SD_dB`, separated by blanks or tabs; empty lines and those that
begin with `#` are skipped. Source: TinyOS, tos/lib/tossim (`sim_gain`, the USC link-layer model).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from netsim.errors import Finding, ScenarioError
from netsim.reading.reasons import is_gzip, why_unreadable


@dataclass(frozen=True, slots=True, eq=False)
class GainFile:
    """What a file says.

    Attributes:
        source: (M,) ids of the senders of its gains, in the file's order.
        destination: (M,) ids of the listeners.
        gain_db: (M,) received power over the sender's nominal output power.
        noise: By node id: noise floor in dBm and its standard deviation in dB.
        nodes: Ids of all nodes it knows.
    """

    source: NDArray[np.int64]
    destination: NDArray[np.int64]
    gain_db: NDArray[np.float64]
    noise: Mapping[int, tuple[float, float]]
    nodes: frozenset[int]


def read_gains(path: Path) -> GainFile:
    """Read a file of gains and noise floors.

    Raises:
        ScenarioError: With file, line, what was expected and what was found: no such file, no gain in it, other lines, ids
            that are no whole numbers, numbers that are not finite, a link or a node's noise given twice.
    """
    lines = _Lines(path)
    gains: dict[tuple[int, int], float] = {}
    noise: dict[int, tuple[float, float]] = {}
    for words in lines:
        if words[0] == "gain" and len(words) == 4:
            pair = lines.node(words[1]), lines.node(words[2])
            if pair in gains or pair[0] == pair[1]:
                lines.refuse("each link between two nodes once", f"{pair[0]} to {pair[1]}")
            gains[pair] = lines.number(words[3])
        elif words[0] == "noise" and len(words) == 4:
            node = lines.node(words[1])
            if node in noise:
                lines.refuse("the noise of each node once", f"node {node} again")
            noise[node] = lines.number(words[2]), lines.number(words[3], 0.0)
        else:
            lines.refuse("`gain SOURCE LISTENER dB` or `noise NODE FLOOR_dBm SD_dB`", f"`{' '.join(words)[:60]}`")
    if not gains:
        lines.refuse("at least one line `gain SOURCE LISTENER dB`", "none")
    ids = np.array(list(gains), np.int64)
    nodes = frozenset(ids.ravel().tolist()) | frozenset(noise)
    return GainFile(ids[:, 0], ids[:, 1], np.array(list(gains.values())), noise, nodes)


class _Lines:
    """The words of each line, and the line for error messages."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._line = 1
        try:
            self._text = path.read_text(encoding="utf-8-sig")
        except (OSError, ValueError) as error:
            remedy = "check the path and the format"
            if is_gzip(path):
                remedy = "unpack it: a file of the format `k7` may be packed, one of `tossim` may not"
            self.refuse("a text file of gains", why_unreadable(path, error), remedy, error)

    def __iter__(self) -> Iterator[list[str]]:
        for number, line in enumerate(self._text.splitlines(), start=1):
            self._line = number
            words = line.split()
            if words and not words[0].startswith("#"):
                yield words

    def node(self, word: str) -> int:
        """A node id."""
        if not (word.isascii() and word.isdigit()):
            self.refuse("a node id, a whole number of 0 or more", f"`{word}`")
        return int(word)

    def number(self, word: str, low: float = -1e3) -> float:
        """A number of decibels."""
        try:
            value = float(word)
        except ValueError:
            value = float("nan")
        if not low <= value <= 1e3:
            self.refuse("a number of decibels" if low < 0 else "a number of decibels of 0 or more", f"`{word}`")
        return value

    def refuse(self, expected: str, got: str, remedy: str = "", cause: Exception | None = None) -> NoReturn:
        """Stop here."""
        raise ScenarioError([Finding(str(self._path), self._line, "", expected, got, remedy)]) from cause
