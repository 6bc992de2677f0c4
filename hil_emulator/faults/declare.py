"""What a kind of fault *is*: where it acts, what it can befall, its parameters.

A kind is one decorated function in the file of its layer: `plant`, `coil`, `sensor`, `frames`.
The catalogue, the checks of what is said, the printed table and the parametrised tests are derived
from it. The defaults are assumed: clearly visible on the reference machine, and survivable.
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
        name: what the user writes.
        unit: SI unit, or SPAN, SPAN_PER_SECOND, TEXT.
        meaning: one line for the reader of a table.
        default: value when nothing is said, SI; None makes it required.
        low: smallest allowed value, in `unit`.
        high: largest allowed value, in `unit`.
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
class FaultKind:
    """A kind of fault: what it does, with what can be said about it.

    Each layer has its own sort, with what `begin` returns there.

    Attributes:
        begin: called when a fault of this kind begins, with what its layer hands it (`given`) and
            then the values of its parameters; returns what the fault does while it lasts. Its name
            is the kind's, its docstring the meaning.
        targets: what it can befall; `MESSAGE` stands for any message on the bus.
        params: what can be said about it.
        probability: of its acting, per frame or tick, when nothing is said.
        emergency: what every node reports while it lasts.

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
        said = (*self.given, *(p.name for p in self.params))
        if takes != said:
            raise DeclarationError(f"fault '{self.name}' takes {takes}, but it is given {said}")

    @property
    def name(self) -> str:
        """What the user writes; a function gets an underscore where Python has a word like it."""
        return self.begin.__name__.rstrip("_")

    @property
    def meaning(self) -> str:
        """One line for the reader of a table."""
        line = (inspect.getdoc(self.begin) or "").partition("\n")[0].rstrip(".")
        return line[:1].lower() + line[1:]
