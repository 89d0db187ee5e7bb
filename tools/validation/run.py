"""Runs a scenario that is given as text."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.trace.events import EVENT_TYPES, Event
from netsim.trace.recorder import Handler, Observer


class Log:
    """Every event with its time."""

    def __init__(self) -> None:
        self.events: list[tuple[int, Any]] = []

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Observer.handlers`."""
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))

    def of(self, kind: type[Any]) -> list[tuple[int, Any]]:
        """The events of a kind."""
        return [(time_ns, event) for time_ns, event in self.events if isinstance(event, kind)]


def run(scenario: str, observers: Sequence[Observer], files: Mapping[str, str | Path] | None = None) -> None:
    """Run a scenario with the files it names: their text, or where they lie."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, content in (files or {}).items():
            if isinstance(content, Path):
                (folder / file).symlink_to(content.resolve())
            else:
                (folder / file).write_text(content, encoding="utf-8")
        (folder / "scenario.yaml").write_text(scenario, encoding="utf-8")
        simulation = build(load(folder / "scenario.yaml"), observers).simulation
        simulation.run()
        simulation.conclude()
