"""Numbers as a reader wants them: as many digits as are known, in a unit that needs no powers of ten."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

HARD_SPACE = "\N{NO-BREAK SPACE}"
MINUS = "\N{MINUS SIGN}"
PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
MOST_DECIMALS = 9
MOST_DIGITS = 6
"""Of a mean with its interval, however narrow that is."""
SMALL = 1e-4
"""Numbers below this are written with a power of ten."""
FACTORS_FROM = 100.0
"""Relative differences from this on are told by factors: nobody grasps +58757 %."""


@dataclass(frozen=True, slots=True)
class Scale:
    """A unit to show values in: `shown = value * factor`."""

    factor: float = 1.0
    unit: str = ""


def scale_for(unit: str, values: Iterable[float]) -> Scale:
    """The unit in which a metric's values read best.

    Args:
        unit: The metric's unit, `1` or empty for none.
        values: In that unit; those that are not finite are passed over.
    """
    sizes = sorted(abs(value) for value in values if math.isfinite(value) and value != 0)
    size = sizes[len(sizes) // 2] if sizes else 1.0
    if unit == "byte":
        return Scale(1e-3, "kB") if size >= 1e4 else Scale(1.0, "byte")
    if unit == "day":
        return Scale(1.0, "days")
    if unit not in ("J", "s"):
        return Scale(1.0, {"1": "", "m2": "m²"}.get(unit, unit))
    largest = 1.0 if unit == "s" else math.inf  # nobody says kiloseconds
    fitting = [(value, name) for value, name in PREFIXES if value <= min(largest, size)]
    factor, prefix = fitting[-1] if fitting else PREFIXES[0]
    return Scale(1.0 / factor, prefix + unit)


def decimals_of(half: float) -> int | None:
    """Digits after the point, so that two of an uncertainty show; None where there is none to go by."""
    if not math.isfinite(half) or half <= 0:
        return None
    return min(MOST_DECIMALS, max(0, 1 - math.floor(math.log10(half))))


def number(value: float | None, decimals: int | None = None, digits: int = 4) -> str:
    """A number with given decimals, or else with so many significant digits (`1.74e−7` if small); a dash for none."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else f"{MINUS}∞"
    if decimals is None and 0 < abs(value) < SMALL:
        return _with_power(value, digits)
    if decimals is None:
        size = math.floor(math.log10(abs(value))) if value else 0
        decimals = min(MOST_DECIMALS, max(0, digits - 1 - size))
        text = f"{value:.{decimals}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        text = f"{value:.{decimals}f}"
    if float(text) == 0:
        text = text.removeprefix("-")
    return text.replace("-", MINUS)


def _with_power(value: float, digits: int) -> str:
    """A small number: `1.74e−7`."""
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa}e{int(power)}".replace("-", MINUS)


def signed(value: float, decimals: int | None = None, digits: int = 4) -> str:
    """The same with its sign, as differences have."""
    text = number(value, decimals, digits)
    return text if text[0] in f"{MINUS}–∞" or not text.strip("0.") else f"+{text}"


def with_half(mean: float, half: float, scale: Scale, *, sign: bool = False) -> str:
    """Mean and half of its interval: `0.231 ± 0.054`, `(2.3 ± 0.5)e−6`; the mean alone where there is no interval.

    Args:
        mean: In the metric's unit.
        half: Half the width of its interval; NaN for none.
        scale: What to show it in.
        sign: Whether a sign is to be shown always.
    """
    mean, half = mean * scale.factor, half * scale.factor
    if half > 0 and (size := max(abs(mean), half)) < SMALL:
        power = math.floor(math.log10(size))
        return f"({with_half(mean / 10.0**power, half / 10.0**power, Scale(), sign=sign)})e{MINUS}{-power}"
    if half > abs(mean) and half >= 100:  # no digit of such a mean counts that is below the interval's first two
        mean, half = (round(value, 1 - math.floor(math.log10(half))) for value in (mean, half))
    decimals, most = decimals_of(half), _most_decimals(mean)
    is_cut = decimals is not None and decimals > most
    shown = (signed if sign else number)(mean, most if is_cut else decimals)
    if math.isnan(half) or math.isnan(mean):
        return shown
    spread = number(half, None if half < 10.0**-MOST_DECIMALS else decimals, digits=2)
    return f"{shown}{HARD_SPACE}±{HARD_SPACE}{spread if half > 0 else '0'}"


def _most_decimals(mean: float) -> int:
    """Digits after the point with which a mean has MOST_DIGITS that count."""
    if not math.isfinite(mean) or mean == 0:
        return MOST_DECIMALS
    return max(0, MOST_DIGITS - 1 - math.floor(math.log10(abs(mean))))


def interval(low: float, high: float, scale: Scale) -> str:
    """An interval in brackets: `[−0.03, 0.01]`."""
    low, high = low * scale.factor, high * scale.factor
    decimals = decimals_of((high - low) / 2)
    return f"[{number(low, decimals)}, {number(high, decimals)}]"


def percent(share: float) -> str:
    """A relative difference: `−15 %`, or `×590`; two digits at least, and no line break before the sign."""
    value = 100 * share
    if not math.isfinite(value):
        return ""
    if share >= FACTORS_FROM:
        factor = 1.0 + share
        return "×" + (f"{factor:.0f}" if factor < 9999.5 else f"{factor:.1e}".replace("e+0", "e").replace("e+", "e"))
    return f"{signed(value, 0) if abs(value) >= 9.95 else signed(value, digits=2)}{HARD_SPACE}%"
