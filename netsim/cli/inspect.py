"""`netsim inspect`."""

import json
import math
import warnings
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from netsim.cli.console import say, show
from netsim.cli.replay import trace_file
from netsim.cli.summary import figures_table, part_table
from netsim.cli.tables import plain_table
from netsim.errors import TraceError
from netsim.metrics.collect import metrics_of
from netsim.metrics.conversations import Conversation, Conversations
from netsim.replay import node_ids
from netsim.scenario.folder import METRICS_FILE
from netsim.trace.events import BROADCAST, EnergyLedger, Frame, NodeTable
from netsim.trace.reader import (
    TruncatedTraceWarning,
    is_complete,
    last_time_ns,
    read_trace,
    trace_attachment,
    trace_metadata,
)
from netsim.units import NS_PER_S

Pair = tuple[int, int]


def inspect_command(given: Path, nodes: str | None, top: int) -> None:
    """Summary, ledger and who talked to whom."""
    trace = trace_file(given)
    chosen = None if nodes is None else node_ids(trace, nodes.split(","))
    names: dict[int, str] = {}
    ledger: EnergyLedger | None = None
    conversations = Conversations()
    take = conversations.handlers()[Frame]
    for time_ns, event in read_trace(trace, {NodeTable.topic, EnergyLedger.topic, Frame.topic}):
        if isinstance(event, Frame):
            take(event, time_ns)
        elif isinstance(event, NodeTable):
            names = dict(zip(map(int, event.node), event.name, strict=True))
        elif isinstance(event, EnergyLedger):
            ledger = event
    if chosen is None:
        _show_figures(trace)
    _show_ledger(
        ledger, chosen, "the trace is cut short" if not is_complete(trace) else "the run did not come to its end"
    )
    _show_conversations(conversations.found, names, chosen, top)


def _show_figures(trace: Path) -> None:
    """The metrics that the trace carries; of a run that was killed, those of the part that is there."""
    metadata = trace_metadata(trace)
    title = f"{metadata.get('scenario', trace.name)} (seed {metadata.get('seed', '?')})"
    try:
        carried: Mapping[str, Any] = json.loads(trace_attachment(trace, METRICS_FILE))
    except TraceError:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", TruncatedTraceWarning)  # it was told already
            figures = metrics_of(read_trace(trace))
        show(part_table(title, figures, last_time_ns(trace) / NS_PER_S))
        return
    show(figures_table(title, carried))


def _show_ledger(ledger: EnergyLedger | None, chosen: Collection[int] | None, why_none: str) -> None:
    if ledger is None:
        say(f"no energy ledger: {why_none}")
        return
    energy_j: defaultdict[tuple[str, str, str], list[float]] = defaultdict(list)
    time_s: defaultdict[tuple[str, str, str], list[float]] = defaultdict(list)
    columns = (ledger.node, ledger.device, ledger.state, ledger.kind, ledger.energy_j, ledger.time_s)
    for node, device, state, kind, joules, seconds in zip(*columns, strict=True):
        if chosen is None or node in chosen:
            energy_j[device, state, kind].append(float(joules))
            time_s[device, state, kind].append(float(seconds))
    total_j = math.fsum(joules for row in energy_j.values() for joules in row)
    table = plain_table("Where the energy went", ("device", "state", "for message kind"), ("J", "share", "s"))
    for key in sorted(energy_j, key=lambda key: (-math.fsum(energy_j[key]), key)):
        joules = math.fsum(energy_j[key])
        share = f"{100 * joules / total_j:.2f} %" if total_j else "-"
        table.add_row(*key, f"{joules:.4g}", share, f"{math.fsum(time_s[key]):.4g}")
    show(table)
    say(f"energy in all: {total_j:.6g} J")


def _show_conversations(
    found: Mapping[Pair, Conversation], names: Mapping[int, str], chosen: Collection[int] | None, top: int
) -> None:
    mine = [pair for pair in found if chosen is None or not {*pair}.isdisjoint(chosen)]
    busiest = sorted(mine, key=lambda pair: (-found[pair].frames, pair))
    table = plain_table(
        "Who talked to whom", ("from", "to"), ("data frames", "retries", "bytes", "received", "lost to")
    )
    for pair in busiest[:top]:
        table.add_row(*(_name(node, names) for node in pair), *_cells(found[pair], pair[1] == BROADCAST))
    show(table)
    if len(busiest) > top:
        say(f"and {len(busiest) - top} more pairs: see --top")


def _name(node: int, names: Mapping[int, str]) -> str:
    return "all" if node == BROADCAST else names.get(node, str(node))


def _cells(conversation: Conversation, is_broadcast: bool) -> Iterator[str]:
    yield from (f"{conversation.frames:,}", f"{conversation.retries:,}", f"{conversation.frame_byte:,}")
    if is_broadcast:
        yield from ("-", "-")
        return
    yield f"{100 * conversation.outcomes['received'] / conversation.frames:.1f} %"
    lost = [(outcome, count) for outcome, count in conversation.outcomes.most_common() if outcome != "received"]
    yield ", ".join(f"{count:,} {outcome}" for outcome, count in lost)
