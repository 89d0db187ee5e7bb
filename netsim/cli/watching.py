"""What long commands have in common: a bar on a terminal, and a first Ctrl-C that is a wish."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from rich.progress import Progress, ProgressColumn

from netsim.cli.console import err, is_terminal

LINE_EVERY_S = 5.0
"""How often a line tells of progress where there is no terminal."""


@contextmanager
def progress_bar(*columns: ProgressColumn) -> Iterator[Progress | None]:
    """A bar with these columns, which goes when it is done; None without a terminal."""
    if not is_terminal():
        yield None
        return
    with Progress(*columns, console=err, transient=True) as bar:
        yield bar


@contextmanager
def wish_to_end(note: Callable[[], None]) -> Iterator[None]:
    """Have the first Ctrl-C (or SIGTERM) noted only; the second one stops at once.

    Raises:
        KeyboardInterrupt: At the second one.
    """
    noted = False

    def on_signal(number: int, frame: FrameType | None) -> None:
        nonlocal noted
        if noted:
            raise KeyboardInterrupt
        noted = True
        note()

    before = {number: signal.signal(number, on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
