"""What a report is made of: sections of text, lists, tables, pictures and code; rendered as Markdown and as HTML.

Text is a little Markdown: **bold**, `code`, and a backslash before a character that is to stand for itself.
"""

import re
from dataclasses import dataclass, field

SPECIAL = re.compile(r"([\\`*_|<>\[\]#])")


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph."""

    text: str
    kind: str = "text"


@dataclass(frozen=True, slots=True)
class Bullets:
    """A list."""

    items: tuple[str, ...]
    kind: str = "bullets"


@dataclass(frozen=True, slots=True)
class Table:
    """A table.

    Attributes:
        header: Names of the columns, units included.
        rows: Cells.
        left: How many of the first columns hold words; the others are aligned right.
        left_last: How many of the last columns hold words.
        caption: What it shows and how to read it.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left: int = 1
    left_last: int = 0
    caption: str = ""
    kind: str = "table"

    @property
    def words(self) -> tuple[bool, ...]:
        """Of each column, whether it holds words."""
        count = len(self.header)
        return tuple(place < self.left or place >= count - self.left_last for place in range(count))


@dataclass(frozen=True, slots=True)
class Picture:
    """A plot: its file's stem in the folder `plots`, what it shows, and the same in words for those who cannot see it."""

    stem: str
    caption: str
    alt: str
    kind: str = "picture"


@dataclass(frozen=True, slots=True)
class Code:
    """Something to be copied: a command, a file. Folded away if `title` is given."""

    text: str
    language: str = ""
    title: str = ""
    kind: str = "code"


Block = Text | Bullets | Table | Picture | Code


@dataclass(frozen=True, slots=True)
class Section:
    """A heading with what stands below it."""

    title: str
    blocks: tuple[Block, ...] = ()

    @property
    def anchor(self) -> str:
        """Its name in links."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True, slots=True)
class Page:
    """A whole report."""

    title: str
    question: str
    intro: tuple[Block, ...]
    sections: tuple[Section, ...] = field(default=())


def plain(text: object) -> str:
    """Text that came from elsewhere, so that none of its characters is taken for Markdown; on one line."""
    return SPECIAL.sub(r"\\\1", " ".join(str(text).split()))


def prose(text: str) -> str:
    """Text of our own that may hold `code`; on one line and fit for the cell of a table."""
    return re.sub(r"([*|<>\[\]])", r"\\\1", " ".join(text.split()))


def code(text: object) -> str:
    """Text as code on one line."""
    return "`" + " ".join(str(text).split()).replace("`", "'") + "`"
