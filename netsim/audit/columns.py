"""Arrays of an event as plain lists, and small memories by number."""

from collections.abc import Sequence
from typing import Any

import numpy as np


def plain(values: Any) -> list[Any]:
    """The elements of a field as Python's own numbers or strings."""
    return list(values.tolist()) if isinstance(values, np.ndarray) else list(values)


class Marks:
    """Whether a message was marked at a node: one bit a message and node, grown message by message.

    Args:
        nodes: Node ids; no others can be marked.
    """

    def __init__(self, nodes: Sequence[int]) -> None:
        self._bit = {node: (index >> 3, 1 << (index & 7)) for index, node in enumerate(nodes)}
        self._width = (len(self._bit) + 7) // 8
        self._bits = bytearray()

    def grow(self, rows: int) -> None:
        """Make room for messages below `rows`."""
        missing = rows * self._width - len(self._bits)
        if missing > 0:
            self._bits.extend(bytes(missing))

    def mark(self, row: int, node: int) -> bool:
        """Mark a message at a node; returns whether it was marked before. Unknown ones are never marked."""
        place = self._place(row, node)
        if place is None:
            return False
        at, bit = place
        was = bool(self._bits[at] & bit)
        self._bits[at] |= bit
        return was

    def has(self, row: int, node: int) -> bool:
        """Whether a message is marked at a node."""
        place = self._place(row, node)
        return place is not None and bool(self._bits[place[0]] & place[1])

    def clear(self, node: int) -> None:
        """Unmark all messages at a node."""
        if node in self._bit and self._bits:
            at, bit = self._bit[node]
            column = np.frombuffer(self._bits, np.uint8)[at :: self._width]
            column &= np.uint8(255 - bit)

    def _place(self, row: int, node: int) -> tuple[int, int] | None:
        byte, bit = self._bit.get(node, (0, 0))
        at = row * self._width + byte
        return (at, bit) if bit and 0 <= at < len(self._bits) else None
