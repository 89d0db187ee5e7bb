"""The look of plain tables."""

from collections.abc import Iterable

from rich import box
from rich.table import Table


def plain_table(title: str, words: Iterable[str], numbers: Iterable[str]) -> Table:
    """A table without rows: columns of words on the left, columns of numbers after them."""
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
    for word in words:
        table.add_column(word, overflow="fold")
    for number in numbers:
        table.add_column(number, justify="right", overflow="fold")
    return table
