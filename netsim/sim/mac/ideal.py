"""The ideal MAC: a queue in front of the radio. No contention, no acknowledgement, no retry."""

from typing import Literal

from netsim.parameters import parameters
from netsim.sim.frames import LinkFrame
from netsim.sim.mac.link import Deliver, LinkJob, QueuedMac
from netsim.sim.radio import Radio


@parameters
class IdealMacParameters:
    """Frames go out one after the other, at once; what the medium loses stays lost."""

    type: Literal["ideal"] = "ideal"


class IdealMac(QueuedMac):
    """See `IdealMacParameters`.

    Args:
        radio: This node's radio; the MAC takes over its callbacks.
        deliver: Where received packets go.
    """

    def __init__(self, radio: Radio, deliver: Deliver) -> None:
        super().__init__(radio, most_waiting=None)
        self._deliver = deliver

    def _begin(self, job: LinkJob) -> None:
        node = self._radio.node
        self._radio.transmit(LinkFrame(node, job.destination, 0, False, False, job.packet, job.kind, job.message_id))

    def _on_receive(self, frame: LinkFrame) -> None:
        if frame.is_for(self._radio.node):
            self._deliver(frame.packet, frame.source)

    def _on_transmitted(self, _: LinkFrame) -> None:
        self._finish("", attempts=1)
