"""Ordinary parameters: what no data sheet states exactly, refitted with every candidate.

Holding them fixed invents effects: the nearest entry of the catalogue explains that the oil is
10 % softer than configured.
"""

import math
from collections.abc import Mapping

from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel, concerns, predictable
from hil_emulator.model import quantities
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.stages import SAMPLED

PRIORS = {
    "valve_gain": 0.10,
    "valve_natural_frequency": 0.10,
    "valve_damping_ratio": 0.15,
    "oil_bulk_modulus": 0.15,
    "cylinder_dead_volume_a": 0.10,
    "cylinder_dead_volume_b": 0.10,
    "load_mass": 0.02,
}
"""Relative standard deviation by parameter (assumed: tolerance of a careful data sheet)."""

FREE = "supply_pressure"
"""A channel that follows a disturbance: no model says how it moves from sample to sample, so these
data cannot show a lag, a delay or a hum of its sensor."""

KNOB_PRIOR = 0.5
"""Relative standard deviation of an effect that the configuration states (assumed)."""


STATIC_PRIORS = {"cylinder_piston_area": 0.10}
"""The same where the force balance stands alone (assumed: seals and rods of unknown size)."""

DRIVEN_PRIORS = {"load_mass": 0.10}
"""The same where a drive moves the load (assumed: a carriage known from its drawing)."""


def ordinary(model: PlantModel, priors: Mapping[str, float] = PRIORS) -> list[Coordinate]:
    """Return the ordinary parameters of a configuration."""
    found: list[Coordinate] = []
    units = {f"{t}_{p.name}": p for t, ps in quantities.PARAMS.items() for p in ps}
    for field, prior in priors.items():
        value = model.plant_values.get(field, 0.0)
        if value == 0.0 or math.isnan(value):
            continue
        param = units[field]
        found.append(
            Coordinate(
                name=field,
                field=field,
                channel="",
                unit=param.unit,
                shown=param.shown,
                scale=abs(value) * prior,
                neutral=value,
                inverse=False,
                low=param.low,
                high=param.high,
                prior=1.0,
                effect=None,
            )
        )
    for effect in model.effects:
        if effect.stage in SAMPLED or math.isinf(effect.off):
            continue
        value = model.plant_values.get(effect.field_of(effect.knob), effect.off)
        if is_on(effect, value):
            found.append(_configured(model, effect, value))
    return found


def _configured(model: PlantModel, effect: Effect, value: float) -> Coordinate:
    param = effect.knob
    return Coordinate(
        name=effect.name, field=effect.field_of(param), channel="", unit=param.unit,
        shown=param.shown, scale=abs(value) * KNOB_PRIOR, neutral=value, inverse=False,
        low=param.low, high=param.high, prior=1.0, effect=effect,
    )  # fmt: skip


def candidates(model: PlantModel, channels: tuple[str, ...]) -> list[Coordinate]:
    """Return every effect that may be named and that the configuration leaves off."""
    found = []
    for effect in (e for e in model.effects if e.named):
        if effect.stage not in SAMPLED:
            if not is_on(effect, model.plant_values.get(effect.field_of(effect.knob), effect.off)):
                found.append(model.knob(effect, "", math.inf))
            continue
        for channel in (c for c in channels if concerns(effect, c)):
            coordinate = model.knob(effect, channel, math.inf)
            if channel == FREE and effect.states:
                continue
            if predictable(effect) and not is_on(effect, coordinate.neutral):
                found.append(coordinate)
    return found
