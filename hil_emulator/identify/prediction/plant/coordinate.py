"""Coordinates: parameters of the model on the scale on which they are fitted."""

import math
from dataclasses import dataclass
from typing import Literal

from hil_emulator.model.declare import Effect, Param, Spread

Scaling = Literal["linear", "logarithmic", "vanishing", "inverse"]
"""Relation of value and coordinate: proportional, exponential, proportional to a power near zero
and exponential far from it, or inversely proportional."""

_AT_NEUTRAL = math.e - 1.0


@dataclass(frozen=True)
class Coordinate:
    """A parameter of the model that a fit may change, on an engineering scale.

    Attributes:
        name: `effect` or `channel.effect` or `table_param`.
        field: field in the parameter record.
        channel: sensor channel, or "" for the plant.
        unit: SI unit.
        shown: unit in reports.
        scale: unit of the coordinate: in `unit`, of the inverse, or of the logarithm.
        neutral: value in the configuration; for an inverse scaling, 1/value is measured from zero.
        scaling: relation of value and coordinate.
        low: smallest value.
        high: largest value.
        prior: standard deviation of an ordinary parameter, in `scale`; infinite for an effect.
        effect: declaration of the effect, or None for a parameter of every actuator.
        power: exponent of the influence near zero, for a vanishing scaling.
        stated: whether the configuration states the value.
        also: fields of which the data determine only the product with this one.
        least: smallest value apart from zero.

    """

    name: str
    field: str
    channel: str
    unit: str
    shown: str
    scale: float
    neutral: float
    scaling: Scaling
    low: float
    high: float
    prior: float
    effect: Effect | None
    power: float = 1.0
    stated: bool = True
    also: tuple[str, ...] = ()
    least: float = 0.0

    def possible(self, coordinate: float) -> float:
        """Return the nearest coordinate that is zero or not below the least value."""
        least = self.least / self.scale
        if not 0.0 < coordinate < least:
            return coordinate
        return least if coordinate > 0.5 * least else 0.0

    @property
    def inverse(self) -> bool:
        """Whether the effect is off at infinity; the coordinate is then proportional to 1/value."""
        return self.scaling == "inverse"

    def value(self, coordinate: float) -> float:
        """Return the parameter [unit] at a coordinate; 0 is the configured value."""
        offset = self.possible(coordinate) * self.scale
        if self.scaling == "inverse":
            return 1.0 / offset if coordinate > 0.0 else math.inf
        if self.scaling == "logarithmic":
            return self.neutral * math.exp(offset)
        if self.scaling == "vanishing":
            part = max(math.expm1(1.0 + offset), 0.0) / _AT_NEUTRAL
            return float(self.neutral * part ** (1.0 / self.power))
        return self.neutral + offset

    def at(self, value: float) -> float:
        """Return the coordinate of a parameter [unit]."""
        if self.scaling == "inverse":
            return 1.0 / (value * self.scale) if math.isfinite(value) else 0.0
        if self.scaling == "linear":
            return (value - self.neutral) / self.scale
        return _moved(value / self.neutral, self.power, self.scaling) / self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest coordinate."""
        if self.scaling == "inverse":
            return 0.0, self.at(max(self.low, 1e-300))
        low, high = sorted((self.at(self.low), self.at(self.high)))
        return low, high

    @property
    def place(self) -> str:
        """Sensor, or part of the machine, at which an effect acts; "" without an effect."""
        return self.channel or (self.effect.stage.table if self.effect else "")

    @property
    def stage(self) -> str:
        """Sensor, or stage of the model, at which an effect acts; "" without an effect."""
        return self.channel or (self.effect.stage.name if self.effect else "")

    @property
    def is_knob(self) -> bool:
        """Whether it is the strength of an effect, rather than a shape parameter of its law."""
        return self.effect is not None and self.field == self.effect.field_of(self.effect.knob)

    def belongs_to(self, effect: str) -> bool:
        """Return whether it is the knob or a shape parameter of an effect."""
        return self.name == effect or self.name.startswith(f"{effect}.")


def _moved(ratio: float, power: float, scaling: Scaling) -> float:
    """Return the offset of a value from the neutral one, given their ratio."""
    if scaling == "vanishing":
        return math.log1p(_AT_NEUTRAL * ratio**power) - 1.0
    return math.log(ratio) if ratio > 0.0 else -math.inf


def scaled(param: Param, spread: Spread, neutral: float) -> tuple[Scaling, float]:
    """Return the scaling of a parameter about a value, and its prior standard deviation there."""
    if not spread.logarithmic:
        return "linear", spread.size
    if param.low == 0.0:
        return "vanishing", _moved(math.exp(spread.size), param.power, "vanishing")
    return "logarithmic", spread.size
