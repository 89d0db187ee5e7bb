"""`netsim inspect --why`: why did a node speak in a round, or why not?"""

from collections.abc import Sequence
from pathlib import Path

from netsim.cli.chain import sentence, show_chain
from netsim.cli.console import say
from netsim.cli.names import Label, follow, instant, labels, one_node
from netsim.errors import ScenarioError
from netsim.metrics.causes import Causes, Reason, Turn, reason_of
from netsim.metrics.tracking_wording import handoff_words
from netsim.trace.events import Handoff
from netsim.trace.reader import read_trace
from netsim.units import NS_PER_S, s_to_ns


def why_command(trace: Path, given: str, round_number: int | None, at_s: float | None, depth: int, most: int) -> None:
    """What led a node to speak in a round or at an instant."""
    label, told = labels(trace), Causes()
    node = one_node(trace, "--why", given)
    follow(trace, told)
    turns = told.turns(node)
    if not turns:
        say(f"{label(node)} sent nothing in this trace, and took part in no round.")
        return
    index = _by_round(turns, round_number, label(node)) if at_s is None else _by_time(turns, at_s, label(node))
    if index is None:
        say(f"{label(node)} had sent nothing by {at_s:g} s; its first turn is at {instant(turns[0].begun_ns)} s.")
        return
    reason = reason_of(turns, index)
    if at_s is not None:
        say(f"By {at_s:g} s the last turn of {label(node)} is {_which(reason.turn)}.")
    if reason.turn.messages:
        _tell_why(told, reason, node, label, depth, most)
        _tell_choices(trace, reason.turn, node, label)
    else:
        _tell_silence(turns, reason, label(node))


def _by_round(turns: Sequence[Turn], wanted: int | None, name: str) -> int:
    found = [index for index, turn in enumerate(turns) if turn.round is not None and turn.round == wanted]
    if not found:
        known = [turn.round for turn in turns if turn.round is not None]
        there = f"{min(known)} to {max(known)}" if known else "none: it takes no part in rounds, so use --at"
        message = f"--round: expected a round of {name}, {there}; got {wanted}"
        raise ScenarioError(message)
    if len(found) > 1:
        say(f"{name} came to round {wanted} {len(found)} times; this is the first: see --at for another.")
    return found[0]


def _by_time(turns: Sequence[Turn], at_s: float, name: str) -> int | None:
    """The turn under way at an instant."""
    if at_s < 0.0:
        message = f"--at: expected an instant of {name} from 0 s, got {at_s:g} s"
        raise ScenarioError(message)
    begun = [index for index, turn in enumerate(turns) if turn.begun_ns <= s_to_ns(at_s)]
    return begun[-1] if begun else None


def _tell_why(told: Causes, reason: Reason, node: int, label: Label, depth: int, most: int) -> None:
    turn, name = reason.turn, label(node)
    say(f"{name} spoke in {_which(turn)}:")
    for sending in turn.messages[:most]:
        say(f"  {sentence(sending, label)}")
    if len(turn.messages) > most:
        say(f"  and {len(turn.messages) - most} more: see --top")
    if turn.graph is not None:
        graph = turn.graph
        say(
            f"Of {graph.computed} graph messages that it computed it sent {len(graph.source)}, "
            f"{int(sum(graph.remote))} of them over the air; the largest change was {graph.largest_change:.4g}."
        )
    say(_before(reason, name))
    since = "before it" if reason.last_spoken is None else "since"
    show_chain(f"What {name} had received {since}", told, reason.causes, node, label, depth, most)


def _tell_choices(trace: Path, turn: Turn, node: int, label: Label) -> None:
    """Whom a leader chose in the turn, if it chose."""
    begun_ns = turn.begun_ns
    for _, event in read_trace(trace, {Handoff.topic}, begun_ns, begun_ns + 1):
        if isinstance(event, Handoff) and event.node == node:
            say(f"{label(node)} chose {handoff_words(event, label)}.")


def _which(turn: Turn) -> str:
    place = f"{instant(turn.begun_ns)} s"
    return f"the turn at {place}" if turn.round is None else f"round {turn.round} (begun {place})"


def _before(reason: Reason, name: str) -> str:
    last = reason.last_spoken
    if last is None:
        return f"It had not spoken before{_rounds(reason.silent)}."
    elapsed_s = (reason.turn.begun_ns - last.begun_ns) / NS_PER_S
    spoke = f"it spoke last in {_which(last)}, {elapsed_s:g} s before"
    if reason.silent:
        return f"Before, {name} was silent{_rounds(reason.silent)}: {spoke}."
    return f"It was not silent before: {spoke}."


def _rounds(count: int) -> str:
    return f" for {count} round{'' if count == 1 else 's'}" if count else ""


def _tell_silence(turns: Sequence[Turn], reason: Reason, name: str) -> None:
    turn = reason.turn
    say(f"{name} was silent in {_which(turn)}: it sent nothing.")
    if turn.graph is not None:
        graph = turn.graph
        kept = f", and sent {len(graph.source)} to variables of its own" if len(graph.source) else ""
        say(f"It computed {graph.computed} graph messages{kept}; the largest change was {graph.largest_change:.4g}.")
    if reason.last_spoken is not None:
        silent = f"It had been silent{_rounds(reason.silent)} before; it" if reason.silent else "It"
        say(f"{silent} spoke last in {_which(reason.last_spoken)}.")
    spoke = [turn.round for turn in turns if turn.round is not None and turn.messages]
    say(f"Rounds in which it spoke: {_spans(spoke)}." if spoke else "It spoke in no round.")


def _spans(numbers: Sequence[int]) -> str:
    """Numbers in order, those that follow one another as a span: `0-2, 5`."""
    spans: list[list[int]] = []
    for number in sorted(set(numbers)):
        if spans and number == spans[-1][-1] + 1:
            spans[-1] = [spans[-1][0], number]
        else:
            spans.append([number])
    return ", ".join("-".join(map(str, span)) for span in spans)
