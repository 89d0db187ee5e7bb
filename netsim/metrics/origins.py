"""Sum-product's beliefs about where measurements came from, beside the exact marginals where these can be computed."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_marginals import exact_origins
from netsim.kernels.association_model import AssociationInstance
from netsim.kernels.semiring import FloatArray
from netsim.metrics.marginals import divergence_nat
from netsim.trace.events import Marginals, Problem
from netsim.trace.recorder import Handler

LARGEST_TABLE: Final = 5_000_000
"""Entries of the largest table that elimination may build: about a second and 300 MB in all."""


class OriginError:
    """Distance of the sensors' association marginals to the exact ones."""

    def __init__(self) -> None:
        self._instance: AssociationInstance | None = None
        self._beliefs: dict[int, FloatArray] = {}

    def handlers(self) -> Mapping[type[Any], Handler]:
        """See `Observer.handlers`."""
        return {Problem: self._on_problem, Marginals: self._on_marginals}

    def figures(self) -> dict[str, Any]:
        """The metrics; empty for another kind of problem, distances None where the exact answer is out of reach."""
        if self._instance is None:
            return {}
        told = self._by_sensor(self._instance)
        if not told:
            return {}
        names = {sensor: f"sensor {self._instance.sensor_nodes[sensor]}" for sensor in told}
        beliefs = {names[sensor]: belief.tolist() for sensor, belief in told.items()}
        try:
            exact = exact_origins(self._instance, LARGEST_TABLE)
        except ScenarioError:
            return {"marginals": beliefs, "marginal_error_linf": None, "marginal_error_kl_nat": None}
        rows = [pair for sensor in told for pair in zip(exact[sensor], told[sensor], strict=True)]
        divergence = sum(divergence_nat(right, belief) for right, belief in rows) / len(rows)
        return {
            "marginals": beliefs,
            "marginals_exact": {names[sensor]: exact[sensor].tolist() for sensor in told},
            "marginal_error_linf": max(float(np.abs(right - belief).max()) for right, belief in rows),
            "marginal_error_kl_nat": divergence if np.isfinite(divergence) else None,
        }

    def _by_sensor(self, instance: AssociationInstance) -> dict[int, FloatArray]:
        """A row a measurement; without sensors that told of other measurements than they should have had (a fault)."""
        shapes = [
            (len(points), len(targets) + 1)
            for points, targets in zip(instance.measurements_m, instance.targets_of, strict=True)
        ]
        return {
            sensor: belief.reshape(shapes[sensor]) * shapes[sensor][0]
            for sensor, belief in sorted(self._beliefs.items())
            if belief.size == shapes[sensor][0] * shapes[sensor][1]
        }

    def _on_problem(self, event: Problem, _: int) -> None:
        if event.kind == "association":
            self._instance = AssociationInstance.from_json(event.content_json)

    def _on_marginals(self, event: Marginals, _: int) -> None:
        if self._instance is not None and event.variable < len(self._instance.sensor_nodes) and not event.is_max:
            self._beliefs[event.variable] = np.asarray(event.probability)
