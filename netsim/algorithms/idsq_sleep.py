"""When the radio of a tracking node listens: in a window after every reading instant, and while somebody needs it."""

from collections.abc import Iterator
from contextlib import contextmanager

from netsim.algorithms.idsq_parameters import IdsqSleep
from netsim.api import NodeHandle, Op
from netsim.units import s_to_ns


class Waking:
    """Turns the radio off when nobody needs it; without settings it leaves the radio alone.

    Args:
        node: The node.
        parameters: Windows, if radios are to sleep.
        step_ns: Time between two readings.
    """

    def __init__(self, node: NodeHandle, parameters: IdsqSleep | None, step_ns: int) -> None:
        self._node = node
        self._parameters = parameters
        self._step_ns = step_ns
        self._users = 0
        self._stays_until_ns = 0

    @contextmanager
    def needed(self) -> Iterator[None]:
        """Keep the radio on."""
        self._users += 1
        if self._users == 1 and self._parameters is not None:
            self._node.radio_wake()
        try:
            yield
        finally:
            self._users -= 1
            if self._users == 0 and self._parameters is not None:
                self._node.radio_sleep()

    def stay(self) -> None:
        """Keep the radio on until the next window: a target is near, or an alarm was raised."""
        if self._parameters is not None and self._stays_until_ns <= self._node.now_ns:
            step = self._node.now_ns // self._step_ns + 1
            self._stays_until_ns = step * self._step_ns
            self._node.spawn(self._staying(self._stays_until_ns))

    def _staying(self, until_ns: int) -> Op[None]:
        with self.needed():
            yield from self._node.pause_until(until_ns)

    def windows(self) -> Op[None]:
        """Listen in every window: from shortly before a reading instant on."""
        if self._parameters is None:
            return
        before_ns = s_to_ns(self._parameters.guard_s)
        after_ns = s_to_ns(self._parameters.window_s) + before_ns
        step = self._node.now_ns // self._step_ns
        while True:
            if self._node.now_ns < step * self._step_ns + after_ns:
                with self.needed():
                    yield from self._node.pause_until(step * self._step_ns + after_ns)
            step += 1
            yield from self._node.pause_until(step * self._step_ns - before_ns)
