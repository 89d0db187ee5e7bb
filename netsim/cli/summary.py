"""The table at the end of a run."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table

from netsim.cli.summary_numbers import counted_parts, counts, largest, number, percent, seconds
from netsim.cli.summary_tracking import tracking_rows
from netsim.scenario.load import LoadedScenario
from netsim.scenario.run import Result

Row = tuple[str, str]
SHOWN_STATES = 8
SHOWN_KINDS = 6
SHOWN_PARTS = 3
NO_CONTROL = ("ack", "strobe")
"""Kinds of frame that the line above has already."""


def summary_table(result: Result, loaded: LoadedScenario) -> Table:
    """What a run gave, in the order in which one asks."""
    title = f"{loaded.scenario.name} (seed {loaded.scenario.seed})" + (", interrupted" if result.interrupted else "")
    ended = [*_time(result.metrics, result.interrupted), ("wall time", seconds(result.wall_s))]
    return _table(title, [*_sections(result.metrics), ended])


def figures_table(title: str, figures: Mapping[str, Any]) -> Table:
    """The same of a run of which only the figures are left."""
    return _table(title, [*_sections(figures), _time(figures, bool(figures.get("interrupted")))])


def part_table(title: str, figures: Mapping[str, Any], end_s: float) -> Table:
    """The same of the part of a run up to some instant: without the energy, of which account is given at the end."""
    told = [_answer(figures), _messages(figures), _incidents(figures)]
    return _table(f"{title}, the part up to {seconds(end_s)}", told)


def _sections(figures: Mapping[str, Any]) -> Sequence[Iterable[Row]]:
    return _answer(figures), _messages(figures), _energy(figures), _incidents(figures)


def _table(title: str, sections: Iterable[Iterable[Row]]) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", show_header=False)
    table.add_column("what")
    table.add_column("figure", justify="right")
    for section in sections:
        rows = list(section)
        for row in rows:
            table.add_row(*row)
        if rows:
            table.add_section()
    return table


def _answer(figures: Mapping[str, Any]) -> Iterator[Row]:
    if "association_error" in figures:
        yield f"association error, of {figures['measurements']} measurements", percent(figures["association_error"])
        if figures["association_error_exact_map"] is None:
            yield "  of the exact MAP", "not computed: too large, or none exists"
        else:
            yield "  of the exact MAP", percent(figures["association_error_exact_map"])
            yield "  decided otherwise than the exact MAP", percent(figures["association_differs_from_exact_map"])
        yield "  deciding alone", percent(figures["association_error_independent"])
    if "count_error" in figures:
        yield f"error of target counts, {figures['subregions']} subregions", percent(figures["count_error"])
        yield "  subregions with a wrong count", percent(figures["count_error_wrong"])
        yield "  error of the prior alone", percent(figures["count_error_prior"])
    yield from _pairs(figures)
    if "marginals" in figures:
        yield "largest error of a marginal", number(figures["marginal_error_linf"])
        yield "mean divergence from the exact marginals (nat)", number(figures["marginal_error_kl_nat"])
    yield from tracking_rows(figures)
    if "rounds" in figures:
        quiet = figures["converged_round"]
        settled = f"settled in round {quiet}" if quiet is not None else "not settled"
        yield "rounds", f"{figures['rounds']} ({settled})"
        if figures["rounds_begun_late"]:
            late = f"{figures['rounds_begun_late']}, by up to {seconds(figures['round_lateness_max_s'])}"
            yield "  begun late (slow CPU, energy allowance or reboot)", late
    elif "last_news_s" in figures:
        yield "last new message", seconds(figures["last_news_s"])


def _pairs(figures: Mapping[str, Any]) -> Iterator[Row]:
    """How far stated association probabilities are from the exact ones, and what was certified."""
    if "gated_pairs" not in figures:
        return
    told = figures["gated_pairs_told_share"]
    yield "measurement-event pairs told of", "none" if told is None else f"{percent(told)} of {figures['gated_pairs']}"
    if figures["pair_error_linf"] is None:
        yield "  largest error of a probability", "not computed: nothing told, or exact sums out of reach"
    else:
        yield "  largest error of a probability", number(figures["pair_error_linf"])
        yield "  of loopy belief propagation at one place", number(figures["pair_error_bp_linf"])
    if figures["interval_width_max"] is not None:
        yield (
            "  certified intervals, widest and mean",
            (f"{number(figures['interval_width_max'])}, {number(figures['interval_width_mean'])}"),
        )
        yield "  levels of recursion, mean", number(figures["decay_depth_mean"])


def _proved(figures: Mapping[str, Any]) -> Iterator[Row]:
    """Whether tree-reweighted max-product proved its answer."""
    if "map_proved" in figures:
        share = figures["map_proved_share"]
        part = "" if figures["map_proved"] or share is None else f" ({percent(share)} of the vertices are)"
        yield "most probable answer", "proved MAP" if figures["map_proved"] else f"not proved{part}"
    if "trmp_iterations" in figures:
        yield "  iterations, spanning trees", f"{figures['trmp_iterations']}, {figures['trmp_trees']}"


def _messages(figures: Mapping[str, Any]) -> Iterator[Row]:
    if "graph_messages_per_sensor" in figures:
        yield "graph messages per sensor", number(figures["graph_messages_per_sensor"])
    if "graph_messages_until_convergence_per_sensor" in figures:
        yield "  until settled", number(figures["graph_messages_until_convergence_per_sensor"])
    yield from _proved(figures)
    yield (
        "radio messages",
        counted_parts(figures["radio_messages"], largest(figures["radio_messages_by_kind"], SHOWN_PARTS)),
    )
    yield "  unicasts delivered", percent(figures["delivery_ratio_unicast"])
    if figures["drops_by_reason"]:
        yield "  packets given up", counts(figures["drops_by_reason"])
    kinds = {"data": figures["frames_data"], "retry": figures["frames_retry"], "ack": figures["frames_ack"]}
    if figures.get("frames_strobe"):
        kinds["wake-up"] = figures["frames_strobe"]
    yield "frames", counted_parts(figures["frames"], kinds)
    known = {*figures["radio_messages_by_kind"], *NO_CONTROL}
    if any(kind not in known for kind in figures.get("frames_by_kind", {})):
        most_first = sorted(figures["frames_by_kind"].items(), key=lambda item: -item[1])
        yield "  by kind", counts(dict(most_first[:SHOWN_KINDS])) + (", ..." if len(most_first) > SHOWN_KINDS else "")
    if figures.get("frames_unicast_data"):
        yield "  unicast data frames received", percent(figures["frame_reception_ratio_unicast"])
    if figures.get("frames_lost_by_reason"):
        most_first = sorted(figures["frames_lost_by_reason"].items(), key=lambda item: -item[1])
        yield "  lost, at the addressee", counts(dict(most_first))
    yield "bytes in frames (PSDU)", f"{figures['frame_byte']:,}"
    yield "airtime", seconds(figures["airtime_s"])


def _energy(figures: Mapping[str, Any]) -> Iterator[Row]:
    yield "energy", f"{figures['energy_j']:.4g} J"
    if "energy_beyond_listening_j" in figures:
        yield "  beyond listening, sleep and idling", f"{figures['energy_beyond_listening_j']:.4g} J"
    states = sorted(figures["energy_by_state_j"].items(), key=lambda item: -item[1])
    for state, joules in states[:SHOWN_STATES]:
        if joules > 0.0:
            yield f"  {state}", f"{joules:.4g} J"
    if rest := sum(joules for _, joules in states[SHOWN_STATES:]):
        yield "  everything else", f"{rest:.4g} J"
    if figures["energy_most_node"] is not None:
        yield "  most by a node", f"{figures['energy_most_j']:.4g} J ({figures['energy_most_node']})"
    if figures.get("energy_harvested_j"):
        spilled_j = figures.get("energy_spilled_j", 0.0)
        rest = f" ({spilled_j:.4g} J of it found the battery full)" if spilled_j else ""
        yield "energy harvested", f"{figures['energy_harvested_j']:.4g} J{rest}"


def _incidents(figures: Mapping[str, Any]) -> Iterator[Row]:
    """What befell the nodes; nothing of a quiet run."""
    if figures["deaths"]:
        yield "nodes whose battery ran empty", f"{figures['deaths']} (first at {seconds(figures['first_death_s'])})"
    if figures.get("crashes"):
        yield "crashes", f"{figures['crashes']} ({figures['reboots']} came back)"
    if figures.get("rehostings"):
        back = figures["hosts_stepped_down"]
        yield (
            "variables taken over from dead hosts",
            f"{figures['rehostings']}" + (f" ({back} given back)" if back else ""),
        )
    if figures.get("energy_allowance_short"):
        nodes = figures["energy_allowance_short_nodes"]
        times = figures["energy_allowance_short"]
        yield (
            "energy allowance used up",
            f"{times} time{'' if times == 1 else 's'}, on {nodes} of {figures['nodes']} nodes",
        )
    if figures.get("energy_refused"):
        yield "  refused for want of it", counts(figures["energy_refused"])
    if "clock_error_max_s" in figures:
        largest, usual = seconds(figures["clock_error_max_s"]), seconds(figures["clock_error_rms_s"])
        yield "clock error, largest", f"{largest} (root mean square {usual})"
        if "clock_spread_last_s" in figures:
            yield "  spread among the nodes at the last sample", seconds(figures["clock_spread_last_s"])


def _time(figures: Mapping[str, Any], interrupted: bool) -> Iterator[Row]:
    ended = sum(figures[f"nodes_{end}"] for end in ("finished", "failed", "died", "crashed"))
    unfinished = figures["nodes"] - ended
    if unfinished:
        cause = "at the interruption" if interrupted else "at the horizon"
        yield f"nodes still running {cause}", f"{unfinished} of {figures['nodes']}"
    if figures["nodes_failed"]:
        yield "nodes whose algorithm failed", f"{figures['nodes_failed']} of {figures['nodes']}"
    yield "simulated time", seconds(figures["simulated_s"])
