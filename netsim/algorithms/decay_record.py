"""What correlation-decay sensors put into the trace."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

from netsim.algorithms.decay_factors import Factors
from netsim.api import NodeHandle
from netsim.kernels.known_association import KnownAssociation
from netsim.protocols.flood_rounds import Flooded
from netsim.trace.events import AlgorithmRecord, PairProbabilities

DECAY_STATISTICS = "correlation_decay"


def record_pairs(
    node: NodeHandle,
    first_variable: int,
    known: KnownAssociation,
    pairs: Sequence[tuple[int, int]],
    estimates: Sequence[float],
    bounds: Sequence[tuple[float, float]],
    depth: int,
) -> None:
    """The probabilities of a node's pairs, measurement after measurement, and what is certain about them."""
    for row in dict.fromkeys(j for j, _ in pairs):
        places = [index for index, (j, _) in enumerate(pairs) if j == row]
        node.record(
            PairProbabilities(
                node=node.id,
                variable=first_variable + known.measurements[row][1],
                event=[known.events[pairs[index][1]].event for index in places],
                probability=[estimates[index] for index in places],
                low=[bounds[index][0] for index in places],
                high=[bounds[index][1] for index in places],
                depth=depth,
            )
        )


@dataclass(slots=True)
class Statistics:
    """What a node did for its answer.

    Attributes:
        reports: Reports it got by flooding, its own included.
        passed_on: Reports it sent in bundles.
        given_up: Neighbours that were silent for a whole round.
        asked: Sensors it asked for their reports, repetitions included.
    """

    reports: int = 0
    passed_on: int = 0
    given_up: int = 0
    asked: int = 0

    def flooded(self, flooded: Flooded) -> None:
        """Take what the flood brought."""
        self.reports, self.passed_on = len(flooded.reports), flooded.passed_on
        self.given_up = len(flooded.given_up)

    def record(
        self, node: NodeHandle, factors: Factors, known: KnownAssociation, pairs: Sequence[tuple[int, int]]
    ) -> None:
        """Put it into the trace."""
        events = {known.graph.event(k) for _, k in pairs}
        fields = {
            "reports": self.reports,
            "passed_on": self.passed_on,
            "given_up": self.given_up,
            "asked": self.asked,
            "factor_requests": factors.requests,
            "factors_stood_in": factors.stood_in,
            "factor_requests_open": factors.most_open,
            "events": len(events),
            "events_incomplete": len(events & known.incomplete),
        }
        node.record(AlgorithmRecord(node.id, DECAY_STATISTICS, json.dumps(fields)))
