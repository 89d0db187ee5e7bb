"""How parameter records are declared: frozen dataclasses beside the code they belong to.

A record declared with `parameters` is a plain frozen dataclass for the code that uses it. The scenario schema reads the
same declaration: types and ranges from the annotations, the description from the string under each field, the unit from
the end of its name (`_m`, `_ms`, `_bit_per_s`).

    @parameters
    class UnitDisk:
        '''Everything within a radius is received.'''

        type: Literal["disk"]
        radius_m: Positive = 100.0
        '''Greatest distance of reception.'''

    @parameters
    class LogDistance:
        '''Path loss that grows with the logarithm of the distance.'''

        type: Literal["log-distance"]
        exponent: Positive

    @parameters
    class Air:
        medium: UnitDisk | LogDistance

A plain union of records is told apart by the field `type`, a `Literal` in each of them; it needs no marker. In a file
`type` must then be given, whether or not it has a default. Such a union may be optional (`| None`), stand in a list, or
have a scalar beside it (`Name | UnitDisk`); two kinds of list at one place, or two records without `type`, are refused
with a `TypeError`. Prefer `tuple[X, ...]` for lists. A field whose record is found by name when a file is read (an
algorithm of one's own) is declared `Any`; whoever reads the file passes a resolver (see `netsim.reading.validate`), and
its record should have a field `type: str`, or a `Literal`, so that it can be written out again.

What no annotation can say is checked in `__post_init__`, with a `ValueError` that says what should hold:
`raise ValueError("low_m below high_m")` is shown as `expected low_m below high_m, got {low_m: 5, high_m: 3}`.
"""

from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar, dataclass_transform

from annotated_types import Ge, Gt, Le, MinLen

Positive = Annotated[float, Gt(0)]
NonNegative = Annotated[float, Ge(0)]
Probability = Annotated[float, Ge(0), Le(1)]
PositiveInt = Annotated[int, Gt(0)]
NonNegativeInt = Annotated[int, Ge(0)]
Name = Annotated[str, MinLen(1)]
PointM = tuple[float, float]

_T = TypeVar("_T")


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(field,))
def parameters(cls: type[_T]) -> type[_T]:
    """Make `cls` a frozen, keyword-only dataclass that the schema accepts strictly: no unknown keys, no NaN."""
    config: dict[str, Any] = {"extra": "forbid", "allow_inf_nan": False, "use_attribute_docstrings": True}
    made = dataclass(frozen=True, kw_only=True)(cls)
    made.__pydantic_config__ = config  # type: ignore[attr-defined]
    return made
