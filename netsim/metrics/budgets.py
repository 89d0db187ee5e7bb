"""Energy allowances: how often they ran short, what was refused, and what tasks drew."""

from collections import Counter, defaultdict
from collections.abc import Mapping
from math import fsum
from typing import Any

from netsim.trace.events import EnergyBudget
from netsim.trace.recorder import Handler


class Budgets:
    """Counts over all nodes; no figures where there was neither an allowance used up nor a task."""

    def __init__(self) -> None:
        self._events: Counter[str] = Counter()
        self._refused: Counter[str] = Counter()
        self._short: set[int] = set()
        self._tasks_j: defaultdict[str, list[float]] = defaultdict(list)

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {EnergyBudget: self._on_budget}

    def figures(self) -> dict[str, Any]:
        """The metrics; units in the keys."""
        if not self._events:
            return {}
        return {
            "energy_allowance_short": self._events["short"],
            "energy_allowance_short_nodes": len(self._short),
            "energy_refused": dict(sorted(self._refused.items())),
            "energy_by_task_j": {name: fsum(joules) for name, joules in sorted(self._tasks_j.items())},
        }

    def _on_budget(self, event: EnergyBudget, _: int) -> None:
        self._events[event.event] += 1
        if event.event == "short":
            self._short.add(event.node)
        elif event.event == "refused":
            self._refused[event.action] += 1
        elif event.event == "ended":
            self._tasks_j[event.task].append(event.spent_j)
