"""What the digits of an object stand for."""

from typing import NamedTuple


class Scale(NamedTuple):
    """A physical value is `factor` times the digits, plus `offset`.

    Attributes:
        unit: SI unit.
        factor: physical value of one digit.
        offset: physical value of 0 digits.

    """

    unit: str
    factor: float
    offset: float = 0.0
