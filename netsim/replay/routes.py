"""The routes towards the sinks, as the nodes choose them: a line from each node to its next hop."""

from collections.abc import Iterator

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from netsim.replay import style
from netsim.replay.lives import changes, is_down
from netsim.replay.scene import static
from netsim.replay.source import Batch
from netsim.replay.track import Setting, timed
from netsim.trace.events import BROADCAST, NodeLife, RouteChange

_MOST_ROWS = 300  # the lines are drawn anew at no more instants than about this
_GONE = -1


class RouteTrack:
    """Lines to next hops; those of a node that goes down are gone."""

    topics = (RouteChange.topic, NodeLife.topic)
    past = True

    def __init__(self, setting: Setting) -> None:
        self._scene = setting.scene
        self._pace = setting.pace
        pairs = zip(setting.scene.nodes.node, setting.scene.nodes.role, strict=True)
        self._sinks = {int(node) for node, role in pairs if role == "sink"} | {BROADCAST}
        self._steps: list[tuple[int, int, int, int]] = []
        """Instant, row of the node, destination, row of the next hop or `_GONE`; of no node for moves."""

    def take(self, batch: Batch) -> Iterator[Chunk]:
        """Keep them; the lines are drawn at the end."""
        if batch.topic == NodeLife.topic:
            down = [(at_ns, row) for at_ns, row, event in changes(batch, self._scene) if is_down(event)]
            self._steps += [(at_ns, row, _GONE, _GONE) for at_ns, row in down]
        else:
            rows, hops = (self._scene.rows(batch.numbers(name)).tolist() for name in ("node", "next_hop"))
            parts = zip(batch.time_ns.tolist(), rows, batch.numbers("destination").tolist(), hops, strict=True)
            self._steps += [part for part in parts if part[2] in self._sinks and part[1] >= 0]
        yield from ()

    def finish(self) -> Iterator[Chunk]:
        """One row of lines an instant."""
        if not any(hop != _GONE for *_, hop in self._steps):
            return
        shown = self._shown()
        look = rr.LineStrips2D.from_fields(colors=[style.ROUTE], radii=[-1.1], draw_order=style.ORDER["routes"])
        yield static("/map/routes", look)
        instants = np.array(sorted(shown), np.int64)
        lengths = np.array([len(shown[time_ns]) for time_ns in instants.tolist()], np.int64)
        pairs = np.array([pair for time_ns in instants.tolist() for pair in shown[time_ns]], np.int64).reshape(-1, 2)
        times = np.repeat(instants, lengths)
        ends = np.stack([self._scene.motion.places(rows, times) for rows in pairs.T], axis=1)
        yield timed("/map/routes", instants, rr.LineStrips2D.columns(strips=list(ends)).partition(lengths))

    def _shown(self) -> dict[int, list[tuple[int, int]]]:
        """The lines from each instant on; what follows closely is drawn at once."""
        motion, pace = self._scene.motion, self._pace
        moves = [] if motion.is_still else motion.instants(pace, _MOST_ROWS).tolist()
        steps = sorted([*self._steps, *((time_ns, _GONE, _GONE, _GONE) for time_ns in moves)], key=lambda step: step[0])
        step_ns = max(1, (pace.end_ns - pace.start_ns) // _MOST_ROWS) if len(steps) > _MOST_ROWS else 1
        hops: dict[tuple[int, int], int] = {}
        shown: dict[int, list[tuple[int, int]]] = {}
        for time_ns, row, destination, hop in steps:
            _follow(hops, row, destination, hop)
            shown[max(-(-time_ns // step_ns) * step_ns, pace.start_ns)] = sorted(
                {(node, next_hop) for (node, _), next_hop in hops.items()}
            )
        return shown


def _follow(hops: dict[tuple[int, int], int], row: int, destination: int, hop: int) -> None:
    """Take a step into account."""
    if hop != _GONE:
        hops[row, destination] = hop
    elif destination != _GONE:
        hops.pop((row, destination), None)
    else:
        for key in [key for key in hops if key[0] == row]:
            del hops[key]
