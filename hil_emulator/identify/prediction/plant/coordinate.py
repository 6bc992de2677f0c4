"""One number of the model that a fit may change."""

import math
from dataclasses import dataclass
from typing import Literal

from hil_emulator.model.declare import Effect, Param, Spread

Scaling = Literal["linear", "logarithmic", "vanishing", "inverse"]
"""How a value follows from its coordinate: in proportion, as a factor, in proportion to a power
near zero and as a factor far from it, or in inverse proportion."""

_AT_NEUTRAL = math.e - 1.0


@dataclass(frozen=True)
class Coordinate:
    """One number of the model that a fit may change, on an engineering scale.

    Attributes:
        name: what people call it, `effect` or `channel.effect` or `table_param`.
        field: its field in the parameter record.
        channel: the sensor channel, or "" for the plant.
        unit: SI unit.
        shown: the unit for people.
        scale: one engineering unit of it: in `unit`, of the inverse, or of the logarithm.
        neutral: the value in the configuration; an inverse one measures 1/value from zero.
        scaling: how the value follows from the coordinate.
        low: smallest value.
        high: largest value.
        prior: standard deviation of an ordinary parameter, in `scale`; infinite for an effect.
        effect: the declaration, or None for a parameter that every actuator has.
        power: of a vanishing one, the power with which its influence grows from zero.
        stated: whether the configuration states the value.
        also: fields whose values the data show only as a product with this one.
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
        """Whether it is off at infinity, so that 1/value is what grows from zero."""
        return self.scaling == "inverse"

    def value(self, coordinate: float) -> float:
        """Return the parameter [unit] at a coordinate; 0 is the configuration."""
        moved = self.possible(coordinate) * self.scale
        if self.scaling == "inverse":
            return 1.0 / moved if coordinate > 0.0 else math.inf
        if self.scaling == "logarithmic":
            return self.neutral * math.exp(moved)
        if self.scaling == "vanishing":
            part = max(math.expm1(1.0 + moved), 0.0) / _AT_NEUTRAL
            return float(self.neutral * part ** (1.0 / self.power))
        return self.neutral + moved

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
        """The sensor, or the part of the machine, at which an effect acts; "" of none."""
        return self.channel or (self.effect.stage.table if self.effect else "")

    @property
    def stage(self) -> str:
        """The sensor, or the stage of the model, at which an effect acts; "" of none."""
        return self.channel or (self.effect.stage.name if self.effect else "")

    @property
    def is_knob(self) -> bool:
        """Whether it is the strength of an effect, rather than what else its law holds."""
        return self.effect is not None and self.field == self.effect.field_of(self.effect.knob)

    def belongs_to(self, effect: str) -> bool:
        """Tell whether it is the knob or a shape parameter of an effect."""
        return self.name == effect or self.name.startswith(f"{effect}.")


def _moved(ratio: float, power: float, scaling: Scaling) -> float:
    """Return how far a value lies from the neutral one, of which it is a multiple."""
    if scaling == "vanishing":
        return math.log1p(_AT_NEUTRAL * ratio**power) - 1.0
    return math.log(ratio) if ratio > 0.0 else -math.inf


def scaled(param: Param, spread: Spread, neutral: float) -> tuple[Scaling, float]:
    """Return how a number is fitted about a value, and one standard deviation of it there."""
    if not spread.logarithmic:
        return "linear", spread.size
    if param.low == 0.0:
        return "vanishing", _moved(math.exp(spread.size), param.power, "vanishing")
    return "logarithmic", spread.size
