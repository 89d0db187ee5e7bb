"""Where output goes: results to standard output, everything on the way to standard error."""

import sys

from rich.console import Console

out = Console(soft_wrap=True, highlight=False)
err = Console(stderr=True, highlight=False)


def is_terminal() -> bool:
    """Whether somebody watches standard error."""
    return sys.stderr.isatty()
