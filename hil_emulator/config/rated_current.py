"""Shares of a valve's rated current, such as `overlap = "20 %"`, and bounds relative to it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BeforeValidator, GetCoreSchemaHandler, ValidationInfo

from hil_emulator.config.table import QuantityReader
from hil_emulator.config.tables import RATED_CURRENT
from hil_emulator.errors import brief
from hil_emulator.model.rating import REFERENCE_CURRENT, at_rated_current
from hil_emulator.units import show, to_si

KEY = "rated_current"
"""Of the validation's context: the rated current [A], where the configuration has one."""

_LIMITS = ("current_saturation", "spool_stops")
"""Effects whose limit is where the valve is fully open, if no data sheet's current is stated."""


def rated_current(merged: Mapping[str, Any]) -> float | None:
    """Return the rated current of a configuration's valve [A].

    Without a data sheet's, that is the largest current of the driver, or of the spool's travel.

    Args:
        merged: the tables before the check; wrong values count as absent.

    """
    valve = merged.get("valve")
    if not isinstance(valve, dict):
        return None
    given = (valve.get("rated_current"), *(_limit(valve.get(k)) for k in _LIMITS))
    currents = (_ampere(text) for text in given if text is not None)
    return next((value for value in currents if math.isfinite(value)), None)


def _limit(effect: object) -> object:
    return effect.get("limit") if isinstance(effect, dict) else None


def _ampere(text: object) -> float:
    try:
        return QuantityReader(RATED_CURRENT)(text)
    except ValueError:
        return math.inf


@dataclass(frozen=True)
class RatedReader(QuantityReader):
    """Reader of a current of the valve: absolute, or a share of the rated current.

    Its bounds are shares: those of the declaration are of a rated current of 10 mA.
    """

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        """Read the field by this, with the rated current of the whole configuration."""
        return BeforeValidator(self.rated).__get_pydantic_core_schema__(source, handler)

    def rated(self, text: object, info: ValidationInfo) -> float:
        """Return the value in SI.

        Raises:
            ValueError: it is not a quantity, outside its bounds, or a share of an unknown current.

        """
        current = (info.context or {}).get(KEY)
        reader = QuantityReader(
            at_rated_current(self.param, current or REFERENCE_CURRENT), self.words
        )
        try:
            return reader(self._absolute(text, current))
        except ValueError as error:
            if "outside" not in str(error):
                raise
            of = show(current or REFERENCE_CURRENT, "A", "mA")
            unknown = "" if current else "; give rated_current or current_saturation"
            raise ValueError(
                f'"{brief(text)}" is outside the allowed {reader.bounds}, for a rated current of '
                f"{of}{unknown}"
            ) from None

    def _absolute(self, text: object, current: float | None) -> object:
        """Return a share of the rated current as a current; anything else as it is."""
        if self.param.unit != "A" or not isinstance(text, str) or not text.strip().endswith("%"):
            return text
        share = to_si(text, "1", "20 %")
        if current is None:
            raise ValueError(
                f'"{brief(text)}" is a share of the rated current; give rated_current or '
                "current_saturation"
            )
        return f"{share * current!r} A"

    @property
    def description(self) -> str:
        """Meaning, unit, bounds, default and source."""
        share = "a share of the rated current, such as 5 %, or absolute"
        note = share if self.param.unit == "A" else "bounds scale with the rated current"
        return f"{super().description}\n{note}; the bounds are those of a rated current of 10 mA"
