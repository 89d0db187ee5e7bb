"""What it takes to keep identities of tracks: evidence, words between leaders, and what became of them."""

import json
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from netsim.trace.events import AlgorithmRecord, MessageSent
from netsim.trace.recorder import Handler

RECORD: Final = "identity"
WORD: Final = "word"
KINDS: Final = frozenset({WORD, "heard", "register", "registered", "locate", "located"})
"""Kinds of the messages between leaders that are acquainted, and with rendezvous."""


class IdentityWords:
    """Counts what leaders record and say of identities."""

    def __init__(self) -> None:
        self._events: Counter[str] = Counter()
        self._messages: Counter[str] = Counter()
        self._byte = 0
        self._largest = 0

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {AlgorithmRecord: self._on_record, MessageSent: self._on_sent}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where nobody recorded anything of identities."""
        if not self._events:
            return {}
        return {
            "identity_meetings": self._events["met"],
            "identity_group_largest": self._largest,
            "identity_evidence": self._events["evidence"],
            "identity_evidence_refused": self._events["refused"],
            "identity_contradictions": self._events["contradicted"],
            "identity_words": self._messages[WORD],
            "identity_words_unanswered": self._events["unanswered"],
            "identity_messages": self._messages.total(),
            "identity_messages_byte": self._byte,
        }

    def _on_record(self, event: AlgorithmRecord, _: int) -> None:
        if event.kind == RECORD:
            fields = json.loads(event.fields_json)
            self._events[fields["event"]] += 1
            self._largest = max(self._largest, len(fields["group"]))

    def _on_sent(self, event: MessageSent, _: int) -> None:
        if event.kind in KINDS:
            self._messages[event.kind] += 1
            self._byte += event.size_byte
