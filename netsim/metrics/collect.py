"""All the metrics of a run: reducers over its events, equal with and without a trace file."""

from collections.abc import Iterable
from typing import Any

from netsim.metrics.budgets import Budgets
from netsim.metrics.clocks import Clocks
from netsim.metrics.collaboration import Collaboration
from netsim.metrics.energy import Energy
from netsim.metrics.event_association import PairError
from netsim.metrics.faults import Faults
from netsim.metrics.flow import Waking
from netsim.metrics.fusion import Fusion
from netsim.metrics.identities import IdentityWords
from netsim.metrics.inference import AssociationError, GraphTraffic, MarginalError
from netsim.metrics.leaders import Leaders
from netsim.metrics.life import Life
from netsim.metrics.optimality import Optimality
from netsim.metrics.origins import OriginError
from netsim.metrics.placement import PlacementCost
from netsim.metrics.protocol import Conversations
from netsim.metrics.table2 import Table2
from netsim.metrics.target_distribution import CountError
from netsim.metrics.tracking import Tracking
from netsim.metrics.tracking_beliefs import Beliefs, EstimateErrors, Handoffs
from netsim.metrics.traffic import Traffic
from netsim.trace.events import EnergyLedger, Event
from netsim.trace.recorder import Observer, Recorder


class Metrics:
    """The reducers of one run."""

    def __init__(self) -> None:
        self._energy = Energy()
        self._reducers = (
            Life(),
            Faults(),
            PlacementCost(),
            GraphTraffic(),
            Waking(),
            Conversations(),
            AssociationError(),
            MarginalError(),
            OriginError(),
            Optimality(),
            CountError(),
            PairError(),
            Tracking(),
            EstimateErrors(),
            Beliefs(),
            Handoffs(),
            Leaders(),
            Collaboration(),
            Fusion(),
            IdentityWords(),
            Table2(),
            Traffic(),
            self._energy,
            Clocks(),
            Budgets(),
        )

    @property
    def observers(self) -> tuple[Observer, ...]:
        """What must follow the run."""
        return self._reducers

    @property
    def ledger(self) -> EnergyLedger | None:
        """The energy ledger, once the run has ended."""
        return self._energy.ledger

    def figures(self) -> dict[str, Any]:
        """Every metric by name, units in the names; nothing in it differs between equal runs."""
        figures: dict[str, Any] = {}
        for reducer in self._reducers:
            figures.update(reducer.figures())
        return figures


def metrics_of(events: Iterable[tuple[int, Event]]) -> dict[str, Any]:
    """The metrics of a recorded run, from its (time in ns, event) pairs: the same figures as those of the run itself."""
    metrics = Metrics()
    replay(events, metrics.observers)
    return metrics.figures()


def replay(events: Iterable[tuple[int, Event]], observers: Iterable[Observer]) -> None:
    """Hand recorded events to observers as a run would: (time in ns, event) pairs in order."""
    time_ns = [0]  # of the event being handed over
    recorder = Recorder(lambda: time_ns[0], observers)
    for time_ns[0], event in events:
        recorder.record(event)
