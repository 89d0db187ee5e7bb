"""Payload encodings: numbers to bytes and back, at a chosen precision.

What is sent is what is charged for, and what the receiver decodes is what it uses: a float64 array survives bit for bit,
narrower ones lose what they lose.
"""

import struct
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
FloatWidth = Literal["float64", "float32", "float16"]
_DTYPES: dict[str, np.dtype[Any]] = {
    "float64": np.dtype("<f8"),
    "float32": np.dtype("<f4"),
    "float16": np.dtype("<f2"),
}
_LOWEST: dict[str, float] = {name: float(np.finfo(dtype).min) for name, dtype in _DTYPES.items()}


def encode_floats(values: ArrayLike, width: FloatWidth) -> bytes:
    """Lay out an array (or a sequence of numbers), little-endian, without its shape.

    Infinities and NaN survive at every width. A finite number beyond the range of the width becomes the largest finite
    one: a very small probability in the log domain must not turn into an impossible one.
    """
    numbers = np.asarray(values, dtype=np.float64)
    limit = -_LOWEST[width]
    clipped = np.where(np.isfinite(numbers), np.clip(numbers, -limit, limit), numbers)
    return clipped.astype(_DTYPES[width]).tobytes()


def decode_floats(data: bytes, width: FloatWidth) -> FloatArray:
    """The array that `encode_floats` laid out, one-dimensional, as float64.

    Raises:
        ValueError: If the bytes are not a whole number of entries.
    """
    return np.frombuffer(data, dtype=_DTYPES[width]).astype(np.float64)


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
