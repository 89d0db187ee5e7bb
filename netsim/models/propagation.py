"""Gains between nodes that may move: what a pair was drawn stays with the pair, what depends on distance follows.

The static shadowing of a pair, its asymmetry and each node's hardware belong to the nodes, not to places, so a node that
moves takes them along: along a way the shadowing does not vary as it would among real obstacles.
"""

from collections.abc import Sequence

import numpy as np

from netsim.models.hardware import Floats, hardware_offsets
from netsim.models.media import LossMedium
from netsim.models.path_loss import Array, Indices, Links, audible_links, pair_normals, pairs, sorted_links
from netsim.rng import Streams


class Propagation:
    """The links of a medium with physics at the nodes' present positions.

    Args:
        positions_m: (N, 2) at the start; copied.
        node_ids: Distinct ids of the N nodes, ascending.
        tx_power_dbm: (N,) nominal output powers.
        floor_dbm: (N,) weakest power that counts at each listener.
        parameters: The medium.
        streams: The run's random streams.
    """

    def __init__(
        self,
        positions_m: Array,
        node_ids: Sequence[int],
        tx_power_dbm: Array,
        floor_dbm: Array,
        parameters: LossMedium,
        streams: Streams,
    ) -> None:
        self.positions_m = positions_m.copy()
        self._ids = np.asarray(node_ids, dtype=np.intp)
        self._tx_power_dbm = tx_power_dbm
        self._floor_dbm = floor_dbm
        self._parameters = parameters
        self._streams = streams
        self._power_db: Floats = hardware_offsets(node_ids, parameters.hardware_covariance, streams).power_db
        self._drawn: dict[int, tuple[Array, Array]] = {}

    def links(self) -> Links:
        """All links."""
        return audible_links(
            self.positions_m, self._ids.tolist(), self._tx_power_dbm, self._floor_dbm, self._parameters, self._streams
        )

    def move(self, index: Indices, positions_m: Array) -> Links:
        """Put some nodes elsewhere.

        The first move of a node draws its pairs again, in the time of drawing them all (once for those that move together);
        every later one takes time in proportion to moved nodes times nodes.

        Args:
            index: (M,) which nodes.
            positions_m: (M, 2) where to.

        Returns:
            Every link from or to one of them.
        """
        self.positions_m[index] = positions_m
        self._draw([each for each in index.tolist() if each not in self._drawn])
        stays = np.ones(len(self._ids), bool)
        stays[index] = False
        found = []
        for each in index.tolist():
            out, back = self._gains(each)
            heard = self._tx_power_dbm[each] + out >= self._floor_dbm
            heard[each] = False
            hears = stays & (self._tx_power_dbm + back >= self._floor_dbm[each])
            found.append(Links(np.full(np.count_nonzero(heard), each), np.flatnonzero(heard), out[heard]))
            found.append(Links(np.flatnonzero(hears), np.full(np.count_nonzero(hears), each), back[hears]))
        return sorted_links(found)

    def _gains(self, index: int) -> tuple[Array, Array]:
        """Gains from a node to all, and from all to it, in the order of operations of `audible_links`."""
        offsets = self.positions_m - self.positions_m[index]
        gain = -self._parameters.loss_db(np.hypot(offsets[:, 0], offsets[:, 1]))
        shadowing, half = self._drawn[index]
        gain = gain + shadowing
        return gain - half + self._power_db[index], gain + half + self._power_db

    def _draw(self, missing: Sequence[int]) -> None:
        """Remember the shadowing and asymmetry of all pairs of some nodes, signed as seen from the node."""
        if not missing:
            return
        size, sd, half_sd = len(self._ids), self._parameters.shadowing_sd_db, 0.5 * self._parameters.asymmetry_sd_db
        rows = {index: (np.zeros(size), np.zeros(size)) for index in missing}
        wanted = np.zeros(size, bool)
        wanted[list(missing)] = True
        for index, lower in pairs(self._ids):
            mine = rows.get(index)
            others = np.flatnonzero(wanted[lower])
            if mine is None and not len(others):
                continue
            for kind, deviation in enumerate((sd, half_sd)):
                if not deviation:
                    continue
                purpose = ("shadowing", "asymmetry")[kind]
                draws = deviation * pair_normals(self._ids, index, lower, self._streams, purpose)
                if mine is not None:
                    mine[kind][lower] = draws
                for place in others.tolist():
                    rows[int(lower[place])][kind][index] = draws[place] if kind == 0 else -draws[place]
        self._drawn.update(rows)
