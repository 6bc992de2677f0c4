"""Record types over flat float64 memory, derived from the declarations."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from hil_emulator.model import quantities
from hil_emulator.model.declare import DeclarationError, Effect, Param, Quantity, Stage
from hil_emulator.model.stages import CONTINUOUS, SAMPLED, TICKED, pilot_flow, viscosity

Vector = np.ndarray[Any, np.dtype[np.float64]]

_NOTHING = ("nothing", 1)
"""Field of a record that would otherwise be empty and have no type."""


def record_type(fields: Sequence[tuple[str, int]]) -> np.dtype[Any]:
    """Return a record type of float64 fields, each a (name, length).

    Raises:
        DeclarationError: if two fields have the same name.

    """
    names = [name for name, _ in fields]
    twice = {n for n in names if names.count(n) > 1}
    if twice:
        raise DeclarationError(f"declared twice: {', '.join(sorted(twice))}")
    return np.dtype(
        (
            np.record,
            [(n, np.float64) if length == 1 else (n, np.float64, length) for n, length in fields],
        )
    )


def named(vector: Vector, layout: np.dtype[Any]) -> Any:
    """Return the record that gives names to a flat vector's memory."""
    return vector.view(layout)[0]


def zeros(layout: np.dtype[Any], count: int = 1) -> Vector:
    """Return flat memory for `count` records of a layout."""
    return np.zeros(count * length(layout))


def base_fields() -> list[str]:
    """Names of the parameters that every actuator has, as `table_name`."""
    return [f"{table}_{p.name}" for table, params in quantities.PARAMS.items() for p in params]


def supply_params(effects: Iterable[Effect]) -> dict[str, Param]:
    """Return the common parameters of actuators on one supply, by record field.

    They are those of pump, accumulator, lines and their oil. The leakage of a pilot stage and the
    air in a chamber's oil belong to each actuator.
    """
    tables = ("supply", "tank", "oil")
    common = {f"{t}_{p.name}": p for t in tables for p in quantities.PARAMS[t]}
    for effect in effects:
        of_supply = effect.stage.table in ("supply", "tank") and effect.stage != pilot_flow
        if of_supply or effect.stage == viscosity:
            common |= {effect.field_of(param): param for param in effect.params}
    return common


def _fields(given: Iterable[Quantity]) -> list[tuple[str, int]]:
    return [(q.name, q.length) for q in given]


def _effect_fields(
    effects: Iterable[Effect], stages: Sequence[Stage], kind: str
) -> list[tuple[str, int]]:
    chosen = [e for e in effects if e.stage in stages]
    return [(e.field_of(q), q.length) for e in chosen for q in getattr(e, kind)]


def _scalars(fields: Iterable[tuple[str, int]]) -> list[tuple[str, int]]:
    return [field for field in fields if field[1] == 1] or [_NOTHING]


def _arrays(fields: Iterable[tuple[str, int]]) -> list[tuple[str, int]]:
    return [field for field in fields if field[1] > 1] or [_NOTHING]


def length(layout: np.dtype[Any]) -> int:
    """Return the length of a record in numbers."""
    return layout.itemsize // 8


def layouts(effects: Sequence[Effect]) -> dict[str, np.dtype[Any]]:
    """Return the record types of a model with these effects, by name."""
    base = [(name, 1) for name in base_fields()]
    remembered = _effect_fields(effects, SAMPLED, "states")
    fields = {
        "parameters": base + _effect_fields(effects, (*CONTINUOUS, *TICKED), "params"),
        "state": _fields(quantities.ALL_STATES) + _effect_fields(effects, CONTINUOUS, "states"),
        "past": _arrays(_effect_fields(effects, TICKED, "states")),
        "inputs": _fields(quantities.INPUTS),
        "held": _fields(quantities.HELD),
        "signals": _fields(quantities.SIGNALS),
        "channel": _effect_fields(effects, SAMPLED, "params"),
        "memory": _scalars(remembered),
        "channel_past": _arrays(remembered),
    }
    return {name: record_type(given) for name, given in fields.items()}


def fill(layout: np.dtype[Any], effects: Iterable[Effect], values: Mapping[str, float]) -> Vector:
    """Return a parameter vector: `values` by field, each effect without a value off.

    Raises:
        KeyError: if a value names no field, or a field has neither value nor default.

    """
    tables = quantities.PARAMS.items()
    defaults = {f"{table}_{p.name}": p.default for table, params in tables for p in params}
    for effect in effects:
        defaults[effect.field_of(effect.knob)] = effect.off
        defaults |= {effect.field_of(p): p.default for p in effect.shape}
    fields = layout.names or ()
    for name in values:
        if name not in fields:
            raise KeyError(f"no parameter '{name}'")
    chosen = [values.get(name, defaults[name]) for name in fields]
    missing = [name for name, value in zip(fields, chosen, strict=True) if value is None]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    return np.array(chosen, dtype=np.float64)
