"""Where output goes: results to standard output, everything on the way to standard error.

Lines go out as they are: never wrapped, so that paths and commands can be copied. Tables go through rich.
"""

import sys

from rich.console import Console
from rich.table import Table
from rich.tree import Tree

WIDTH_ELSEWHERE = 100
"""Width of tables that go into a file or a pipe."""
WIDTH_UNWRAPPED = 10_000
"""More than any line of a tree or of a table of figures takes."""

err = Console(stderr=True, highlight=False)


def say(line: str) -> None:
    """A line of results."""
    sys.stdout.write(f"{line}\n")


def tell(line: str) -> None:
    """A line about what is going on, or wrong."""
    sys.stderr.write(f"{line}\n")


def counted(number: int, noun: str) -> str:
    """A number with its noun: `1 trial`, `2 trials`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def show(table: Table, elsewhere: int = WIDTH_ELSEWHERE) -> None:
    """A table of results; `elsewhere` is its greatest width in a file or a pipe."""
    Console(highlight=False, width=None if sys.stdout.isatty() else elsewhere).print(table)


def show_tree(tree: Tree) -> None:
    """A tree of results; in a file or a pipe its lines are not wrapped, so that each stays one."""
    Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH_UNWRAPPED).print(tree)


def is_terminal() -> bool:
    """Whether somebody watches standard error."""
    return sys.stderr.isatty()
