"""The command line. Each command lives in a module of its own and is loaded when it is called."""

import os
import sys
import warnings
from typing import NoReturn

from netsim.errors import NetsimError, ScenarioError

EXIT_FAILURE = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
EXIT_PIPE_CLOSED = 141
"""As of a process ended by SIGPIPE: neither success nor a failed gate."""


def main() -> None:
    """Entry point of `netsim`: errors become one line each and an exit status, tracebacks only with `--debug`."""
    try:
        _run_app()
    except SystemExit as stop:
        if _has_lost_its_reader(stop):
            _leave_quietly()
        raise
    except BrokenPipeError:
        _leave_quietly()


def _run_app() -> None:
    try:
        from netsim.cli.app import app

        warnings.showwarning = _show_warning
        try:
            app()
        finally:
            sys.stdout.flush()  # here, so that a reader who is gone is seen while we can still say so
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
    except ScenarioError as error:
        _fail(error, EXIT_BAD_INPUT)
    except NetsimError as error:
        _fail(error, EXIT_FAILURE)
    except BrokenPipeError:
        raise
    except Exception as error:  # a defect of netsim: still one line, with the way to the traceback
        _fail(error, EXIT_FAILURE, f"internal error: {error!r} (add --debug for the traceback)")


def _has_lost_its_reader(stop: SystemExit) -> bool:
    """Whether a broken pipe lies behind an exit: typer and rich turn one into status 1, as of a run that failed."""
    return isinstance(stop.__context__, BrokenPipeError)


def _leave_quietly() -> NoReturn:
    """Whoever read our output has had enough: leave nothing to be written when Python ends."""
    for stream in (sys.stdout, sys.stderr):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    sys.exit(EXIT_PIPE_CLOSED)


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    """One line, without the place in our code."""
    sys.stderr.write(f"warning: {message}\n")


def _fail(error: Exception, status: int, text: str | None = None) -> None:
    """Print the error as lines without a traceback and leave."""
    if "--debug" in sys.argv[1:]:
        raise error
    findings = error.findings if isinstance(error, ScenarioError) else ()
    lines = [str(finding) for finding in findings] or [text or str(error)]
    for line in lines:
        sys.stderr.write(f"error: {line}\n")
    sys.exit(status)
