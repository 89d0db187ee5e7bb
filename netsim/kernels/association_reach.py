"""How large the tables of a data-association problem get, before any is made.

The vertices of the hybrid model (`netsim.kernels.association_vertices`) refuse tables that would fill the memory. The same
figures follow from the counts alone: which targets a sensor shares with whom, and how many measurements there are.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.injections import PAIR_LIMIT, STATE_LIMIT, count_injections, count_pairs
from netsim.kernels.polar_evidence import MOST_TERMS, PolarKind, quadrature_points


@dataclass(frozen=True, slots=True)
class Demand:
    """One table that a vertex needs.

    Attributes:
        who: The vertex, and what the table is for.
        entries: How many entries it has, or how many the dynamic programme goes through.
        limit: How many it may have.
    """

    who: str
    entries: int
    limit: int

    @property
    def share(self) -> float:
        """Entries over the limit; above 1 the table is refused."""
        return self.entries / self.limit


def demands(instance: AssociationInstance) -> Iterator[Demand]:
    """Every table that could be refused: per sensor and group of targets it shares, and per target.

    Raises:
        ScenarioError: Where measurements of range or bearing are too exact for the quadrature over a prior.
    """
    counts = [len(points) for points in instance.measurements_m]
    for sensor, count in enumerate(counts):
        who = f"sensor {instance.sensor_nodes[sensor]} with {count} measurements"
        yield Demand(f"{who}: its masks of used measurements", 1 << count, STATE_LIMIT)
        for other, shared in _groups(instance, sensor).items():
            whom = "" if other is None else f" shared with sensor {instance.sensor_nodes[other]}"
            group = f"{who}: {shared} target{'s' if shared > 1 else ''}{whom}"
            yield Demand(f"{group}, choices of a measurement each", (count + 1) ** shared, STATE_LIMIT)
            yield Demand(f"{group}, pairs of masks of used measurements", count_pairs(shared, count), PAIR_LIMIT)
    for target, sensors in enumerate(instance.coverage):
        entries = 1
        for sensor in sensors:
            entries *= counts[sensor] + 1
        yield Demand(f"target {target}: joint choices of its {len(sensors)} sensors", entries, STATE_LIMIT)
        kind = instance.model.measures
        if kind != "position" and entries > 1:
            who = f"target {target}: points of the quadrature times joint choices of its {len(sensors)} sensors"
            yield Demand(who, entries * _points(instance, target, kind), MOST_TERMS)


def _points(instance: AssociationInstance, target: int, kind: PolarKind) -> int:
    """Points of the grid over which a target's evidence is summed."""
    places_m = np.array([instance.sensors_m[sensor] for sensor in instance.coverage[target]])
    model = instance.model
    prior = instance.means_m[target], instance.covariances_m2[target]
    return quadrature_points(*prior, places_m, kind, model.range_sd_m, model.bearing_sd_rad)


def _groups(instance: AssociationInstance, sensor: int) -> Counter[int | None]:
    """How many targets a sensor's groups have, by the sensor at the other end; None for the groups of one target."""
    groups: Counter[int | None] = Counter()
    for target in instance.targets_of[sensor]:
        covering = instance.coverage[target]
        if len(covering) == 2:
            groups[sum(covering) - sensor] += 1
        else:
            groups[None] = 1
    return groups


def sensor_states(instance: AssociationInstance) -> list[int]:
    """How many associations each sensor's variable has; none of them is ever listed."""
    pairs = zip(instance.targets_of, instance.measurements_m, strict=True)
    return [count_injections(len(targets), len(points)) for targets, points in pairs]


def largest(instance: AssociationInstance) -> Demand | None:
    """The table nearest to its limit, or furthest beyond it; None for a problem without sensors and targets."""
    return max(demands(instance), key=lambda demand: demand.share, default=None)


def require_reach(instance: AssociationInstance) -> None:
    """Refuse a problem that a vertex would refuse, before anything has started.

    Raises:
        ScenarioError: Naming the vertex, the table's size and the limit.
    """
    most = largest(instance)
    if most is not None and most.share > 1.0:
        others = sum(demand.share > 1.0 for demand in demands(instance)) - 1
        more = f" (and {others} more tables beyond it)" if others else ""
        text = (
            f"this problem is beyond reach: {len(instance.sensor_nodes)} sensors, {len(instance.coverage)} targets; "
            f"{most.who}: {most.entries:,} entries, at most {most.limit:,} are supported{more}; use fewer targets, a "
            "smaller detection radius, sensors further apart, or another seed"
        )
        raise ScenarioError(text)
