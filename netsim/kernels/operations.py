"""What counts as an operation where kernels say how much work they are, for the time and energy of a node's processor."""

from typing import Final

FUNCTION_OPERATIONS: Final = 20
"""Elementary floating-point operations (addition, product, comparison) of a square root, exponential, logarithm, sine,
arctangent or normal integral: about a polynomial of degree 8 with the reduction of its argument."""
