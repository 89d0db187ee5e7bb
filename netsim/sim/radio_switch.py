"""Who decides whether a node's radio sleeps: its algorithm or its duty cycle wish, its energy budget forbids."""

from netsim.sim.layers import LinkLayer


class RadioSwitch:
    """Passes the last wish on to the MAC, unless the radio is held asleep.

    Args:
        mac: Medium access, which wakes the radio for what is to be sent.
    """

    def __init__(self, mac: LinkLayer) -> None:
        self._mac = mac
        self._wants_sleep = False
        self._is_held = False

    def sleep(self) -> None:
        """Let the radio sleep whenever nothing is to be sent."""
        self._wants_sleep = True
        self._mac.sleep()

    def wake(self) -> None:
        """Keep the radio awake, as soon as it is not held asleep."""
        self._wants_sleep = False
        if not self._is_held:
            self._mac.wake()

    def restart(self) -> None:
        """The node is up again after a crash: nothing is wished any more, and nothing held."""
        self._wants_sleep = False
        self._is_held = False

    def hold(self) -> None:
        """Let it sleep, whatever is wished."""
        self._is_held = True
        self._mac.sleep()

    def release(self) -> None:
        """What is wished counts again."""
        self._is_held = False
        if not self._wants_sleep:
            self._mac.wake()
