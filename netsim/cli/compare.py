"""`netsim compare`."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from netsim.cli import EXIT_FAILURE
from netsim.cli.compare_json import plain_comparison
from netsim.cli.comparing import figure, listed, metric_label, share, show_settings, signed
from netsim.cli.console import WIDTH_UNWRAPPED, say, show, tell
from netsim.cli.names import instant, labels
from netsim.cli.tables import plain_table
from netsim.metrics.timeline import event_words
from netsim.study.compare import HEADLINE, Comparison, Held, Row, compare
from netsim.study.contender import Contender, are_studies
from netsim.study.gate import Judgement, parse_gate
from netsim.trace.divergence import Difference, Divergence, Recorded

SHOWN_CHARACTERS = 40


def compare_command(paths: Sequence[Path], expressions: Sequence[str], *, everything: bool, as_json: bool) -> None:
    """Put runs or studies side by side; the exit status says whether a gate failed."""
    gates = [parse_gate(expression) for expression in expressions]
    if are_studies(paths):
        from netsim.cli.compare_studies import compare_studies_command

        verdicts = compare_studies_command(paths, gates, everything=everything, as_json=as_json)
    else:
        comparison = compare(paths)
        verdicts = [(run.name, judgement) for run, judgement in comparison.judge(gates)]
        if as_json:
            say(json.dumps(plain_comparison(comparison, verdicts), indent=2, allow_nan=False))
        else:
            _show(comparison, everything)
    if tell_gates(verdicts, as_json):
        raise typer.Exit(EXIT_FAILURE)


def tell_gates(verdicts: Sequence[tuple[str, Judgement]], as_json: bool) -> bool:
    """Say which gates failed, or could not be judged on all trials; returns whether one did."""
    for name, judgement in verdicts:
        values = ", ".join(f"{each} = {value:.6g}" for each, value in judgement.values.items())
        told = f"{judgement.expression} ({values})" if values else judgement.expression
        if judgement.failed:
            tell(f"failed: {name}: {told}")
        if judgement.unjudged:
            tell(f"failed: {name}: {told} could not be judged on all trials: {judgement.unjudged}")
        if judgement.passes and not as_json:
            say(f"passed: {name}: not {told}")
    return not all(judgement.passes for _, judgement in verdicts)


def _show(comparison: Comparison, everything: bool) -> None:
    names = [run.name for run in comparison.runs]
    if comparison.settings is None:
        say("The scenario of one of them is not at hand.")
    elif not comparison.settings:
        say("Their scenarios are the same.")
    show_settings("What differs between the scenarios", comparison.settings or (), names)
    show_settings("What differs between the versions", comparison.versions, names)
    rows = [row for row in comparison.rows if everything or row.metric in HEADLINE]
    _show_rows([row for row in rows if not row.is_equal], names)
    if equal := [row.metric for row in rows if row.is_equal and row.first is not None]:
        say(f"equal: {listed(equal)}")
    more = [row.metric for row in comparison.rows if row not in rows and not row.is_equal]
    if more or comparison.lists:
        say(f"{len(more)} other metrics and {len(comparison.lists)} lists of figures differ: see --all, --json")
    for run, parting, traced in zip(comparison.runs[1:], comparison.partings, comparison.traced, strict=True):
        _tell_parting(comparison.runs[0], run, parting, traced)


def _show_rows(rows: Sequence[Row], names: Sequence[str]) -> None:
    if not rows:
        return
    table = plain_table(
        "Figures", ("metric",), (names[0], *(column for name in names[1:] for column in (name, "difference")))
    )
    for row in rows:
        cells = [cell for held in row.others for cell in (figure(held.value), _apart(held))]
        table.add_row(metric_label(row.metric, row.unit), figure(row.first), *cells)
    show(table, WIDTH_UNWRAPPED)


def _apart(held: Held) -> str:
    if held.difference is None:
        return "-"
    return "0" if held.difference == 0 else f"{signed(held.difference)} ({share(held.relative)})"


def _tell_parting(first: Contender, run: Contender, parting: Divergence | None, traced: bool) -> None:
    if not traced:
        without = " and ".join(each.name for each in (first, run) if each.trace is None)
        say(f"Where {run.name} parts from {first.name} is not known: no trace in {without}.")
        return
    if parting is None:
        say(f"The traces of {first.name} and {run.name} are the same, event for event.")
        return
    say(f"{run.name} parts from {first.name} after {parting.common:,} events in common.")
    for recorded in parting.before:
        say(f"  both:  {_event(recorded, first)}")
    for each, parted in ((first, parting.first), (run, parting.second)):
        say(f"  {each.name}:  {_event(parted, each)}")
    if parting.differences:
        say("  They differ in " + "; ".join(map(_difference, parting.differences)) + ".")


def _event(recorded: Recorded | None, run: Contender) -> str:
    if recorded is None or run.trace is None:
        return "nothing more"
    return f"{instant(recorded.time_ns)} s  {event_words(recorded.event, labels(run.trace))}"


def _difference(difference: Difference) -> str:
    first, second = (_short(value) for value in _from_where_they_differ(difference.first, difference.second))
    return f"{difference.name}: {first} against {second}"


def _from_where_they_differ(first: Any, second: Any) -> tuple[Any, Any]:
    """Of two long texts, the parts around the first difference."""
    if not (isinstance(first, str) and isinstance(second, str)) or max(len(first), len(second)) <= SHOWN_CHARACTERS:
        return first, second
    pairs = zip(first, second, strict=False)
    at = next((place for place, (a, b) in enumerate(pairs) if a != b), min(len(first), len(second)))
    begin = max(0, at - SHOWN_CHARACTERS // 2)
    return tuple(("..." if begin else "") + text[begin:] for text in (first, second))  # type: ignore[return-value]


def _short(value: Any) -> str:
    if isinstance(value, str | int | float):
        text = str(value)
        return text if len(text) <= SHOWN_CHARACTERS else text[: SHOWN_CHARACTERS - 3] + "..."
    text = str(list(value))
    return text if len(text) <= SHOWN_CHARACTERS else f"{len(value)} entries"
