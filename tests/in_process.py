"""The command line in the test's own process, where the process is no part of what is tested: one costs a second."""

import io
import sys
import traceback
import warnings
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from netsim.cli import main

NOT_SHOWN = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)
"""What Python keeps to itself unless asked."""


@dataclass(frozen=True)
class Ended:
    """How a command ended; named as in `subprocess.CompletedProcess`."""

    returncode: int
    stdout: str
    stderr: str


def netsim(*arguments: object, cwd: Path | None = None) -> Ended:
    """Run `netsim` with some arguments, in a folder if one is given."""
    out, err = io.StringIO(), io.StringIO()
    with (
        chdir(cwd or Path.cwd()),
        redirect_stdout(out),
        redirect_stderr(err),
        mock.patch.object(sys, "argv", ["netsim", *map(str, arguments)]),
        warnings.catch_warnings(),
    ):
        warnings.resetwarnings()  # told, as to a user, instead of raised
        for kind in NOT_SHOWN:
            warnings.simplefilter("ignore", kind)
        status = _status()
    return Ended(status, out.getvalue(), err.getvalue())


def _status() -> int:
    """The exit status of the command line, whose traceback goes where Python's would."""
    try:
        main()
    except SystemExit as ended:
        return int(ended.code or 0)
    except Exception:
        traceback.print_exc()
        return 1
    return 0
