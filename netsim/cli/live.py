"""`netsim replay --live`: watch a run that is still going."""

import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from netsim.cli.console import tell
from netsim.cli.watching import LINE_EVERY_S
from netsim.errors import ScenarioError
from netsim.replay import ReplayOptions, live, node_ids
from netsim.scenario.folder import TRACE_FILE
from netsim.trace.writer import partial_path
from netsim.units import NS_PER_S

_PATIENCE_S = 30.0
_LOOK_S = 0.2


def live_command(given: Path, options: ReplayOptions, nodes: str | None, *, serve: bool) -> None:
    """Wait for a run, and show what there is of it until its end and after.

    Args:
        given: The folder of the run, or its trace.
        options: What to show.
        nodes: Ids or names of the nodes to show.
        serve: To browsers instead of on the screen.
    """
    trace = given if given.suffix == Path(TRACE_FILE).suffix else given / TRACE_FILE
    trace = trace.with_name(trace.name.replace(".partial", ""))
    _await_events(trace)
    if nodes is not None:
        options = replace(options, nodes=node_ids(_there(trace), nodes.split(",")))
    announce = (lambda address: tell(f"open {address} in a browser; Ctrl-C ends")) if serve else None
    with suppress(KeyboardInterrupt):
        live(trace, options, announce=announce, told=_Teller("Ctrl-C ends" if serve else "close the viewer to end"))


class _Teller:
    """Says now and then how far the run is shown, and at its end how to end."""

    def __init__(self, ending: str) -> None:
        self._ending = ending
        self._told_s = -LINE_EVERY_S
        self._told_ns = 0

    def __call__(self, shown_ns: int, is_over: bool) -> None:
        if is_over:
            tell(f"the run is over, and all {shown_ns / NS_PER_S:.6g} s of it are shown; {self._ending}")
        elif shown_ns != self._told_ns and time.monotonic() >= self._told_s + LINE_EVERY_S:
            self._told_s, self._told_ns = time.monotonic(), shown_ns
            tell(f"shown up to {shown_ns / NS_PER_S:.6g} s")


def _there(trace: Path) -> Path:
    return trace if trace.exists() else partial_path(trace)


def _has_begun(path: Path) -> bool:
    from netsim.replay.live import has_begun

    return has_begun(path)


def _await_events(trace: Path) -> None:
    """Wait until a run has begun, and its first events are in the file.

    Raises:
        ScenarioError: If none begins.
    """
    deadline_s = time.monotonic() + _PATIENCE_S
    if not _there(trace).exists():
        tell(f"waiting for a run that writes {trace}")
    while not _there(trace).exists():
        if time.monotonic() > deadline_s:
            message = (
                f"{trace}: expected a run that is going, got none for {_PATIENCE_S:g} s; start it with "
                f"`netsim run SCENARIO --out {trace.parent}`"
            )
            raise ScenarioError(message)
        time.sleep(_LOOK_S)
    if not _has_begun(_there(trace)):
        tell("waiting for the first 4 MB of events, or the end of the run")
    while not _has_begun(_there(trace)):
        time.sleep(_LOOK_S)
