"""Every figure of a run with its unit and its exact definition: one table for people, reports and studies."""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from itertools import groupby
from typing import Any, Final

from netsim.errors import ScenarioError
from netsim.metrics.definitions import (
    centralised,
    collaboration,
    communication,
    energy,
    event_association,
    identities,
    inference,
    leaders,
    lifetime,
    optimality,
    placement,
    runs,
    target_distribution,
    tracking,
)
from netsim.metrics.metric import Metric

__all__ = [
    "CATALOGUE",
    "DEFAULT_COSTS",
    "DEFAULT_METRICS",
    "ERROR_METRICS",
    "Metric",
    "flatten",
    "markdown_table",
    "metric_of",
]

_GROUPS = (
    runs,
    placement,
    inference,
    optimality,
    target_distribution,
    event_association,
    tracking,
    identities,
    leaders,
    collaboration,
    centralised,
    communication,
    energy,
    lifetime,
)
CATALOGUE: Final[Mapping[str, Metric]] = {metric.name: metric for module in _GROUPS for metric in module.METRICS}
"""Every metric by its name in `metrics.json`, in the order of the documentation."""

ERROR_METRICS: Final = (
    "association_error",
    "count_error",
    "pair_error_linf",
    "marginal_error_linf",
    "reading_error_mean_m",
    "estimate_error_mean_m",
    "position_error_mean_m",
    "ospa_mean_m",
    "association_differs_from_exact_map",
    "marginal_error_kl_nat",
)
"""What tells how wrong an answer is, the usual choice first; a run has those of its problem."""

DEFAULT_COSTS: Final = ("energy_j", "energy_beyond_listening_j", "radio_messages", "frame_byte", "latency_mean_s")
"""What an answer costs: the abscissae of a study's plots."""

DEFAULT_METRICS: Final = (
    *ERROR_METRICS,
    "identity_accuracy",
    "identity_probability_last",
    "targets_followed_share",
    "outage_longest_s",
    "graph_messages_per_sensor",
    "converged_round",
    *DEFAULT_COSTS,
    "frames",
    "frames_retry",
    "airtime_s",
    "delivery_ratio_unicast",
    "first_death_s",
    "lifetime_first_dead_days",
)
"""What a study tabulates unless it says otherwise; of these a run has those that its problem gives."""

Scalar = float | int | bool | str | None


def metric_of(name: str) -> Metric:
    """The metric that a figure belongs to.

    Args:
        name: Its name in `metrics.json`, or that of one entry of a dictionary there (`energy_by_state_j.radio.listen`).

    Raises:
        ScenarioError: If there is no such metric; the message names similar ones.
    """
    metric = CATALOGUE.get(name) or CATALOGUE.get(name.partition(".")[0])
    if metric is None:
        near = get_close_matches(name.partition(".")[0], CATALOGUE, n=3)
        remedy = f"did you mean {' or '.join(near)}?" if near else "`netsim list --metrics` names them all"
        message = f"metric {name!r}: expected the name of a metric, got none; {remedy}"
        raise ScenarioError(message)
    return metric


def flatten(figures: Mapping[str, Any]) -> dict[str, Scalar]:
    """The scalar figures of a run by name, those in dictionaries as `name.key`; lists are left out."""
    return dict(_flat(figures, ""))


def _flat(figures: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Scalar]]:
    for key, value in figures.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif value is None or isinstance(value, float | int | str):
            yield f"{prefix}{key}", value


def markdown_table() -> str:
    """The catalogue as Markdown, a table a group."""
    parts = []
    for group, metrics in groupby(CATALOGUE.values(), key=lambda metric: metric.group):
        rows = [_row(metric) for metric in metrics]
        head = ["| metric | unit | better | definition | made of |", "| --- | --- | --- | --- | --- |"]
        parts.append("\n".join([f"## {group.capitalize()}", "", *head, *rows]))
    return "\n\n".join(parts) + "\n"


def _row(metric: Metric) -> str:
    cells = (f"`{metric.name}`", metric.unit, metric.better, metric.definition, metric.source)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
