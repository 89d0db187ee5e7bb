"""Lines of the log about what befalls the nodes: faults, energy allowances, changes of routes."""

import math
from collections.abc import Callable, Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from netsim.replay.source import Batch
from netsim.trace.events import BROADCAST

Lines = tuple[NDArray[np.int64], Sequence[str], Sequence[str]]
"""Instants, texts and levels."""
Label = Callable[[int], str]

_NAMED = 3  # of more nodes that do the same at the same instant only the number is told
_FAULT_LEVELS = {"ends": "INFO", "strikes": "DEBUG"}  # rules may strike every frame
_BUDGET_LEVELS = {"replenished": "INFO", "ended": "DEBUG"}


def crowd(nodes: Sequence[str]) -> str:
    """Some nodes by name, many by number."""
    return ", ".join(nodes) if len(nodes) <= _NAMED else f"{len(nodes)} nodes"


def fault_lines(batch: Batch, label: Label) -> Lines:
    """Fault rules that begin, end and strike."""
    node, lengths = batch.rows("node")
    nodes = np.split(node, np.cumsum(lengths)[:-1])
    parts = zip(
        batch.numbers("rule").tolist(), batch.texts("kind"), batch.texts("event"), nodes, batch.texts("detail"),
        strict=True,
    )  # fmt: skip
    events = batch.texts("event")
    texts = [
        f"fault {rule} ({kind}) {event}" + _told(detail, [label(int(node)) for node in concerned])
        for rule, kind, event, concerned, detail in parts
    ]
    return batch.time_ns, texts, [_FAULT_LEVELS.get(event, "WARN") for event in events]


def _told(detail: str, nodes: Sequence[str]) -> str:
    """What a rule says of itself; else whom it concerns."""
    return f": {detail}" if detail else f" at {crowd(nodes)}" if nodes else ""


def budget_lines(batch: Batch, label: Label) -> Lines:
    """Allowances that run short, are replenished, or have something refused; tasks that end."""
    parts = zip(
        batch.numbers("node").tolist(), batch.texts("event"), batch.texts("task"), batch.texts("action"),
        batch.numbers("spent_j").tolist(), batch.numbers("allowance_j").tolist(),
        strict=True,
    )  # fmt: skip
    texts = [f"{label(node)}: {_budget_text(*told)}" for node, *told in parts]
    return batch.time_ns, texts, [_BUDGET_LEVELS.get(event, "WARN") for event in batch.texts("event")]


def _budget_text(event: str, task: str, action: str, spent_j: float, allowance_j: float) -> str:
    if event == "ended":
        return f"task {task} took {spent_j:.4g} J"
    limit = f" of {allowance_j:.4g}" if math.isfinite(allowance_j) else ""
    whose = f" of {task}" if task else ""
    return f"energy allowance{whose} {_budget_event(event, action)} ({spent_j:.4g}{limit} J spent)"


def _budget_event(event: str, action: str) -> str:
    if event == "refused":
        return f"refuses {action}" if action else "refuses"
    return f"{event}, policy {action}" if action else event


class RouteLines:
    """Next hops that change, first ones as details; routes of a node that change alike share a line."""

    def __init__(self, label: Label) -> None:
        self._label = label
        self._known: set[tuple[int, int]] = set()

    def __call__(self, batch: Batch) -> Lines:
        """The lines of a batch."""
        node, destination = batch.numbers("node").tolist(), batch.numbers("destination").tolist()
        hops, cost = batch.numbers("next_hop").tolist(), batch.numbers("cost").tolist()
        levels = [self._level(*route) for route in zip(node, destination, hops, strict=True)]
        parts = zip(batch.time_ns.tolist(), node, hops, levels, destination, cost, strict=True)
        groups = [(key, list(group)) for key, group in groupby(parts, key=lambda part: part[:4])]
        texts = [self._text(key[1], key[2], [part[4:] for part in group]) for key, group in groups]
        return np.array([key[0] for key, _ in groups], np.int64), texts, [key[3] for key, _ in groups]

    def _level(self, node: int, destination: int, next_hop: int) -> str:
        if next_hop == BROADCAST:
            return "WARN"
        if (node, destination) in self._known:
            return "INFO"
        self._known.add((node, destination))
        return "DEBUG"

    def _text(self, node: int, next_hop: int, routes: Sequence[tuple[int, float]]) -> str:
        # A tree's node that never had a root knows of none to name.
        to = crowd([self._label(node) if node != BROADCAST else "a sink" for node, _ in routes])
        if next_hop == BROADCAST:
            return f"{self._label(node)}: no route to {to} any more"
        cost = f" (cost {routes[0][1]:.4g})" if len(routes) == 1 else ""
        return f"{self._label(node)}: route to {to} by {self._label(next_hop)}{cost}"
