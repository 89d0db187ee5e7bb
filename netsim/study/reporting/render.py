"""A report as Markdown and as HTML: two templates over one page."""

import base64
import html
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from netsim.study.reporting.blocks import Page

TOKEN = re.compile(r"\\(?P<plain>.)|\*\*(?P<bold>.+?)(?<!\\)\*\*|`(?P<code>[^`]*)`")


def markdown_of(page: Page) -> str:
    """The report as Markdown; pictures are referred to as plots/NAME.png."""
    return str(_environment().get_template("report.md.j2").render(page=page))


def html_of(page: Page, pictures: Mapping[str, bytes]) -> str:
    """The report as one HTML page that needs no other file.

    Args:
        page: The report.
        pictures: The plots by stem, as SVG.
    """

    def data(stem: str) -> str:
        return "data:image/svg+xml;base64," + base64.b64encode(pictures[stem]).decode("ascii")

    return str(_environment().get_template("report.html.j2").render(page=page, data=data))


def inline(text: str) -> Markup:
    """The little Markdown of a block's text as HTML."""
    parts, at = [], 0
    for found in TOKEN.finditer(text):
        parts.append(html.escape(text[at : found.start()], quote=False))
        parts.append(_token(found))
        at = found.end()
    parts.append(html.escape(text[at:], quote=False))
    return Markup("".join(parts))  # every part of it is escaped


def fence(text: str) -> str:
    """A fence that the text does not hold itself."""
    longest = max((len(run) for run in re.findall(r"`{3,}", text)), default=2)
    return "`" * (longest + 1)


def _token(found: "re.Match[str]") -> str:
    if found["plain"] is not None:
        return html.escape(found["plain"], quote=False)
    if found["bold"] is not None:
        return f"<strong>{inline(found['bold'])}</strong>"
    return f"<code>{html.escape(found['code'], quote=False)}</code>"


@lru_cache(maxsize=1)
def _environment() -> Environment:
    made = Environment(
        loader=PackageLoader("netsim.study"),
        undefined=StrictUndefined,
        autoescape=_is_html,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    filters: dict[str, Callable[..., Any]] = {"inline": inline, "fence": fence}
    made.filters.update(filters)
    return made


def _is_html(name: str | None) -> bool:
    return name is not None and ".html" in name
