"""`netsim compare` of studies."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from netsim.cli.compare_json import plain_gates, plain_number, plain_settings
from netsim.cli.comparing import figure, listed, metric_label, share, show_settings, signed
from netsim.cli.console import WIDTH_UNWRAPPED, say, show
from netsim.cli.tables import plain_table
from netsim.metrics.catalogue import DEFAULT_COSTS, ERROR_METRICS
from netsim.study.compare import HEADLINE
from netsim.study.compare_studies import Line, Match, StudyComparison, compare_studies, some
from netsim.study.gate import Gate, Judgement
from netsim.study.shortfalls import Tally

EACH = (*ERROR_METRICS[:3], *DEFAULT_COSTS[:3])
"""What is told of each variant unless everything is asked for."""
_NO_FIGURES = "no repetition has figures of all of them in both studies."


def compare_studies_command(
    paths: Sequence[Path], gates: Sequence[Gate], *, everything: bool, as_json: bool
) -> list[tuple[str, Judgement]]:
    """Put studies side by side; returns what the gates say."""
    comparison = compare_studies(paths)
    verdicts = comparison.judge(gates)
    if as_json:
        say(json.dumps(_plain(comparison, verdicts), indent=2, allow_nan=False))
    else:
        show_settings("What differs between the studies", comparison.settings, comparison.names)
        show_settings("What differs between the versions", comparison.versions, comparison.names)
        for match in comparison.matches:
            _show_match(comparison.names[0], match, everything)
    return verdicts


def _show_match(first: str, match: Match, everything: bool) -> None:
    how = "within pairs of one seed and repetition" if match.is_paired else "between independent samples (Welch)"
    say(f"{match.name} against {first}: differences {how}, each with its own 95 % interval.")
    say(f"Of {len(match.variants)} variants that both have, the scenarios of {match.changed} differ.")
    if match.lonely:
        say(f"only in one of them, and left out: {listed(match.lonely)}")
    for tally in match.tallies:
        _tell_tally(tally)
    lines = [line for line in match.overall if everything or line.metric in HEADLINE]
    count = len(match.variants)
    _show_lines(f"Over {count} variant{'' if count == 1 else 's'}", {"": lines}, first, match.name)
    if equal := [line.metric for line in lines if line.is_equal]:
        say(f"equal: {listed(equal)}")
    if count > 1:
        each = {
            levels: [line for line in of if everything or line.metric in EACH] for levels, of in match.variants.items()
        }
        _show_lines("Each variant", each, first, match.name)


def _tell_tally(tally: Tally) -> None:
    """Say which trials a study has no figures of; nothing if all ended well."""
    for what, trials in (("failed", tally.failed), ("were not run", tally.not_run)):
        if trials:
            say(f"warning: in {tally.name} {len(trials)} of {tally.asked} trials {what}: {some(trials)}")


def _show_lines(title: str, lines: Mapping[str, Sequence[Line]], first: str, later: str) -> None:
    told = [(levels, line) for levels, of in lines.items() for line in of if not (line.is_equal or line.is_empty)]
    n = max((line.difference.n for of in lines.values() for line in of), default=0)
    if not told:
        say(f"{title}: all figures asked for are equal (n = {n})." if n else f"{title}: {_NO_FIGURES}")
        return
    levels = ("variant",) if any(lines) else ()
    table = plain_table(title, (*levels, "metric"), ("n", first, later, "difference", "95 % interval", "relative"))
    for name, line in told:
        table.add_row(*((name,) if levels else ()), metric_label(line.metric, line.unit), *_cells(line))
    show(table, WIDTH_UNWRAPPED)


def _cells(line: Line) -> tuple[str, ...]:
    apart, sample = line.difference, line.difference.sample
    n = str(apart.n) if apart.n == apart.n_baseline else f"{apart.n_baseline}, {apart.n}"
    interval = "-" if math.isnan(sample.low) else f"{sample.low:+.4g} to {sample.high:+.4g}"
    return (
        n,
        figure(float(apart.baseline_mean)),
        figure(float(apart.mean)),
        signed(float(sample.mean)),
        interval,
        share(apart.row()["relative"]),
    )


def _plain(comparison: StudyComparison, verdicts: Sequence[tuple[str, Judgement]]) -> Mapping[str, Any]:
    return {
        "studies": list(comparison.names),
        "study_files": plain_settings(comparison.settings),
        "versions": plain_settings(comparison.versions),
        "matches": [
            {
                "study": match.name,
                "paired": match.is_paired,
                "changed_scenarios": match.changed,
                "left_out": match.lonely,
                "trials": [asdict(tally) for tally in match.tallies],
                "lost": list(match.lost),
                "uneven": {metric: list(trials) for metric, trials in match.uneven.items()},
                "overall": _plain_lines(match.overall),
                "variants": {levels: _plain_lines(lines) for levels, lines in match.variants.items()},
            }
            for match in comparison.matches
        ],
        "gates": plain_gates(verdicts),
    }


def _plain_lines(lines: Sequence[Line]) -> Mapping[str, Any]:
    return {
        line.metric: {"unit": line.unit}
        | {name: None if value != value else plain_number(value) for name, value in line.difference.row().items()}
        for line in lines
    }
