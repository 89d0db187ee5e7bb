"""Beliefs in the trace."""

from netsim.api import NodeHandle
from netsim.kernels.grid_belief import GridBelief
from netsim.trace.events import Belief, Estimate


def record_belief(node: NodeHandle, track: int, step: int, belief: GridBelief, thread: int = 0) -> None:
    """Put a belief into the trace, and the estimate that it gives.

    Args:
        node: Whose belief it is.
        track: Number of the track.
        step: Number of the reading instant.
        belief: After the readings of that instant.
        thread: Which of the track's redundant threads.
    """
    grid = belief.grid
    (xx, xy), (_, yy) = belief.covariance_m2.tolist()
    x_m, y_m = belief.mean_m.tolist()
    node.record(Estimate(node.id, track, x_m, y_m, [xx, xy, yy], thread))
    cells, chances = belief.cells.tolist(), belief.probability.tolist()
    where = (*grid.origin_m, grid.cell_m, grid.columns)
    node.record(Belief(node.id, track, step, *where, cells, chances, thread))
