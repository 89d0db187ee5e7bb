"""Plain scalars of a YAML file to Python values, by the core schema of YAML 1.2.2 (section 10.3.2).

Hence `1e-3` is a number, while `yes`, `on` and `2024-01-01` are text.
"""

import json
import math
import re

Scalar = None | bool | int | float | str

LONGEST_INT = 1000
LONGEST_SHOWN = 60

_WORDS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
    **{sign + word: math.inf for sign in ("", "+") for word in (".inf", ".Inf", ".INF")},
    **{"-" + word: -math.inf for word in (".inf", ".Inf", ".INF")},
}
_INT = re.compile(r"[-+]?[0-9]+", re.ASCII)
_OTHER_INT = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+", re.ASCII)
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)

_PLAIN = re.compile(r"[A-Za-z_][\w./+-]*")
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\ufeff": "\\ufeff"}


def scalar_value(text: str) -> Scalar:
    """The value of an unquoted scalar.

    Args:
        text: The scalar as written, without quotes.

    Returns:
        None, a bool, an int, a float, or the text itself. Integers of more than `LONGEST_INT` digits become infinite
        floats: no quantity is that large, and converting them would take time quadratic in their length.
    """
    if text in _WORDS:
        return _WORDS[text]
    if _INT.fullmatch(text):
        return int(text) if len(text) <= LONGEST_INT else math.copysign(math.inf, -1 if text[0] == "-" else 1)
    if _OTHER_INT.fullmatch(text):
        return int(text, 0) if len(text) <= LONGEST_INT else math.inf
    return float(text) if _FLOAT.fullmatch(text) else text


def show(value: object) -> str:
    """A value as a user would write it in YAML, in flow style, on one line and shortened."""
    text = _flow(value)
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 3] + "..."


def _flow(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{show(key)}: {show(item)}" for key, item in list(value.items())[:10]) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(show(item) for item in value[:10]) + (", ...]" if len(value) > 10 else "]")
    return show_scalar(value)


def show_scalar(value: object) -> str:
    """A scalar as YAML: text that YAML would read as something else gets quotes."""
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ("-.inf" if value < 0 else ".inf")
    if not isinstance(value, str):
        return repr(value)
    return value if _PLAIN.fullmatch(value) and scalar_value(value) == value else quoted(value)


def quoted(text: str) -> str:
    """Text in double quotes, on one line, with escapes for whatever does not print."""
    return '"' + "".join(_ESCAPES.get(char) or (char if char.isprintable() else _escape(char)) for char in text) + '"'


def _escape(char: str) -> str:
    code = ord(char)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
