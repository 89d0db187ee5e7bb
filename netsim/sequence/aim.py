"""For whom a frame was: the receivers that a chart draws an arrow to."""

from collections.abc import Collection, Iterator, Mapping

from netsim.metrics.traffic import role_of
from netsim.replay import style
from netsim.sequence.powers import PowerKey, power_key
from netsim.sequence.records import RECEIVED, Arm, Span, Transmission
from netsim.trace.events import BROADCAST, OUTCOMES, Frame, LinkTable, NodePositions
from netsim.units import NS_PER_S

OVERHEAR = "overhear"
"""State of a radio that takes in a frame for somebody else; it is drawn as receiving, but fainter."""
TAKEN_IN = {"received": "receive", "overheard": OVERHEAR} | {
    name: name for name in (*style.INTERFERENCE, "outage", "corrupted")
}
"""State of a listener's radio while a frame of each outcome is on the air; of other outcomes it took in nothing."""


class Aim:
    """Chooses the receivers to show, as the replay does.

    Of a unicast frame that is the addressee, whatever became of it there; of a broadcast those who received it, those who
    lost it to another signal, and those who lost it over a good link. Links of nodes that have moved are not known any more.

    Args:
        nodes: Show frames from and to these nodes only; None for all.
        powers_w: What radios draw; see `radio_powers_w`.
    """

    def __init__(self, nodes: Collection[int] | None, powers_w: Mapping[PowerKey, float]) -> None:
        self._nodes = nodes
        self._powers_w = powers_w
        self._good: set[tuple[int, int]] = set()

    def learn(self, event: LinkTable | NodePositions) -> None:
        """Note which links are good; those of nodes that move are forgotten."""
        if isinstance(event, LinkTable):
            rows = zip(event.source, event.destination, event.prr, strict=True)
            self._good = {(int(source), int(to)) for source, to, prr in rows if prr >= style.EXPECTED_PRR}
        else:
            moved = set(map(int, event.node))
            self._good = {ends for ends in self._good if moved.isdisjoint(ends)}

    def transmission(self, frame: Frame) -> Transmission | None:
        """A frame as it is drawn; None if it is between nodes that nobody asked for."""
        listened = list(_listened(frame))
        arms = tuple(arm for arm in self._meant(frame, listened) if self._is_asked_for(frame.source, arm.node))
        if not arms and not self._is_asked_for(frame.source, frame.source):
            return None
        role, airtime_ns = role_of(frame), frame.t_end_ns - frame.t_start_ns
        power_w = self._powers_w.get(power_key(frame.source, role, frame.kind))
        return Transmission(
            frame_id=frame.frame_id,
            start_ns=frame.t_start_ns,
            end_ns=frame.t_end_ns,
            source=frame.source,
            destination=frame.destination,
            kind=frame.kind,
            role=role,
            size_byte=frame.size_byte,
            attempt=frame.attempt,
            message_id=frame.message_id,
            arms=arms,
            aired=((frame.t_start_ns, frame.t_end_ns),),
            spent_j=None if power_w is None else power_w * airtime_ns / NS_PER_S,
            heard=tuple(_heard(frame, listened)),
        )

    def _is_asked_for(self, source: int, node: int) -> bool:
        return self._nodes is None or source in self._nodes or node in self._nodes

    def _meant(self, frame: Frame, listened: list[Arm]) -> Iterator[Arm]:
        if frame.destination != BROADCAST:
            there = [arm for arm in listened if arm.node == frame.destination]
            yield from there or [Arm(frame.destination, "out_of_reach", float("nan"), float("nan"))]
            return
        for arm in listened:
            if arm.is_received or arm.is_interfered or (frame.source, arm.node) in self._good:
                yield arm


def _listened(frame: Frame) -> Iterator[Arm]:
    columns = (frame.rx_node, frame.rx_outcome, frame.rx_rssi_dbm, frame.rx_sinr_db)
    for node, outcome, rssi_dbm, sinr_db in zip(*columns, strict=True):
        yield Arm(int(node), OUTCOMES[outcome], float(rssi_dbm), float(sinr_db))


def _heard(frame: Frame, listened: list[Arm]) -> Iterator[Span]:
    for arm in listened:
        if arm.outcome in TAKEN_IN:
            yield Span(arm.node, TAKEN_IN[arm.outcome], frame.t_start_ns, frame.t_end_ns)


def best(first: tuple[Arm, ...], then: tuple[Arm, ...]) -> tuple[Arm, ...]:
    """The arms of two frames that say the same: a node that received one of them received it."""
    arms = {arm.node: arm for arm in first}
    for arm in then:
        known = arms.get(arm.node)
        if known is None or known.outcome != RECEIVED:
            arms[arm.node] = arm
    return tuple(arms.values())
