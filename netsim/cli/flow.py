"""`netsim flow`."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from netsim.cli.console import counted, say, show
from netsim.cli.flow_trees import show_trees
from netsim.cli.pictures import check_picture
from netsim.cli.replay import trace_file
from netsim.errors import ScenarioError
from netsim.flow.load import Flow, load_flow_or_trees
from netsim.flow.rounds import Round
from netsim.flow.trees import SpanningTrees
from netsim.units import NS_PER_S

_DRAWN = 12
_NAMED = 8

Names = Mapping[int, str]


def flow_command(given: Path, out: Path | None, rounds: str | None, columns: int, *, as_json: bool) -> None:
    """Print the rounds of a run or the trees it grew, and draw them if a picture is asked for."""
    check_picture(out)
    flow = load_flow_or_trees(trace_file(given))
    if isinstance(flow, SpanningTrees):
        show_trees(flow, out, rounds, columns, as_json=as_json)
        return
    chosen = None if rounds is None else chosen_rounds(rounds, len(flow.rounds) - 1)
    numbers = chosen if chosen is not None else list(range(flow.last_active + 1))
    if chosen is not None and out is not None:
        _check_count(chosen)
    if as_json:
        say(json.dumps([plain_round(each, _names(flow)) for each in _picked(flow, numbers)], indent=1))
    else:
        _print(flow, numbers)
    if out is not None:
        _draw(flow, chosen, columns, out, quiet=as_json)


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
        table.add_row(f"{each.number}", *(f"{count:,}" for count in counts), _told(flow, each, names))
    show(table)
    silent = len(flow.rounds) - 1 - flow.last_active
    messages = sum(len(each.messages) for each in flow.rounds)
    woken = sum(len(each.woken) for each in flow.rounds)
    rest = f"; nothing was sent in the last {counted(silent, 'round')}" if silent else ""
    say(f"{counted(len(names), 'vertex') if len(names) == 1 else f'{len(names)} vertices'}, {messages:,} messages, "
        f"woken {counted(woken, 'time')}{rest}")  # fmt: skip
    if flow.hosts.changes:
        say(f"down: {', '.join(_downs(flow))}")


def _nodes(flow: Flow) -> Names:
    return {int(node): name for node, name in zip(flow.nodes.node, flow.nodes.name, strict=True)}


def _downs(flow: Flow) -> Iterator[str]:
    """The nodes that went down, each time, with when they came up again."""
    nodes = _nodes(flow)
    for node, changes in sorted(flow.hosts.changes.items()):
        told = [f"{'from' if is_down else 'to'} {time_ns / NS_PER_S:.6g} s" for time_ns, is_down in changes]
        yield f"{nodes.get(node, str(node))} {' '.join(told)}"


def _told(flow: Flow, this: Round, names: Names) -> str:
    """Who took a vertex over; who woke and after whom, the first few."""
    nodes = _nodes(flow)
    moved = [
        f"{names[each.vertex]} taken over by {nodes[each.host]} from {nodes[each.before]}"
        for each in flow.hosts.taken_over_for(this.number)
    ]
    here = {each.vertex for each in flow.hosts.taken_over_for(this.number)}
    told = [
        names[vertex] + (f" after {', '.join(names[each] for each in sources)}" if sources else "")
        for vertex, sources in this.woken.items()
        if sources or vertex not in here
    ]
    more = [f"{len(told) - _NAMED} more"] if len(told) > _NAMED else []
    return "; ".join([*moved, *told[:_NAMED], *more])


def _check_count(numbers: Sequence[int]) -> None:
    from netsim.flow.picture import MOST_PANELS

    if len(numbers) > MOST_PANELS:
        message = f"--rounds: expected at most {MOST_PANELS} rounds in one picture, got {len(numbers)}; draw several"
        raise ScenarioError(message)


def _draw(flow: Flow, chosen: Sequence[int] | None, columns: int, out: Path, *, quiet: bool) -> None:
    """Draw the rounds chosen; else the first ones that are not empty and not as the one before."""
    from netsim.flow.picture import write_picture

    drawn = flow.telling[:_DRAWN] if chosen is None else chosen
    write_picture(flow, drawn, columns, out)
    if not quiet:
        is_cut = chosen is None and len(drawn) < len(flow.telling)
        end = drawn[-1] if is_cut else flow.last_active
        left_out = [number for number in range(end + 1) if number not in drawn] if chosen is None else []
        alike = f", without {spans(left_out)}: nothing was sent, or the same as before" if left_out else ""
        later = "; for later ones: --rounds" if is_cut else ""
        say(f"wrote {out}: round{'s' if len(drawn) > 1 else ''} {spans(drawn)}{alike}{later}")


def spans(numbers: Sequence[int]) -> str:
    """Ascending numbers as ranges: `0-2, 7`."""
    first_of = {number - place: number for place, number in reversed(list(enumerate(numbers)))}
    last_of = {number - place: number for place, number in enumerate(numbers)}
    return ", ".join(
        f"{first}" if first == last_of[key] else f"{first}-{last_of[key]}" for key, first in sorted(first_of.items())
    )
