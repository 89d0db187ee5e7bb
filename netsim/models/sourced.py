"""Values of device tables: each carries where it was read, `{value: 18.8, source: "data sheet, page 9"}`.

A value that was recalled or chosen also has `unverified: true`.
"""

from netsim.parameters import Name, NonNegative, Positive, PositiveInt, parameters


@parameters
class _Sourced:
    """What every value carries."""

    source: Name
    """Where it was read: document and place; or why it was chosen."""
    unverified: bool = False
    """It was recalled or chosen, not read in the source."""


@parameters
class Number(_Sourced):
    """A number with its source."""

    value: float
    """The number, in the unit that the key names."""


@parameters
class NonNegativeNumber(_Sourced):
    """A number of at least 0 with its source."""

    value: NonNegative
    """The number, in the unit that the key names."""


@parameters
class PositiveNumber(_Sourced):
    """A number above 0 with its source."""

    value: Positive
    """The number, in the unit that the key names."""


@parameters
class PositiveCount(_Sourced):
    """A whole number above 0 with its source."""

    value: PositiveInt
    """The number, in the unit that the key names."""
