"""Drawing in SVG: elements of the standard library's XML tree, numbers and colours as SVG writes them."""

from collections.abc import Iterable
from xml.etree import ElementTree as ET

from netsim.replay.style import Rgba

SVG = "http://www.w3.org/2000/svg"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"
Drawn = dict[str, str | float | None]
"""Attributes, as `add` takes them."""
CHARACTER = 0.58
"""Width of a character over the size of its font, about."""


def add(parent: ET.Element, tag: str, text: str | None = None, /, **attributes: str | float | None) -> ET.Element:
    """Append an element; underscores in attributes' names are hyphens, a trailing one is dropped, None is left out."""
    written = {
        name.rstrip("_").replace("_", "-"): value if isinstance(value, str) else number(value)
        for name, value in attributes.items()
        if value is not None
    }
    element = ET.SubElement(parent, tag, written)
    element.text = text
    return element


def number(value: float) -> str:
    """A coordinate, to a tenth of a point."""
    text = f"{value:.1f}"
    return "0" if text == "-0.0" else text.removesuffix(".0")


def colour(rgba: Rgba) -> str:
    """A colour without its opacity."""
    return "#{:02x}{:02x}{:02x}".format(*rgba[:3])


def line(*points: tuple[float, float]) -> str:
    """Path data of straight lines."""
    return "M" + "L".join(f"{number(x)} {number(y)}" for x, y in points)


def uprights(x: float, spans: Iterable[tuple[float, float]]) -> str:
    """Path data of upright lines below each other."""
    return "".join(f"M{number(x)} {number(top)}V{number(bottom)}" for top, bottom in spans)


def cross(x: float, y: float, half: float) -> str:
    """Path data of a cross."""
    return line((x - half, y - half), (x + half, y + half)) + line((x - half, y + half), (x + half, y - half))


def width_of(text: str, size: float) -> float:
    """How wide a text is, about."""
    return CHARACTER * size * len(text)
