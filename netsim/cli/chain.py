"""`netsim inspect --message`: what became of a message, what led to it, what it led to."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.text import Text
from rich.tree import Tree

from netsim.cli.console import say, show, show_tree
from netsim.cli.names import Label, follow, instant, labels
from netsim.cli.tables import plain_table
from netsim.errors import ScenarioError
from netsim.metrics.causes import Cause, Causes, Sending, causal_chain
from netsim.metrics.story import Happening, Story
from netsim.metrics.traffic import outcome_at_addressee, role_of
from netsim.trace.events import BROADCAST, OUTCOMES, Frame, MessageDelivered
from netsim.units import NS_PER_MS


def message_command(trace: Path, message_id: int, depth: int, most: int) -> None:
    """One message: what became of it, what led to it, what it led to."""
    label, told, story = labels(trace), Causes(), Story(message_id)
    follow(trace, told)
    sending = told.sendings.get(message_id)
    if sending is None:
        raise ScenarioError(_no_message(told, message_id))
    follow(trace, story)
    say(sentence(sending, label))
    _show_story(story.happenings, label, most)
    show_chain(
        f"What led to #{message_id}, received by {label(sending.source)}",
        told,
        sending.causes,
        sending.source,
        label,
        depth,
        most,
    )
    _say_effects(told.effects(message_id), label, most)


def _no_message(told: Causes, message_id: int) -> str:
    if not told.sendings:
        return f"--message: the trace holds no message, got {message_id}"
    low, high = min(told.sendings), max(told.sendings)
    return f"--message: expected the number of a message of this trace, {low} to {high}, got {message_id}"


def sentence(sending: Sending, label: Label) -> str:
    """A message on one line."""
    fragments = f" in {sending.fragments} fragments" if sending.fragments > 1 else ""
    to = "all in range" if sending.destination == BROADCAST else label(sending.destination)
    return (
        f"#{sending.message_id}: {sending.kind}{_round(sending.round)}, {sending.size_byte} byte{fragments}, sent by "
        f"{label(sending.source)} to {to} at {instant(sending.sent_ns)} s"
    )


def _round(number: int | None) -> str:
    return "" if number is None else f" of round {number}"


def _show_story(happenings: Sequence[Happening], label: Label, most: int) -> None:
    table = plain_table("What became of it", ("s", "what", "from", "to", "outcome"), ())
    for happening in sorted(happenings, key=_begun_ns)[:most]:
        table.add_row(instant(_begun_ns(happening)), *_cells(happening, label))
    show(table)
    if len(happenings) > most:
        say(f"and {len(happenings) - most:,} more: see --top")
    elif not happenings:
        say("nothing that the trace tells")


def _begun_ns(happening: Happening) -> int:
    return happening.event.t_start_ns if isinstance(happening.event, Frame) else happening.time_ns


def _cells(happening: Happening, label: Label) -> tuple[str, str, str, str]:
    event = happening.event
    if isinstance(event, Frame):
        attempt = f", attempt {event.attempt + 1}" if event.attempt else ""
        what = f"{role_of(event)} frame{attempt}, {event.size_byte} byte"
        return what, label(event.source), label(event.destination), _outcome(event)
    if isinstance(event, MessageDelivered):
        hops = f"{event.hops} hop{'' if event.hops == 1 else 's'}"
        return "delivered", label(event.source), label(event.node), f"{event.latency_ns / NS_PER_MS:.4g} ms, {hops}"
    place = f"given up at {label(event.node)}"
    return place, label(event.source), label(event.destination), event.reason.replace("_", " ")


def _outcome(frame: Frame) -> str:
    """What became of a frame at its addressee; of a broadcast, at how many listeners what."""
    if frame.destination != BROADCAST:
        return outcome_at_addressee(frame).replace("_", " ")
    outcomes = [OUTCOMES[code] for code in frame.rx_outcome]
    counts = {outcome: outcomes.count(outcome) for outcome in sorted(set(outcomes))}
    return ", ".join(f"{count} {outcome.replace('_', ' ')}" for outcome, count in counts.items()) or "nobody in range"


def show_chain(
    title: str, told: Causes, causes: Iterable[int], reader: int, label: Label, depth: int, most: int
) -> None:
    """Print what led to what a node did, as a tree; see `causal_chain`."""
    chain = causal_chain(told, causes, reader, depth, most)
    if not chain:
        say(f"{title}: nothing that is named as a cause.")
        return
    tree = Tree(Text(title), guide_style="dim")
    for cause in chain[:most]:
        _grow(tree, cause, label)
    if len(chain) > most:
        tree.add(Text(f"and {len(chain) - most} more: see --top"))
    show_tree(tree)


def _grow(tree: Tree, cause: Cause, label: Label) -> None:
    branch = tree.add(Text(_line(cause, label)))
    for inner in cause.causes:
        _grow(branch, inner, label)


def _line(cause: Cause, label: Label) -> str:
    if cause.sending is None:
        return f"#{cause.message_id}, which this trace does not hold"
    sending = cause.sending
    received = "" if cause.received_ns is None else f", received {instant(cause.received_ns)} s"
    head = f"#{sending.message_id} {sending.kind}{_round(sending.round)} from {label(sending.source)}"
    return f"{head}, sent {instant(sending.sent_ns)} s{received}{_rest(cause)}"


def _rest(cause: Cause) -> str:
    if cause.told_at is not None:
        message, above = cause.told_at
        if message != cause.message_id:
            return f"; the same causes as #{message}"
        return f"; its causes: see it {f'under #{above}' if above else 'at the top'}"
    if cause.unfollowed:
        return f"; {cause.unfollowed} cause{'' if cause.unfollowed == 1 else 's'} not followed: see --depth, --top"
    return ""


def _say_effects(effects: Sequence[Sending], label: Label, most: int) -> None:
    if not effects:
        say("It led to no message.")
        return
    say("It led to:")
    for sending in effects[:most]:
        say(f"  {sentence(sending, label)}")
    if len(effects) > most:
        say(f"  and {len(effects) - most} more: see --top")
