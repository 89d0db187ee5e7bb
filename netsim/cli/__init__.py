"""The command line. Each command lives in a module of its own and is loaded when it is called."""

import os
import sys
import warnings

from netsim.errors import NetsimError, ScenarioError

EXIT_FAILURE = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
EXIT_PIPE_CLOSED = 141
"""As of a process ended by SIGPIPE: neither success nor a failed gate."""


def main() -> None:
    """Entry point of `netsim`: errors become one line each and an exit status, tracebacks only with `--debug`."""
    try:
        from netsim.cli.app import app

        warnings.showwarning = _show_warning
        app()
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
    except ScenarioError as error:
        _fail(error, EXIT_BAD_INPUT)
    except NetsimError as error:
        _fail(error, EXIT_FAILURE)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # whoever read our output has had enough
        sys.exit(EXIT_PIPE_CLOSED)
    except Exception as error:  # a defect of netsim: still one line, with the way to the traceback
        _fail(error, EXIT_FAILURE, f"internal error: {error!r} (add --debug for the traceback)")


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
