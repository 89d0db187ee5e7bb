"""`netsim flow`."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from netsim.cli.console import counted, say, show
from netsim.cli.flow_trees import show_trees
from netsim.cli.replay import trace_file
from netsim.errors import ScenarioError
from netsim.flow.load import Flow, load_flow_or_trees
from netsim.flow.rounds import Round
from netsim.flow.trees import SpanningTrees

_PICTURES = (".png", ".svg")
_DRAWN = 12
_NAMED = 8

Names = Mapping[int, str]


def flow_command(given: Path, out: Path | None, rounds: str | None, columns: int, *, as_json: bool) -> None:
    """Print the rounds of a run or the trees it grew, and draw them if a picture is asked for."""
    if out is not None and out.suffix.lower() not in _PICTURES:
        message = f"--out {out}: expected the name of a picture that ends in .png or .svg"
        raise ScenarioError(message)
    flow = load_flow_or_trees(trace_file(given))
    if isinstance(flow, SpanningTrees):
        show_trees(flow, out, rounds, columns, as_json=as_json)
        return
    chosen = None if rounds is None else chosen_rounds(rounds, len(flow.rounds) - 1)
    numbers = chosen if chosen is not None else list(range(flow.last_active + 1))
    if as_json:
        say(json.dumps([plain_round(each, _names(flow)) for each in _picked(flow, numbers)], indent=1))
    else:
        _print(flow, numbers)
    if out is not None:
        _draw(flow, numbers, chosen is None, columns, out, quiet=as_json)


def chosen_rounds(text: str, last: int) -> list[int]:
    """The rounds named in a list such as `0,2,5-7`, in order, each once.

    Raises:
        ScenarioError: If it is no such list, or names a round that the run has not.
    """
    found: set[int] = set()
    for part in text.split(","):
        low, dash, high = (piece.strip() for piece in part.partition("-"))
        if not low.isdecimal() or (dash and not high.isdecimal()) or (dash and int(high) < int(low)):
            message = f"--rounds: expected numbers and ranges such as 0-8 or 0,2,5-7, got {text!r}"
            raise ScenarioError(message)
        found.update((int(low), int(high or low)) if int(high or low) > last else range(int(low), int(high or low) + 1))
    if max(found) > last:
        message = f"--rounds: expected rounds from 0 to {last}, the last of this run; got {max(found)}"
        raise ScenarioError(message)
    return sorted(found)


def plain_round(this: Round, names: Names) -> dict[str, Any]:
    """A round for JSON, vertices by name."""
    return {
        "round": this.number,
        "time_ns": this.time_ns,
        "senders": [names[vertex] for vertex in sorted(this.senders)],
        "messages": [[names[source], names[to]] for source, to in this.messages],
        "over_air": this.over_air,
        "fell_silent": [names[vertex] for vertex in sorted(this.fell_silent)],
        "woken": [
            {"vertex": names[vertex], "after_messages_of": [names[each] for each in sources]}
            for vertex, sources in this.woken.items()
        ],
    }


def _names(flow: Flow) -> Names:
    return {int(vertex): name for vertex, name in zip(flow.model.variable, flow.model.name, strict=True)}


def _picked(flow: Flow, numbers: Sequence[int]) -> list[Round]:
    return [flow.rounds[number] for number in numbers]


def _print(flow: Flow, numbers: Sequence[int]) -> None:
    table = Table(box=box.SIMPLE_HEAD, title=f"Information flow: {flow.title}", title_justify="left")
    for column in ("round", "senders", "messages", "over the air", "fell silent", "woke"):
        table.add_column(column, justify="right")
    table.add_column("who woke, after messages of whom", overflow="fold")
    names = _names(flow)
    for each in _picked(flow, numbers):
        counts = (len(each.senders), len(each.messages), each.over_air, len(each.fell_silent), len(each.woken))
        table.add_row(f"{each.number}", *(f"{count:,}" for count in counts), _told(each, names))
    show(table)
    silent = len(flow.rounds) - 1 - flow.last_active
    messages = sum(len(each.messages) for each in flow.rounds)
    woken = sum(len(each.woken) for each in flow.rounds)
    rest = f"; nothing was sent in the last {counted(silent, 'round')}" if silent else ""
    say(f"{counted(len(names), 'vertex') if len(names) == 1 else f'{len(names)} vertices'}, {messages:,} messages, "
        f"woken {counted(woken, 'time')}{rest}")  # fmt: skip


def _told(this: Round, names: Names) -> str:
    """Who woke and after whom, the first few."""
    told = [
        names[vertex] + (f" after {', '.join(names[each] for each in sources)}" if sources else "")
        for vertex, sources in this.woken.items()
    ]
    more = [f"{len(told) - _NAMED} more"] if len(told) > _NAMED else []
    return "; ".join([*told[:_NAMED], *more])


def _draw(flow: Flow, numbers: Sequence[int], may_cut: bool, columns: int, out: Path, *, quiet: bool) -> None:
    from netsim.flow.picture import MOST_PANELS, write_picture

    if not may_cut and len(numbers) > MOST_PANELS:
        message = f"--rounds: expected at most {MOST_PANELS} rounds in one picture, got {len(numbers)}; draw several"
        raise ScenarioError(message)
    drawn = numbers[:_DRAWN] if may_cut else numbers
    write_picture(flow, drawn, columns, out)
    if quiet:
        return
    left = f" of rounds {drawn[0]}-{drawn[-1]}; for later ones: --rounds" if len(drawn) < len(numbers) else ""
    say(f"wrote {out}{left}")
