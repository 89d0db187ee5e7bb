"""The belief as bytes: what a leader hands to the next.

The first byte tells the form, so that a receiver needs no settings: a grid (kind of cell list, precision, whether deflated),
or a mixture of normal distributions (number of components). Probabilities travel relative to the greatest; 8 bit are a
logarithmic scale (`netsim.codec`, uint8 of the logarithm): its step, at most log2(greatest / least) / 252, bounds the
divergence in bits, and no cell is lost.
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from netsim.algorithms.idsq_positions import BITMAP, LIST, RUNS, laid_positions, read_positions
from netsim.codec import Precision, decode_floats, encode_floats, size_byte
from netsim.kernels.belief_fit import Mixture, divergence_bit, fit_operations, fitted, on_grid, on_grid_operations
from netsim.kernels.grid_belief import Grid, GridBelief, proportional
from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray
from netsim.parameters import NonNegative, parameters

Compression = Literal["none", "run_length", "image", "best"]
Form = Literal["grid", "gaussian", "mixture"]
MOST_CELLS: Final = (1 << 16) - 1
"""Their number, too, goes as two bytes."""
LAYING_OUT: Final = 2 * FUNCTION_OPERATIONS
"""Operations to lay out a cell of the belief: its position, and its probability rounded and compared (a logarithm)."""
READING: Final = FUNCTION_OPERATIONS + 4
"""Operations to read a cell: its position, its probability (an exponential), their sum, and the division by it."""
_PRECISIONS: Final[tuple[Precision, ...]] = ("float64", "float32", "float16", "uint8")
_LAYOUTS: Final = {"none": (LIST,), "run_length": (RUNS,), "image": (BITMAP, RUNS, LIST), "best": (BITMAP, RUNS, LIST)}
_PARAMETRIC, _DEFLATED = 0x80, 0x40
_LEAST: Final[dict[Precision, float]] = {"float32": 2.0**-149, "float16": 2.0**-24}
"""Least number above 0 in a precision; smaller ones are sent as this, so that no cell is lost."""
_MIXTURE_SIZES: Final = (2, 3, 4)


@parameters
class BeliefForms:
    """In which forms a belief may go over the air; of those that lose little enough the shortest is sent."""

    forms: tuple[Form, ...] = ("grid",)
    """`grid`: probabilities of cells, always allowed; `gaussian`: mean and covariance, 21 bytes; `mixture`: two to four
    normal distributions, 49 to 97 bytes."""
    most_divergence_bit: NonNegative = 0.1
    """Most that `gaussian` and `mixture` may lose: Kullback-Leibler divergence of the belief from what is decoded."""
    compression: Compression = "best"
    """Of the grid. `none`: two bytes a cell; `run_length`: runs of cells; `image`: as `best`, and deflated where that helps;
    `best`: the shortest of list, bitmap and runs."""


DEFAULT_FORMS: Final = BeliefForms()


@dataclass(frozen=True, slots=True)
class Laid:
    """A belief laid out.

    Attributes:
        data: The bytes.
        form: `grid`, `gaussian` or `mixture`.
        divergence_bit: Kullback-Leibler divergence of the belief from what the bytes say.
        operations: Elementary operations it took, every form that was tried included.
    """

    data: bytes
    form: str
    divergence_bit: float
    operations: int


@dataclass(frozen=True, slots=True)
class BeliefCoder:
    """Beliefs to bytes and back.

    Args:
        grid: Which sender and receiver share; at most 65,535 cells.
        precision: Of a grid's probabilities.
        forms: What may be sent.

    Raises:
        ValueError: For a grid of more cells.
    """

    grid: Grid
    precision: Precision = "float32"
    forms: BeliefForms = DEFAULT_FORMS

    def __post_init__(self) -> None:
        """Cells go as two bytes."""
        if self.grid.size > MOST_CELLS:
            message = f"a belief of {self.grid.size:,} cells: at most {MOST_CELLS:,} can be sent, take larger cells"
            raise ValueError(message)

    def encode(self, belief: GridBelief) -> Laid:
        """The shortest form allowed."""
        laid = self._laid(self._grid_bytes(belief), "grid", belief, LAYING_OUT * len(belief.cells))
        operations = laid.operations
        for form, data, fitting in self._parametric(belief, len(laid.data)):
            operations += fitting
            other = self._laid(data, form, belief, operations)
            if other.divergence_bit <= self.forms.most_divergence_bit:
                return other
        return replace(laid, operations=operations)

    def decode(self, data: bytes) -> GridBelief:
        """The belief that bytes say.

        Raises:
            ValueError: For bytes that are no belief on this grid.
        """
        if not data:
            message = "no bytes where a belief should be"
            raise ValueError(message)
        head, body = data[0], data[1:]
        if head & _PARAMETRIC:
            return on_grid(_mixture_of(body, head & 0x0F), self.grid)
        if head & _DEFLATED:
            body = _inflated(body, 16 * self.grid.size)
        cells, used = read_positions(body, self.grid, head & 0x03)
        weights = _read_weights(body[used:], len(cells), _PRECISIONS[head >> 2 & 0x03], deflated=bool(head & _DEFLATED))
        return proportional(self.grid, cells, weights)

    def decoding_operations(self, data: bytes, belief: GridBelief) -> int:
        """Elementary operations to make a belief of the bytes that say it."""
        if data[0] & _PARAMETRIC:
            return on_grid_operations(self.grid.size, data[0] & 0x0F)
        return READING * len(belief.cells)

    def _laid(self, data: bytes, form: Form, belief: GridBelief, operations: int) -> Laid:
        return Laid(data, form, divergence_bit(belief, self.decode(data)), operations)

    def _grid_bytes(self, belief: GridBelief) -> bytes:
        kinds = _LAYOUTS[self.forms.compression]
        positions = {kind: laid_positions(belief.cells, self.grid, kind) for kind in kinds}
        kind = min(kinds, key=lambda each: len(positions[each]))
        head = kind | _PRECISIONS.index(self.precision) << 2
        weights = _weight_bytes(belief.probability, self.precision)
        plain = bytes([head]) + positions[kind] + weights
        if self.forms.compression != "image":
            return plain
        smoothed = _differences(weights) if self.precision == "uint8" else weights
        deflated = min((_deflated(positions[each] + smoothed), each) for each in kinds)
        packed = bytes([deflated[1] | head & 0x0C | _DEFLATED]) + deflated[0]
        return min(plain, packed, key=len)

    def _parametric(self, belief: GridBelief, below_byte: int) -> Iterator[tuple[Form, bytes, int]]:
        """Parametric forms shorter than so many bytes, the shortest first, and the operations that each takes."""
        sizes: dict[Form, tuple[int, ...]] = {"gaussian": (1,), "mixture": _MIXTURE_SIZES}
        for form in sizes:
            for size in sizes[form] if form in self.forms.forms else ():
                if _mixture_byte(size) < below_byte:
                    data = _mixture_bytes(fitted(belief, size))
                    yield form, data, fit_operations(len(belief.cells), self.grid.size, size)


def _mixture_byte(components: int) -> int:
    """Bytes of a mixture: four a number, of which one component has five."""
    return 1 + 4 * (6 * components if components > 1 else 5)


def _mixture_bytes(mixture: Mixture) -> bytes:
    count = len(mixture.weights)
    columns = [mixture.means_m, mixture.covariances_m2]
    numbers = np.hstack([mixture.weights[:, None], *columns] if count > 1 else columns)
    return bytes([_PARAMETRIC | count]) + encode_floats(numbers.ravel(), "float32")


def _mixture_of(body: bytes, count: int) -> Mixture:
    per = 6 if count > 1 else 5
    with np.errstate(invalid="ignore"):  # signalling NaN, refused below
        numbers = decode_floats(body, "float32")
    if count < 1 or len(numbers) != per * count or not np.all(np.isfinite(numbers)):
        message = f"{len(body)} bytes where {count} normal distributions should be"
        raise ValueError(message)
    table = numbers.reshape(count, per)
    weights = table[:, 0] if count > 1 else np.ones(1)
    xx, xy, yy = table[:, -3:].T
    if np.any(weights <= 0.0) or np.any(xx <= 0.0) or np.any(xx * yy <= xy**2):
        message = "a normal distribution without a positive weight or covariance"
        raise ValueError(message)
    return Mixture(weights / weights.sum(), table[:, -5:-3], table[:, -3:])


def _weight_bytes(probability: FloatArray, precision: Precision) -> bytes:
    relative = probability / probability.max()
    if precision == "uint8":
        return encode_floats(np.log2(relative), precision)
    return encode_floats(np.maximum(relative, _LEAST.get(precision, 0.0)), precision)


def _read_weights(data: bytes, count: int, precision: Precision, *, deflated: bool) -> FloatArray:
    if len(data) != size_byte(count, precision):
        message = f"{len(data)} bytes of probabilities for {count} cells"
        raise ValueError(message)
    if precision == "uint8":
        weights = np.exp2(decode_floats(_sums(data) if deflated else data, precision))
    else:
        with np.errstate(invalid="ignore"):
            weights = decode_floats(data, precision)
    if not np.all((weights > 0.0) & np.isfinite(weights)):
        message = "bytes of probabilities that are not above 0"
        raise ValueError(message)
    return weights


_RANGE_BYTE = 4


def _differences(codes: bytes) -> bytes:
    """8-bit codes as differences from the cell before, which deflate better; the range in front stays."""
    numbers = np.frombuffer(codes[_RANGE_BYTE:], dtype=np.uint8)
    return codes[:_RANGE_BYTE] + np.diff(numbers, prepend=np.uint8(0)).astype(np.uint8).tobytes()


def _sums(codes: bytes) -> bytes:
    numbers = np.frombuffer(codes[_RANGE_BYTE:], dtype=np.uint8)
    return codes[:_RANGE_BYTE] + np.cumsum(numbers, dtype=np.uint64).astype(np.uint8).tobytes()


def _deflated(data: bytes) -> bytes:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


def _inflated(data: bytes, most: int) -> bytes:
    unpacker = zlib.decompressobj(-15)
    try:
        found = unpacker.decompress(data, most)
    except zlib.error as error:
        message = f"deflated bytes that do not inflate: {error}"
        raise ValueError(message) from error
    if unpacker.unconsumed_tail or not unpacker.eof:
        message = "deflated bytes that end too early or are too many"
        raise ValueError(message)
    return found
