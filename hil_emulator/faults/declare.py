"""What a kind of fault *is*: where it acts, what it can befall, its parameters."""

from dataclasses import dataclass
from enum import StrEnum


class Layer(StrEnum):
    """Where a fault acts."""

    PLANT = "plant"
    ELECTRICAL = "electrical"
    SENSOR = "sensor"
    BUS = "bus"


SPAN = "span"
"""Unit of a sensor fault's parameter: the channel's own; the default is part of its span."""
SPAN_PER_SECOND = "span/s"
TEXT = "text"
"""Unit of a parameter that is a name."""


@dataclass(frozen=True)
class FaultParam:
    """A parameter of a kind of fault.

    Attributes:
        name: what the user writes.
        unit: SI unit, or SPAN, SPAN_PER_SECOND, TEXT.
        meaning: one line for the reader of a table.
        default: value when nothing is said, SI; None makes it required.
        low: smallest allowed value.
        high: largest allowed value.
        shown: the unit engineers write it in.

    """

    name: str
    unit: str
    meaning: str
    default: float | None
    low: float = float("-inf")
    high: float = float("inf")
    shown: str = ""


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes:
        name: what the user writes.
        layer: where it acts.
        targets: what it can befall; `MESSAGE` stands for any message on the bus.
        meaning: one line for the reader of a table.
        params: what can be said about it.
        probability: of its acting, per frame or tick, when nothing is said.

    """

    name: str
    layer: Layer
    targets: tuple[str, ...]
    meaning: str
    params: tuple[FaultParam, ...] = ()
    probability: float = 1.0
