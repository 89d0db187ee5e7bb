"""Products of many probabilities, smaller than any float."""

import math
import sys
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Product:
    """A product of positive factors, mantissa * 2^exponent: of many vertices' factors it may be smaller than any float.

    As scaling by powers of two is exact, ratios of products have the bits that they would have of unlimited floats.

    Attributes:
        mantissa: At least 0.5 and below 1.
        exponent: Power of two.
    """

    mantissa: float = 0.5
    exponent: int = 1

    def times(self, factor: float) -> "Product":
        """With one more factor, above 0 and finite."""
        mantissa, exponent = math.frexp(self.mantissa * factor)
        return Product(mantissa, self.exponent + exponent)

    def and_all_of(self, other: "Product") -> "Product":
        """With all factors of another."""
        product = self.times(other.mantissa)
        return Product(product.mantissa, product.exponent + other.exponent)

    def over(self, other: "Product", weight: float = 1.0) -> float:
        """The ratio to another product, times a weight; at most the largest float."""
        try:
            return math.ldexp(weight * self.mantissa / other.mantissa, self.exponent - other.exponent)
        except OverflowError:
            return sys.float_info.max

    def __float__(self) -> float:
        """The product, 0 where it is too small."""
        return math.ldexp(self.mantissa, self.exponent)
