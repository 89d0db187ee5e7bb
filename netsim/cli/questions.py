"""`netsim inspect`: which of its questions is asked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from netsim.cli.console import say
from netsim.cli.replay import trace_file
from netsim.errors import ScenarioError
from netsim.metrics.timeline import Window
from netsim.replay import node_ids
from netsim.study.info import INFO_FILE
from netsim.units import s_to_ns

if TYPE_CHECKING:
    from netsim.sequence import Asked

TOP_PAIRS = 20
TOP_LINES = 200


@dataclass(frozen=True, kw_only=True)
class Question:
    """The options of `netsim inspect`, as given.

    Attributes:
        nodes: Summary of these nodes only; chart of the frames from and to them.
        timeline: Node whose time line is asked for.
        sequence: File for a sequence chart.
        time: How time runs in the chart; None for non-linear.
        limit: Most frames in the chart; None for what a browser draws without delay.
        force: Whether the chart's file may exist.
        start_s: Of the time line or the chart.
        end_s: Of the time line or the chart.
        kinds: Message kinds of the time line or the chart.
        frames: Whether the time line tells frames.
        message: Message whose story is asked for.
        why: Node of which is asked why it spoke.
        round: In which round.
        at_s: Or when.
        depth: How many receptions a chain is followed back.
        top: How many lines.
    """

    nodes: str | None = None
    timeline: str | None = None
    sequence: Path | None = None
    time: str | None = None
    limit: int | None = None
    force: bool = False
    start_s: float | None = None
    end_s: float | None = None
    kinds: str | None = None
    frames: bool = False
    message: int | None = None
    why: str | None = None
    round: int | None = None
    at_s: float | None = None
    depth: int = 4
    top: int | None = None


def ask(given: Path, question: Question) -> None:
    """Answer the question asked; the summary if it is none in particular.

    Raises:
        ScenarioError: If the options do not go together.
    """
    if (given / INFO_FILE).exists():
        reports = " or ".join(str(path) for path in sorted(given.glob("report.*"))) or "the report in it"
        say(f"{given} is a study, of many runs: look at {reports}")
        return
    _check(question)
    trace = trace_file(given)
    if question.sequence is not None:
        from netsim.cli.sequence import sequence_command

        sequence_command(trace, question.sequence, _asked(question, trace), force=question.force)
    elif question.timeline is not None:
        from netsim.cli.timeline import timeline_command

        timeline_command(trace, question.timeline, _window(question))
    elif question.message is not None:
        from netsim.cli.chain import message_command

        message_command(trace, question.message, question.depth, question.top or TOP_LINES)
    elif question.why is not None:
        from netsim.cli.why import why_command

        most = question.top or TOP_LINES
        why_command(trace, question.why, question.round, question.at_s, question.depth, most)
    else:
        from netsim.cli.inspect import inspect_command

        inspect_command(trace, question.nodes, question.top or TOP_PAIRS)


def _asked(question: Question, trace: Path) -> "Asked":
    from netsim.sequence import Asked
    from netsim.sequence.gather import FRAME_LIMIT

    return Asked(
        start_ns=s_to_ns(question.start_s or 0.0),
        end_ns=None if question.end_s is None else s_to_ns(question.end_s),
        nodes=None if question.nodes is None else node_ids(trace, question.nodes.split(",")),
        kinds=_kinds(question),
        limit=question.limit or FRAME_LIMIT,
        time=question.time or "nonlinear",
    )


def _kinds(question: Question) -> frozenset[str] | None:
    return None if question.kinds is None else frozenset(part.strip() for part in question.kinds.split(","))


def _window(question: Question) -> Window:
    return Window(
        start_ns=s_to_ns(question.start_s or 0.0),
        end_ns=None if question.end_s is None else s_to_ns(question.end_s),
        kinds=_kinds(question),
        frames=question.frames,
        most=question.top or TOP_LINES,
    )


def _check(question: Question) -> None:
    """Refuse options that would have no effect."""
    asked = {
        "--sequence": question.sequence,
        "--nodes": question.nodes if question.sequence is None else None,
        "--timeline": question.timeline,
        "--message": question.message,
        "--why": question.why,
    }
    given = [option for option, value in asked.items() if value is not None]
    if len(given) > 1:
        message = f"{' and '.join(given)}: expected one question at a time; ask them one after the other"
        raise ScenarioError(message)
    times = {
        "--start": question.start_s,
        "--end": question.end_s,
        "--kinds": question.kinds,
    }
    _belong("--timeline or --sequence", question.timeline is not None or question.sequence is not None, times)
    _belong("--timeline", question.timeline is not None, {"--frames": question.frames or None})
    chart = {"--time": question.time, "--limit": question.limit, "--force": question.force or None}
    _belong("--sequence", question.sequence is not None, chart)
    _belong("--why", question.why is not None, {"--round": question.round, "--at": question.at_s})
    if question.why is not None and (question.round is None) == (question.at_s is None):
        message = "--why: expected --round N or --at SECONDS with it, one of the two"
        raise ScenarioError(message)


def _belong(to: str, is_there: bool, options: Mapping[str, object]) -> None:
    if not is_there and (stray := [option for option, value in options.items() if value is not None]):
        message = f"{', '.join(stray)}: expected with {to} only"
        raise ScenarioError(message)
