"""Scale of an object's digits."""

from typing import NamedTuple


class Scale(NamedTuple):
    """Linear scale: physical value = `factor` * digits + `offset`.

    Attributes:
        unit: SI unit.
        factor: physical value of one digit.
        offset: physical value of 0 digits.

    """

    unit: str
    factor: float
    offset: float = 0.0
