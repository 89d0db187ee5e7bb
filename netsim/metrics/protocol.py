"""What message passing did against loss and against the death of a host."""

import json
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from netsim.trace.events import AlgorithmRecord
from netsim.trace.recorder import Handler

NOTICES = "notices"
REHOSTED = "rehosted"
STEPPED_DOWN = "stepped-down"


class Conversations:
    """Counts what nodes record of their notices and of variables that moved."""

    def __init__(self) -> None:
        self._notices: defaultdict[str, int] = defaultdict(int)
        self._moves: defaultdict[str, int] = defaultdict(int)

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {AlgorithmRecord: self._on_record}

    def figures(self) -> dict[str, Any]:
        """The metrics; each group is missing where nothing of it was recorded."""
        figures: dict[str, Any] = {}
        if self._notices:
            figures |= {
                "notices_missed": self._notices["missed"],
                "repeats_asked": self._notices["asked"],
                "repeats_sent": self._notices["answered"],
            }
        if self._moves:
            figures |= {"rehostings": self._moves[REHOSTED], "hosts_stepped_down": self._moves[STEPPED_DOWN]}
        return figures

    def _on_record(self, event: AlgorithmRecord, _: int) -> None:
        if event.kind == NOTICES:
            for name, count in json.loads(event.fields_json).items():
                self._notices[name] += int(count)
        elif event.kind in (REHOSTED, STEPPED_DOWN):
            self._moves[event.kind] += 1
