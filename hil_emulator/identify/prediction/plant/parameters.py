"""Ordinary (nuisance) parameters: uncertain configured values, refitted with every candidate.

With fixed values, an oil 10 % softer than configured would be explained by an effect of the
catalogue.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from hil_emulator.identify.prediction.plant.coordinate import Coordinate, scaled
from hil_emulator.identify.prediction.plant.plant_model import PlantModel, concerns, predictable
from hil_emulator.model import quantities
from hil_emulator.model.declare import Effect, Param, Spread, is_on
from hil_emulator.model.law_forms import USUAL
from hil_emulator.model.stages import SAMPLED

FREE = "supply_pressure"
"""Channel of a random disturbance: lag, delay and hum of its sensor are not identifiable."""

KNOB_TOLERANCE = 0.5
"""Relative standard deviation of an effect that the configuration states (assumed)."""

UNKNOWN_SEALS = {"cylinder_piston_area": 0.10}
"""Tolerances on a force bench (assumed: seals and rods of unknown size)."""

CARRIAGE = {"load_mass": 0.10}
"""Tolerances on a driven axis (assumed: mass of the carriage from its drawing)."""


def ordinary(
    model: PlantModel, tolerances: Mapping[str, float] = MappingProxyType({})
) -> list[Coordinate]:
    """Return the uncertain parameters of a configuration, the stated ones first.

    The prior standard deviation is the tolerance of a stated value, or the spread of an unstated
    one.

    Args:
        model: of the configuration.
        tolerances: relative standard deviations of stated values by field, instead of the defaults.

    """
    usual = {**tolerances, **model.config.tolerances}
    chosen = [_parameter(model, f"{table}_{param.name}", model.sized(param, table), usual)
             for table, params in quantities.PARAMS.items() for param in params]  # fmt: skip
    for effect in model.effects:
        if effect.stage in SAMPLED or math.isinf(effect.off):
            continue
        field = effect.field_of(effect.knob)
        value = model.plant_values.get(field, effect.off)
        if is_on(effect, value):
            param = model.sized(effect.knob, effect.stage.table)
            knob = _knob(effect, param, value, usual.get(field, KNOB_TOLERANCE))
            chosen += [knob, *_shapes(model, knob, usual)]
    open_ones = [c for c in chosen if c is not None and c.scale]
    return sorted(open_ones, key=lambda c: not c.stated)


MOST_USUAL = 3.0
"""Largest size of a usual effect, in standard deviations of published forms (p = 0.003)."""


def usual(model: PlantModel) -> list[Coordinate]:
    """Return the effects that every machine has to some extent, as parameters about zero.

    The configuration leaves them off, and their prior is as wide as their usual size.
    """
    effects = {e.name: e for e in model.effects}
    chosen = []
    for one in (u for u in USUAL if u.name in effects):
        effect, size = effects[one.name], one.size(model.plant_values)
        if not is_on(effect, model.plant_values.get(effect.field_of(effect.knob), effect.off)):
            knob = replace(model.knob(effect, "", 1.0), scale=size, least=one.least * size)
            chosen.append(replace(knob, stated=False))
    return chosen


def is_usual(coordinate: Coordinate) -> bool:
    """Whether an ordinary parameter is an effect that every machine has to some extent."""
    effect = coordinate.effect
    off = effect is not None and coordinate.is_knob and coordinate.neutral == effect.off
    return off and coordinate.name in {u.name for u in USUAL} and math.isfinite(coordinate.prior)


def _shapes(
    model: PlantModel, knob: Coordinate, tolerances: Mapping[str, float]
) -> Iterator[Coordinate]:
    """Yield the uncertain shape parameters of a stated effect."""
    for shape in model.shapes(knob):
        if not shape.stated:
            yield shape
        elif shape.field in tolerances:
            spread = math.log1p(tolerances[shape.field])
            yield replace(shape, scaling="logarithmic", scale=spread)


def _parameter(
    model: PlantModel, field: str, param: Param, tolerances: Mapping[str, float]
) -> Coordinate | None:
    """Return a parameter of every actuator; None without a value or without uncertainty."""
    value = model.plant_values.get(field, 0.0)
    stated = param.default is None or field in model.config.stated
    open_by = Spread(math.log1p(tolerances.get(field, param.tolerance))) if stated else param.spread
    if value == 0.0 or math.isnan(value) or open_by is None or not open_by.size:
        return None
    scaling, scale = scaled(param, open_by, value)
    return Coordinate(
        name=field, field=field, channel="", unit=param.unit, shown=param.shown, scale=scale,
        neutral=value, scaling=scaling, low=param.low, high=param.high, prior=1.0, effect=None,
        power=param.power, stated=stated,
    )  # fmt: skip


def _knob(effect: Effect, param: Param, value: float, tolerance: float) -> Coordinate:
    return Coordinate(
        name=effect.name, field=effect.field_of(param), channel="", unit=param.unit,
        shown=param.shown, scale=abs(value) * tolerance, neutral=value, scaling="linear",
        low=param.low, high=param.high, prior=1.0, effect=effect,
    )  # fmt: skip


def candidates(model: PlantModel, channels: tuple[str, ...]) -> list[Coordinate]:
    """Return all effects that may be named and that are off in the configuration."""
    knobs = []
    for effect in (e for e in model.effects if e.named):
        if effect.stage not in SAMPLED:
            if not is_on(effect, model.plant_values.get(effect.field_of(effect.knob), effect.off)):
                knobs.append(model.knob(effect, "", math.inf))
            continue
        for channel in (c for c in channels if concerns(effect, c)):
            coordinate = model.knob(effect, channel, math.inf)
            if channel == FREE and effect.states:
                continue
            if predictable(effect) and not is_on(effect, coordinate.neutral):
                knobs.append(coordinate)
    return knobs
