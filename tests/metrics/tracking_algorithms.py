"""Algorithms that the tests of tracking name."""

import numpy as np

from netsim.api import NodeHandle, Op
from netsim.trace.events import Estimate, Identity

S = 1_000_000_000


class TellPriors:
    """The first sensor that covers a target says its prior as an estimate, and takes the track for the target it is."""

    def run(self, node: NodeHandle) -> Op[None]:
        yield from node.pause(S)
        for covered in node.knowledge.targets:
            if covered.sensors[0] == node.knowledge.sensor:
                (xx, xy), (_, yy) = covered.covariance_m2
                node.record(Estimate(node.id, covered.target, *covered.mean_m, [xx, xy, yy]))
                node.record(Identity(node.id, covered.target, np.eye(covered.target + 1)[-1]))
