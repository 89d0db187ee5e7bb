"""Who decides whether a node's radio sleeps: its algorithm or its duty cycle wish, its energy budget forbids."""

from collections.abc import Callable

from netsim.sim.layers import LinkLayer


class RadioSwitch:
    """Passes the last wish on to the MAC, unless the radio is held asleep. While the node is down nothing counts.

    Args:
        mac: Medium access, which wakes the radio for what is to be sent.

    Attributes:
        on_restart: Called when the node is up again, to wish anew.
    """

    def __init__(self, mac: LinkLayer) -> None:
        self._mac = mac
        self._wants_sleep = False
        self._is_held = False
        self._is_down = False
        self.on_restart: Callable[[], None] = lambda: None

    def sleep(self) -> None:
        """Let the radio sleep whenever nothing is to be sent."""
        if not self._is_down:
            self._wants_sleep = True
            self._mac.sleep()

    def wake(self) -> None:
        """Keep the radio awake, as soon as it is not held asleep."""
        if self._is_down:
            return
        self._wants_sleep = False
        if not self._is_held:
            self._mac.wake()

    def stop(self) -> None:
        """The node is down."""
        self._is_down = True

    def restart(self) -> None:
        """The node is up again after a crash: nothing is held, and nothing wished but what `on_restart` wishes."""
        self._is_down = False
        self._wants_sleep = False
        self._is_held = False
        self.on_restart()

    def hold(self) -> None:
        """Let it sleep, whatever is wished."""
        if not self._is_down:
            self._is_held = True
            self._mac.sleep()

    def release(self) -> None:
        """What is wished counts again."""
        self._is_held = False
        if not self._wants_sleep and not self._is_down:
            self._mac.wake()
