"""The two semirings of message passing, in the log domain, where a product is a sum and zero is minus infinity.

With `MAX` the combination of states is the maximum (max-product), with `SUM` the log of the sum of exponentials
(sum-product). Messages of both are normalised so that their exponentials sum to one (Chen et al. 2006, eqs 3 and 5).
"""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError

FloatArray = NDArray[np.float64]


class Semiring(Enum):
    """How the states that a message leaves out are combined."""

    MAX = "max"
    SUM = "sum"


def reduce(semiring: Semiring, array: FloatArray, axis: int | tuple[int, ...] | None = None) -> FloatArray:
    """Combine log weights along one or several axes: maximum or log-sum-exp.

    Args:
        semiring: Which combination.
        array: Log weights; -inf is an impossible state. At least one entry along the axes.
        axis: As in numpy; None combines everything, an empty tuple changes nothing.

    Returns:
        The array without those axes; -inf where every entry is -inf.
    """
    if semiring is Semiring.MAX:
        return np.asarray(array.max(axis=axis))
    peak = array.max(axis=axis, keepdims=True)
    shift = np.where(np.isneginf(peak), 0.0, peak)
    total = np.exp(array - shift).sum(axis=axis)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(total) + shift.max(axis=axis))


_WHOLE = 1 << 18


def contract(semiring: Semiring, weights: FloatArray, table: FloatArray) -> FloatArray:
    """Combine the first axis of `weights[a, ..., None] + table[a, b]`; a large sum is never held as a whole.

    Args:
        semiring: Which combination.
        weights: Log weights, shape (n, ...).
        table: Log potential, shape (n, m).

    Returns:
        Shape (..., m); -inf where every entry is -inf.
    """
    if weights.size * table.shape[1] <= _WHOLE:
        spread = table.reshape(len(table), *(1,) * (weights.ndim - 1), -1)
        return reduce(semiring, weights[..., None] + spread, 0)
    peak = weights[0][..., None] + table[0]
    for weight, row in zip(weights[1:], table[1:], strict=True):
        np.maximum(peak, weight[..., None] + row, out=peak)
    if semiring is Semiring.MAX:
        return np.asarray(peak)
    shift = np.where(np.isneginf(peak), 0.0, peak)
    total = np.zeros_like(peak)
    for weight, row in zip(weights, table, strict=True):
        total += np.exp(weight[..., None] + row - shift)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(total) + shift)


def log_normalise(message: FloatArray) -> FloatArray:
    """Shift a log message so that its exponentials sum to one, for both semirings.

    Args:
        message: Log weights of any shape, -inf for impossible states.

    Raises:
        ScenarioError: When every entry is -inf: no state is possible, so that the model contradicts itself (or an
            encoding on the way has rounded every possible state to zero). A uniform message would hide that.
    """
    peak = message.max()
    if not peak > -np.inf:
        text = "every state of a message is impossible: the factors of the model contradict one another"
        raise ScenarioError(text)
    shifted = message - peak
    return np.asarray(shifted - np.log(np.exp(shifted).sum()))


def uniform(size: int) -> FloatArray:
    """The normalised message that says nothing: what messages start from."""
    return np.full(size, -np.log(size))
