"""One number of the model that a fit may change."""

import math
from dataclasses import dataclass

from hil_emulator.model.declare import Effect


@dataclass(frozen=True)
class Coordinate:
    """One number of the model that a fit may change, on an engineering scale.

    Attributes:
        name: what people call it, `effect` or `channel.effect` or `table_param`.
        field: its field in the parameter record.
        channel: the sensor channel, or "" for the plant.
        unit: SI unit.
        shown: the unit for people.
        scale: one engineering unit of it, in `unit` (of the inverse where `inverse`).
        neutral: the value in the configuration; `inverse` measures 1/value from zero.
        inverse: whether it is off at infinity, so that 1/value is what grows from zero.
        low: smallest value.
        high: largest value.
        prior: standard deviation of an ordinary parameter, in `scale`; infinite for an effect.
        effect: the declaration, or None for a parameter that every actuator has.

    """

    name: str
    field: str
    channel: str
    unit: str
    shown: str
    scale: float
    neutral: float
    inverse: bool
    low: float
    high: float
    prior: float
    effect: Effect | None

    def value(self, coordinate: float) -> float:
        """Return the parameter [unit] at a coordinate; 0 is the configuration."""
        if self.inverse:
            return 1.0 / (coordinate * self.scale) if coordinate > 0.0 else math.inf
        return self.neutral + coordinate * self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest coordinate."""
        if self.inverse:
            return 0.0, 1.0 / (max(self.low, 1e-300) * self.scale)
        return (self.low - self.neutral) / self.scale, (self.high - self.neutral) / self.scale

    @property
    def place(self) -> str:
        """The sensor, or the part of the machine, at which an effect acts; "" of none."""
        return self.channel or (self.effect.stage.table if self.effect else "")

    @property
    def stage(self) -> str:
        """The sensor, or the stage of the model, at which an effect acts; "" of none."""
        return self.channel or (self.effect.stage.name if self.effect else "")

    def belongs_to(self, effect: str) -> bool:
        """Tell whether it is the knob or a shape parameter of an effect."""
        return self.name == effect or self.name.startswith(f"{effect}.")
