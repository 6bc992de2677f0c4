"""Values that no file states: the model uses a default, and machines differ by its spread."""

import math
from collections.abc import Iterator

from hil_emulator.config.configuration import Configuration
from hil_emulator.model.actuator import PARAMS
from hil_emulator.model.declare import Param, is_on
from hil_emulator.model.rating import REFERENCE_CURRENT, sized


def moved_defaults(config: Configuration) -> dict[str, float]:
    """Return every default of a configuration, moved by its spread; by field, SI.

    Settings, which are chosen rather than measured, are left out.
    """
    return {
        field: _moved(config.plant[field], param)
        for field, param in _defaults(config)
        if param.spread is not None and param.spread.size and field in config.plant
    }


def _defaults(config: Configuration) -> Iterator[tuple[str, Param]]:
    """Yield the parameters that no file states and that act, with their fields."""
    rated = config.rated_current or REFERENCE_CURRENT
    fields = [(f"{table}_{p.name}", table, p) for table, params in PARAMS.items() for p in params]
    for effect in config.effects:
        if is_on(effect, config.plant.get(effect.field_of(effect.knob), effect.off)):
            fields += [(effect.field_of(p), effect.stage.table, p) for p in effect.shape]
    for field, table, param in fields:
        if param.default is not None and field not in config.stated:
            yield field, sized(param, table, rated)


def _moved(value: float, param: Param) -> float:
    assert param.spread is not None
    size = param.spread.size
    moved = value * math.exp(size) if param.spread.logarithmic else value + size
    return min(max(moved, param.low), param.high)
