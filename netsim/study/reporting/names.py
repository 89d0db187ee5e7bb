"""What metrics and variants are called in a report."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import metric_of
from netsim.metrics.metric import Better
from netsim.study.info import AxisInfo
from netsim.study.levels import is_numeric, label_of

TITLES = {
    "frame_byte": "bytes in frames",
    "message_payload_byte": "payload bytes",
    "latency_mean_s": "mean latency",
    "latency_max_s": "longest latency",
    "airtime_s": "airtime",
    "energy_most_j": "energy of the hungriest node",
    "association_error_exact_map": "association error, exact MAP",
    "association_error_independent": "association error, each sensor alone",
    "association_error_target_originated": "association error, target-originated",
    "association_differs_from_exact_map": "association differs from exact MAP",
    "marginal_error_linf": "largest marginal error",
    "marginal_error_kl_nat": "marginal KL divergence",
    "pair_error_linf": "largest error of a probability",
    "pair_error_mean": "mean error of a probability",
    "pair_error_bp_linf": "largest error of belief propagation",
    "interval_width_max": "widest interval",
    "interval_width_mean": "mean width of the intervals",
    "interval_misses": "probabilities outside their interval",
    "gated_pairs": "pairs within the gate",
    "gated_pairs_told_share": "share of pairs told of",
    "matchings": "association events",
    "decay_depth": "most levels of recursion",
    "decay_depth_mean": "mean levels of recursion",
    "events_incomplete_share": "share of events that miss a report",
    "reports_heard_mean": "mean number of reports heard",
    "flood_neighbours_given_up": "neighbours given up in the flood",
    "factor_requests_open": "most factor requests open",
    "delivery_ratio_unicast": "unicast delivery ratio",
    "lifetime_first_dead_days": "lifetime to the first death",
    "lifetime_median_days": "lifetime to the median death",
    "lifetime_partition_days": "lifetime to partition",
    "lifetime_accuracy_days": "lifetime to the first loss of accuracy",
    "first_death_s": "first death",
    "estimate_error_mean_m": "mean error of the estimate",
    "estimate_error_mean_after_start_m": "mean error after the start",
    "belief_variance_mean_m2": "mean variance of the belief",
    "belief_variance_mean_after_start_m2": "mean variance after the start",
    "belief_cells_mean": "mean number of cells of the belief",
    "belief_cells_mean_after_start": "mean number of cells after the start",
    "handoff_neighbours_mean": "mean number of neighbours",
    "handoff_mean_byte": "mean size of a hand-off",
    "outage_first_s": "length of the first outage",
    "outage_longest_s": "longest outage",
    "outage_total_s": "time without a leader",
    "two_leaders_s": "time with two leaders",
    "two_leaders_longest_s": "longest time with two leaders",
    "reading_error_mean_m": "mean error at the reading",
    "reading_nees_mean": "mean NEES at the reading",
    "report_distance_mean_m": "mean distance to the leader",
    "report_distance_sum_m": "sum of distances to the leader",
    "joint_readings_share": "share of joint readings",
    "identity_probability_mean": "mean probability of the right identity",
    "identity_probability_last": "probability of the right identity at the end",
}
SHARES = (
    *("association_error", "association_differs_from_exact_map", "marginal_error_linf", "map_proved", "count_error"),
    *("count_marginal_error_linf", "identity_accuracy", "identity_probability", "interval_width_"),
    *("delivery_ratio_unicast", "frame_reception_ratio_unicast"),
)
"""How the names of metrics begin that are shares of a whole, probabilities or their differences: none exceeds 1.

What ends in `_share` is one, too."""
SUFFIXES = ("_j", "_s", "_m", "_byte", "_days", "_nat", "_bit", "_m2")
BOTH_UNKNOWN: tuple[str, Better] = ("1", "")


def title_of(metric: str) -> str:
    """A metric in words, without its unit: `energy beyond listening`."""
    if metric in TITLES:
        return TITLES[metric]
    stem, _, entry = metric.partition(".")
    for suffix in SUFFIXES:
        stem = stem.removesuffix(suffix)
    words = stem.replace("_", " ")
    return f"{words}: {entry}" if entry else words


def unit_of(metric: str) -> str:
    """A metric's unit; `1` for none."""
    return _known(metric)[0]


def better_of(metric: str) -> Better:
    """Which way a metric is better."""
    return _known(metric)[1]


def bounds_of(metric: str) -> tuple[float, float]:
    """Between what a metric can lie: at least 0 for those of the catalogue, which count or measure, at most 1 for shares."""
    if _known(metric) is BOTH_UNKNOWN:
        return -math.inf, math.inf
    return 0.0, 1.0 if metric.startswith(SHARES) or metric.endswith("_share") else math.inf


def title_with(metric: str, unit: str) -> str:
    """A metric in words with a unit, for the head of a column or an axis: `energy (mJ)`."""
    title = title_of(metric)
    return f"{title} ({unit})" if unit and not (unit == "byte" and "bytes" in title) else title


def level_name(axis: str, level: Any) -> str:
    """A level where its axis is to be told as well: numbers and truth values with the axis, words alone."""
    label = label_of(level)
    return label if isinstance(level, str) else f"{axis} {label}"


def variant_name(levels: Mapping[str, Any], axes: Sequence[AxisInfo], left_out: Sequence[str] = ()) -> str:
    """A variant in words: `tolerance 0.1, csma`.

    Args:
        levels: Its levels by axis.
        axes: The study's axes.
        left_out: Axes not to be told.
    """
    told = [axis for axis in axes if axis.name not in left_out and len(axis.levels) > 1]
    told = told or [axis for axis in axes if axis.name not in left_out]
    seen = [str(levels[axis.name]) for axis in told]
    parts = [
        f"{axis.name} {label_of(levels[axis.name])}"
        if seen.count(name) > 1
        else level_name(axis.name, levels[axis.name])
        for axis, name in zip(told, seen, strict=True)
    ]
    return ", ".join(parts)


def is_ordered(axis: AxisInfo) -> bool:
    """Whether an axis is one of numbers, with enough of them to draw a line."""
    return len(axis.levels) >= 3 and is_numeric(axis.levels)


def _known(metric: str) -> tuple[str, Better]:
    try:
        found = metric_of(metric)
    except ScenarioError:
        return BOTH_UNKNOWN
    return found.unit, found.better
