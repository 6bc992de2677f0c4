"""Declaration of a kind of fault: where it acts, its targets, its parameters.

A kind is one decorated function in the file of its layer: `plant`, `coil`, `sensor`, `frames`. The
catalogue, the checks of arguments, the printed table and the parametrised tests are derived from
it. The defaults are assumed: clearly visible on the reference machine, and survivable.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, NamedTuple

from hil_emulator.device.emergency import ErrorBit
from hil_emulator.model.declare import DeclarationError


class Layer(StrEnum):
    """Where a fault acts."""

    PLANT = "plant"
    ELECTRICAL = "electrical"
    SENSOR = "sensor"
    OBJECT = "object"
    BUS = "bus"


SPAN = "span"
"""Unit of a sensor fault's parameter: the channel's own; the default is part of its span."""
SPAN_PER_SECOND = "span/s"
TEXT = "text"
"""Unit of a parameter that is a name."""


class EmergencyCode(NamedTuple):
    """An emergency message: its error code, and its bit in the error register (CiA 301 7.2.7)."""

    code: int
    bit: ErrorBit


@dataclass(frozen=True)
class FaultParam:
    """A parameter of a kind of fault.

    Attributes:
        name: as the user writes it.
        unit: SI unit, or SPAN, SPAN_PER_SECOND, TEXT.
        meaning: one line for tables.
        default: SI; None makes it required.
        low: smallest allowed value, in `unit`.
        high: largest allowed value, in `unit`.
        shown: the unit engineers write it in.
        difference: whether a pressure in `unit` is a difference, without a gauge offset.

    """

    name: str
    unit: str
    meaning: str
    default: float | None
    low: float = float("-inf")
    high: float = float("inf")
    shown: str = ""
    difference: bool = False


@dataclass(frozen=True)
class FaultKind:
    """A kind of fault with its parameters; each layer has a subclass.

    Attributes:
        begin: called when a fault of this kind begins, with the objects of its layer (`given`) and
            the values of its parameters; returns the effect while it lasts. Its name is the
            kind's, its docstring the meaning.
        targets: possible targets; `MESSAGE` stands for any message on the bus.
        params: its parameters.
        probability: default probability that it acts, per frame or tick.
        emergency: reported by every node while it lasts.

    """

    layer: ClassVar[Layer]
    given: ClassVar[tuple[str, ...]] = ()

    begin: Callable[..., Any]
    targets: tuple[str, ...]
    params: tuple[FaultParam, ...] = ()
    probability: float = 1.0
    emergency: EmergencyCode | None = None

    def __post_init__(self) -> None:
        takes = tuple(inspect.signature(self.begin).parameters)
        arguments = (*self.given, *(p.name for p in self.params))
        if takes != arguments:
            raise DeclarationError(
                f"fault '{self.name}' takes {takes}, but it is given {arguments}"
            )

    @property
    def name(self) -> str:
        """As the user writes it: without the underscore after a Python keyword."""
        return self.begin.__name__.rstrip("_")

    @property
    def meaning(self) -> str:
        """One line for tables."""
        line = (inspect.getdoc(self.begin) or "").partition("\n")[0].rstrip(".")
        return line[:1].lower() + line[1:]
