"""The lines of a run's table on tracking: errors, spread of the beliefs, hand-offs, outages."""

from collections.abc import Iterator, Mapping
from typing import Any

from netsim.cli.summary_numbers import counts, metres, number, percent, seconds

Row = tuple[str, str]


def tracking_rows(figures: Mapping[str, Any]) -> Iterator[Row]:
    """What a run that estimates positions came to; nothing of any other."""
    if "estimates" in figures:
        yield from _followed(figures) if "beliefs" in figures else _tracks(figures)
        if figures["nees_estimates"]:
            interval = f"{figures['nees_mean_low']:.4g} to {figures['nees_mean_high']:.4g}"
            yield f"NEES, mean (consistent: {interval})", number(figures["nees_mean"])
        if "identity_accuracy" in figures:
            yield from _identities(figures)
    if "group_reports" in figures:
        yield from _groups(figures)
    if "handoffs" in figures:
        yield from _handoffs(figures)
    if "leader_nodes" in figures:
        yield from _leaders(figures)


def _tracks(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Of estimates without beliefs."""
    yield f"position error, mean of {figures['estimates']} estimates", metres(figures["position_error_mean_m"])
    if figures["estimates_unassigned"]:
        yield "  of tracks that follow no target, left out", f"{figures['estimates_unassigned']}"
    yield "OSPA distance of tracks and targets, mean", metres(figures["ospa_mean_m"])
    yield (
        "  targets missed, false tracks (means)",
        " and ".join(number(figures[name]) for name in ("targets_missed_mean", "tracks_false_mean")),
    )
    yield from _switches(figures)


def _switches(figures: Mapping[str, Any]) -> Iterator[Row]:
    if figures["track_switches"] or figures["track_losses"]:
        yield "  switches of tracks, losses", f"{figures['track_switches']} and {figures['track_losses']}"


def _identities(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Who is who; beliefs of tracks that follow no target are neither right nor wrong."""
    yield "identities right, of tracks with a target", percent(figures["identity_accuracy"])
    yield "  probability of the right one in the end, mean", percent(figures["identity_probability_last"])
    if figures.get("identity_messages"):
        yield "  messages about it", f"{figures['identity_messages']:,}"


def _groups(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Of collaboration groups, whose leaders collect the readings of an instant before they tell an estimate."""
    yield "error of estimates at their reading, mean", metres(figures["reading_error_mean_m"])
    if figures["reading_nees_mean"] is not None:
        yield "  NEES at the reading (expected: 2)", number(figures["reading_nees_mean"])
    yield "merges and splits of groups", f"{figures['group_merges']} and {figures['group_splits']}"
    yield "  readings taken jointly", percent(figures["joint_readings_share"])
    yield (
        "distance of a reporting member, mean",
        metres(figures["report_distance_mean_m"]),
    )
    yield "changes of a track's leader", f"{figures['track_leader_changes']:,}"
    if given := figures["radio_messages_by_kind"].get("given"):
        yield "  messages with a belief", f"{given:,}"
    longest, total = seconds(figures["track_two_leaders_longest_s"]), seconds(figures["track_two_leaders_s"])
    yield "  two leaders of a track, longest", f"{longest} (in all {total})"


def _followed(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Of grid beliefs: all estimates count, however far they are off."""
    yield (
        f"distance of estimate and target, mean of {figures['estimates']}",
        metres(figures["estimate_error_mean_m"]),
    )
    yield "  without the first of each track", metres(figures["estimate_error_mean_after_start_m"])
    if figures.get("belief_age_mean_s", 0.0) >= _OLD_S:
        yield (
            f"  at the reading, {seconds(figures['belief_age_mean_s'])} before it is there",
            metres(figures["belief_error_mean_after_start_m"]),
        )
    yield from _lost(figures)
    yield "targets followed, share of the time", percent(figures["targets_followed_share"])
    yield from _switches(figures)
    yield "variance of the belief, mean", f"{figures['belief_variance_mean_m2']:.4g} m\u00b2"
    yield "  cells of nonzero probability, mean", f"{figures['belief_cells_mean']:.4g}"


def _lost(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Estimates at the cut-off or beyond; of several targets the nearest is far, too, where a track's own one has left."""
    if not figures["estimates_lost_share"]:
        return
    if (figures["targets_mean"] or 0.0) <= 1.0:
        yield "  beyond the cut-off: track lost", percent(figures["estimates_lost_share"])
        return
    yield "  beyond the cut-off: target lost or gone", percent(figures["estimates_lost_share"])
    followed = figures["estimates"] - figures["estimates_unassigned"]
    yield f"  of tracks that follow a target, {followed} estimates", metres(figures["position_error_mean_m"])


def _handoffs(figures: Mapping[str, Any]) -> Iterator[Row]:
    yield f"hand-offs, among {figures['handoff_neighbours_mean']:.2g} neighbours", f"{figures['handoffs']:,}"
    sizes = f"{figures['handoff_mean_byte']:.4g} byte (at most {figures['handoff_max_byte']:,})"
    yield "  belief with header, mean", sizes
    forms, lost_bit = figures["handoffs_by_form"], figures["handoff_divergence_mean_bit"]
    if len(forms) > 1:
        yield "  laid out as", counts(forms)
    if lost_bit is None or lost_bit > _NOTHING_BIT:
        yield "  lost by the layout, mean", "infinite" if lost_bit is None else f"{lost_bit:.3g} bit"
    if figures.get("belief_messages_astray"):
        yield "  beliefs sent to others than the next leader", f"{figures['belief_messages_astray']:,}"


_NOTHING_BIT = 1e-9  # rounding
_OLD_S = 0.02  # a belief is that old at most where a node senses and computes without waiting for others


def _leaders(figures: Mapping[str, Any]) -> Iterator[Row]:
    yield "nodes that led", f"{figures['leader_nodes']} of {figures['nodes']}"
    outages = figures["outages"]
    if outages:
        longest, total = seconds(figures["outage_longest_s"]), seconds(figures["outage_total_s"])
        yield "  times without a leader", f"{outages} (longest {longest}, in all {total})"
    else:
        yield "  times without a leader", "none"
    if figures["two_leaders_s"]:
        longest, total = seconds(figures["two_leaders_longest_s"]), seconds(figures["two_leaders_s"])
        yield "  with two leaders of a track, longest", f"{longest} (in all {total})"
