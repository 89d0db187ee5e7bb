"""The mailbox of a node: messages wait for whoever asks for them, askers wait for messages that fit.

All receive time-outs live here. An asker whose time-out has passed is forgotten before the next message comes, so that
no message is lost to somebody who no longer listens. A message that comes at the very instant of a time-out is received.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from simpy.events import Event as SimEvent

from netsim.api import SERVICE_PREFIX, Message, Op
from netsim.sim.clock import Clock


@dataclass(slots=True, eq=False)
class Asker:
    """Somebody waiting for a message."""

    kinds: Collection[str] | None
    match: Callable[[Message], bool] | None
    event: SimEvent

    def fits(self, message: Message) -> bool:
        """Whether this is a message asked for."""
        kinds, kind = self.kinds, message.kind
        asked_for = kind in kinds if kinds is not None else not kind.startswith(SERVICE_PREFIX)
        return asked_for and (self.match is None or self.match(message))


class Inbox:
    """See the module."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._messages: list[Message] = []
        self._askers: list[Asker] = []

    def clear(self) -> None:
        """Forget everything: the node crashed, and nobody waits any more."""
        self._messages.clear()
        self._askers.clear()

    def deliver(self, message: Message) -> None:
        """A message has arrived: give it to the asker who has waited longest and whom it fits, or keep it."""
        if not self._serve(message):
            self._messages.append(message)

    def _serve(self, message: Message) -> bool:
        for asker in list(self._askers):
            try:
                fits = asker.fits(message)
            except Exception as error:  # the asker's own `match` raised: that is for the asker to hear, not for the air
                self._settle(asker, error)
                continue
            if fits:
                self._settle(asker, message)
                return True
        return False

    def _settle(self, asker: Asker, outcome: Message | Exception | None) -> None:
        self._askers.remove(asker)
        asker.event.succeed(outcome)

    def receive(
        self,
        kinds: Collection[str] | None,
        match: Callable[[Message], bool] | None,
        timeout_ns: int | None,
    ) -> Op[Message | None]:
        """See `NodeHandle.receive`. The oldest waiting message that fits comes first."""
        asker = Asker(kinds, match, self._clock.event())
        for index, message in enumerate(self._messages):
            if asker.fits(message):
                return self._messages.pop(index)
        if timeout_ns is not None and timeout_ns <= 0:
            return None
        self._askers.append(asker)
        if timeout_ns is not None:
            self._clock.call_last(timeout_ns, lambda _: self._give_up(asker))
        try:
            outcome: Message | Exception | None = yield asker.event
        except GeneratorExit:
            self._cancelled(asker)
            raise
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def _give_up(self, asker: Asker) -> None:
        if asker in self._askers:
            self._settle(asker, None)

    def _cancelled(self, asker: Asker) -> None:
        """An asker is gone: forget it, and give to others what it was given at this very instant."""
        if asker in self._askers:
            self._askers.remove(asker)
        elif isinstance(asker.event.value, Message) and not self._serve(asker.event.value):
            self._messages.insert(0, asker.event.value)
