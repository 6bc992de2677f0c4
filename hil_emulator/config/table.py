"""What every table of a configuration has in common, and how one quantity is read."""

import math
from collections.abc import Callable

from pydantic import BaseModel, BeforeValidator, ConfigDict

from hil_emulator.errors import brief
from hil_emulator.model.declare import Param
from hil_emulator.units import show, to_si


class StrictTable(BaseModel):
    """A table of a TOML file: frozen, and no key that it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def reader(param: Param, off: float | None = None) -> Callable[[object], float]:
    """Return the function that reads one quantity: unit, dimension and range."""
    unit, shown = param.unit, param.shown
    example = show(param.typical, unit, shown) if math.isfinite(param.typical) else ""
    allowed = f"{show(param.low, unit, shown)} ... {show(param.high, unit, shown)}"

    def read(text: object) -> float:
        if off is not None and text == "off":
            return off
        value = to_si(text, unit, example)
        if value != off and not param.allows(value):
            raise ValueError(f'"{brief(text)}" is outside the allowed {allowed}')
        return value

    return read


def quantity(param: Param, off: float | None = None) -> BeforeValidator:
    """Return the validator of one quantity."""
    return BeforeValidator(reader(param, off))
