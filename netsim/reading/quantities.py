"""Units in keys: `radius_m` is in metres, `rate_bit_per_s` in bits per second.

A key's unit is read from its last words, so that messages can name it and convert what was given in another one.
"""

import math
import re
from dataclasses import dataclass

_SIMPLE: dict[str, tuple[str, str, float]] = {
    # suffix: (name, dimension, factor to the dimension's base)
    "ns": ("nanoseconds", "time", 1e-9),
    "us": ("microseconds", "time", 1e-6),
    "ms": ("milliseconds", "time", 1e-3),
    "s": ("seconds", "time", 1.0),
    "min": ("minutes", "time", 60.0),
    "h": ("hours", "time", 3600.0),
    "mm": ("millimetres", "length", 1e-3),
    "cm": ("centimetres", "length", 1e-2),
    "m": ("metres", "length", 1.0),
    "km": ("kilometres", "length", 1e3),
    "m2": ("square metres", "area", 1.0),
    "km2": ("square kilometres", "area", 1e6),
    "hz": ("hertz", "frequency", 1.0),
    "khz": ("kilohertz", "frequency", 1e3),
    "mhz": ("megahertz", "frequency", 1e6),
    "ghz": ("gigahertz", "frequency", 1e9),
    "dbm": ("dBm", "power", math.nan),
    "uw": ("microwatts", "power", 1e-6),
    "mw": ("milliwatts", "power", 1e-3),
    "w": ("watts", "power", 1.0),
    "nj": ("nanojoules", "energy", 1e-9),
    "uj": ("microjoules", "energy", 1e-6),
    "mj": ("millijoules", "energy", 1e-3),
    "j": ("joules", "energy", 1.0),
    "kj": ("kilojoules", "energy", 1e3),
    "bit": ("bits", "data", 1.0),
    "kbit": ("kilobits", "data", 1e3),
    "mbit": ("megabits", "data", 1e6),
    "byte": ("bytes", "data", 8.0),
    "kbyte": ("kilobytes", "data", 8e3),
    "bps": ("bits per second", "data/time", 1.0),
    "kbps": ("kilobits per second", "data/time", 1e3),
    "na": ("nanoamperes", "current", 1e-9),
    "ua": ("microamperes", "current", 1e-6),
    "ma": ("milliamperes", "current", 1e-3),
    "mv": ("millivolts", "voltage", 1e-3),
    "v": ("volts", "voltage", 1.0),
    "mah": ("milliampere-hours", "charge", 3.6),
    "ah": ("ampere-hours", "charge", 3600.0),
    "ma_min": ("milliampere-minutes", "charge", 0.06),
    "sqrt_min": ("square root of a minute", "square root of time", math.sqrt(60.0)),
    "db": ("decibels", "ratio", 1.0),
    "ppm": ("parts per million", "fraction", 1e-6),
    "percent": ("percent", "fraction", 1e-2),
    "deg": ("degrees", "angle", math.pi / 180.0),
    "rad": ("radians", "angle", 1.0),
    "celsius": ("degrees Celsius", "temperature", 1.0),
}
_SYMBOLS = {"sec": "s", "µs": "us", "μs": "us", "B": "byte", "bytes": "byte", "bits": "bit", "%": "percent", "°": "deg"}
_QUANTITY = re.compile(r"\s*([-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*([A-Za-zµμ%°/²0-9]+)\s*")


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of measurement.

    Attributes:
        suffix: As it stands in keys, such as `bit_per_s`.
        name: In words, such as `bits per second`.
        dimension: What it measures; only units of one dimension convert into each other.
        factor: How many base units of the dimension it is; NaN for dBm, which is logarithmic.
    """

    suffix: str
    name: str
    dimension: str
    factor: float

    def to_base(self, value: float) -> float:
        """A value in this unit, in the base unit of the dimension."""
        return 1e-3 * 10.0 ** (value / 10.0) if math.isnan(self.factor) else value * self.factor

    def from_base(self, value: float) -> float:
        """A value in the base unit, in this unit.

        Raises:
            ValueError: If the value has none in this unit (no power is no finite dBm).
        """
        return 10.0 * math.log10(value / 1e-3) if math.isnan(self.factor) else value / self.factor


def split_key(key: str) -> tuple[str, Unit | None]:
    """The stem and the unit of a key: `("speed", metres per second)` for `speed_m_per_s`."""
    words = key.split("_")
    for start in range(max(1, len(words) - 3), len(words)):
        unit = unit_of("_".join(words[start:]))
        if unit is not None:
            return "_".join(words[:start]), unit
    return key, None


def unit_of(suffix: str) -> Unit | None:
    """The unit a suffix names (`m`, `m_per_s`, `per_s`), or None."""
    over, divided, under = ("_" + suffix).partition("_per_")
    over = over.removeprefix("_")
    if not divided:
        return Unit(suffix, *_SIMPLE[suffix]) if suffix in _SIMPLE else None
    if under not in _SIMPLE or (over and over not in _SIMPLE):
        return None
    per, dimension, factor = _SIMPLE[under]
    singular = "hertz" if per == "hertz" else per.removesuffix("s")
    name, above, times = _SIMPLE[over] if over else ("", "1", 1.0)
    return Unit(suffix, f"{name} per {singular}".strip(), f"{above}/{dimension}", times / factor)


def parse_quantity(text: str) -> tuple[float, Unit] | None:
    """A number with a unit behind it, such as `10 ms`, or None if the text is nothing of the kind."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return None
    symbol = match[2].replace("²", "2").replace("/", "_per_")
    words = [_SYMBOLS.get(word, word.lower()) for word in symbol.split("_")]
    unit = unit_of("_".join(words))
    return None if unit is None else (float(match[1]), unit)


def convert(value: float, source: Unit, target: Unit) -> float | None:
    """A value in another unit, to 12 digits; None where the dimensions differ or it has no finite value there."""
    if source.dimension != target.dimension:
        return None
    try:
        converted = target.from_base(source.to_base(value))
    except (ValueError, OverflowError):
        return None
    return float(f"{converted:.12g}") if math.isfinite(converted) else None


def number_text(value: float) -> str:
    """A number as one would write it: `5` rather than `5.0`."""
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
