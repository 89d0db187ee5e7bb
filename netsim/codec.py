"""Payload encodings: numbers to bytes and back, at a chosen precision.

What is sent is what is charged for, and what the receiver decodes is what it uses: a float64 array survives bit for bit,
narrower ones lose what they lose.

`uint8` is a uniform quantiser with a range of its own for every array. In front stand the range's ends, low and high, as
float16 (low rounded down, high rounded up), then a byte for every entry: a code c of 0 to 252 stands for
low + (high - low) c / 252, and 253, 254 and 255 for minus infinity, infinity and NaN. An entry is off by half a step,
(high - low) / 504, at most. It suits arrays of one kind and scale, such as a message in the log domain; not two numbers
with nothing in common.
"""

import struct
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
FloatWidth = Literal["float64", "float32", "float16"]
Precision = Literal["float64", "float32", "float16", "uint8"]
_DTYPES: dict[str, np.dtype[Any]] = {
    "float64": np.dtype("<f8"),
    "float32": np.dtype("<f4"),
    "float16": np.dtype("<f2"),
}
_LOWEST: dict[str, float] = {name: float(np.finfo(dtype).min) for name, dtype in _DTYPES.items()}


_LAST_CODE = 252
_MINUS_INFINITY, _INFINITY, _NAN = 253, 254, 255
_RANGE_BYTE = 4


def encode_floats(values: ArrayLike, width: Precision) -> bytes:
    """Lay out an array (or a sequence of numbers), little-endian, without its shape.

    Infinities and NaN survive at every width. A finite number beyond the range of the width (`uint8`: of float16) becomes
    the largest finite one: a very small probability in the log domain must not turn into an impossible one.
    """
    numbers = np.asarray(values, dtype=np.float64)
    if width == "uint8":
        return _quantised(numbers.ravel())
    return _clipped(numbers, width).astype(_DTYPES[width]).tobytes()


def decode_floats(data: bytes, width: Precision) -> FloatArray:
    """The array that `encode_floats` laid out, one-dimensional, as float64.

    Raises:
        ValueError: If no array is laid out in so many bytes.
    """
    if width == "uint8":
        return _restored(data)
    return np.frombuffer(data, dtype=_DTYPES[width]).astype(np.float64)


def size_byte(entries: int, width: Precision) -> int:
    """How many bytes `encode_floats` makes of an array of so many entries."""
    if width == "uint8":
        return _RANGE_BYTE + entries if entries else 0
    return entries * _DTYPES[width].itemsize


def float_width(width: Precision) -> FloatWidth:
    """The precision for numbers of different kinds or scales, such as coordinates: float16 where arrays are quantised."""
    return "float16" if width == "uint8" else width


def _clipped(numbers: FloatArray, width: FloatWidth) -> FloatArray:
    """Finite numbers brought into the range of the width."""
    limit = -_LOWEST[width]
    return np.where(np.isfinite(numbers), np.clip(numbers, -limit, limit), numbers)


def _quantised(numbers: FloatArray) -> bytes:
    """See the module."""
    if not len(numbers):
        return b""
    numbers = _clipped(numbers, "float16")
    is_finite = np.isfinite(numbers)
    finite = numbers[is_finite]
    low, high = _float16_range(finite)
    codes = np.select([np.isneginf(numbers), np.isposinf(numbers)], [_MINUS_INFINITY, _INFINITY], _NAN).astype(np.uint8)
    steps_per_unit = _LAST_CODE / (high - low) if high > low else 0.0
    codes[is_finite] = np.rint((finite - low) * steps_per_unit)
    return np.array([low, high], dtype=_DTYPES["float16"]).tobytes() + codes.tobytes()


def _float16_range(finite: FloatArray) -> tuple[float, float]:
    """The nearest float16 numbers between which all of them lie; 0 and 0 for none."""
    if not len(finite):
        return 0.0, 0.0
    least, greatest = finite.min(), finite.max()
    low, high = np.float16(least), np.float16(greatest)
    low = np.nextafter(low, np.float16(-np.inf)) if low > least else low
    high = np.nextafter(high, np.float16(np.inf)) if high < greatest else high
    return float(low), float(high)


def _restored(data: bytes) -> FloatArray:
    """See the module."""
    if not data:
        return np.empty(0)
    if len(data) <= _RANGE_BYTE:
        message = f"an 8-bit array of {len(data)} bytes: its range alone takes {_RANGE_BYTE}"
        raise ValueError(message)
    low, high = np.frombuffer(data[:_RANGE_BYTE], dtype=_DTYPES["float16"]).astype(np.float64)
    codes = np.frombuffer(data[_RANGE_BYTE:], dtype=np.uint8)
    numbers: FloatArray = low + (high - low) * codes / _LAST_CODE  # exact at both ends
    special = [codes == code for code in (_MINUS_INFINITY, _INFINITY, _NAN)]
    return np.select(special, [-np.inf, np.inf, np.nan], numbers)


class Record:
    """A fixed layout of whole numbers in front of a payload's variable part.

    Args:
        layout: `struct` format without byte order, such as `"HHB"`; little-endian and unpadded.
    """

    def __init__(self, layout: str) -> None:
        self._struct = struct.Struct("<" + layout)

    @property
    def size_byte(self) -> int:
        """How many bytes the fixed part takes."""
        return self._struct.size

    def pack(self, *fields: int) -> bytes:
        """The fixed part of a payload."""
        return self._struct.pack(*fields)

    def unpack(self, data: bytes, offset: int = 0) -> tuple[Any, ...]:
        """The fields at an offset.

        Raises:
            struct.error: If the bytes end too early.
        """
        return self._struct.unpack_from(data, offset)


_COUNT = Record("H")
_LONG_COUNT = Record("HI")
_IS_LONG = 0xFFFF


def encode_count(count: int) -> bytes:
    """How many entries follow: two bytes, from 65,535 on six.

    Raises:
        struct.error: Below 0, and above 4,294,967,295.
    """
    return _LONG_COUNT.pack(_IS_LONG, count) if count >= _IS_LONG else _COUNT.pack(count)


def decode_count(data: bytes, offset: int = 0) -> tuple[int, int]:
    """The inverse of `encode_count`: the count, and where what follows it begins.

    Raises:
        struct.error: If the bytes end too early.
    """
    (count,) = _COUNT.unpack(data, offset)
    if count < _IS_LONG:
        return int(count), offset + _COUNT.size_byte
    return int(_LONG_COUNT.unpack(data, offset)[1]), offset + _LONG_COUNT.size_byte
