"""How parameter records are declared: frozen dataclasses beside the code they belong to.

A record declared with `parameters` is a plain frozen dataclass for the code that uses it. The scenario schema reads the
same declaration: types and ranges from the annotations, the description from the string under each field.
"""

from dataclasses import dataclass
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


@dataclass_transform(frozen_default=True, kw_only_default=True)
def parameters(cls: type[_T]) -> type[_T]:
    """Make `cls` a frozen, keyword-only dataclass that the schema accepts strictly: no unknown keys, no NaN."""
    config: dict[str, Any] = {"extra": "forbid", "allow_inf_nan": False, "use_attribute_docstrings": True}
    made = dataclass(frozen=True, kw_only=True)(cls)
    made.__pydantic_config__ = config  # type: ignore[attr-defined]
    return made
