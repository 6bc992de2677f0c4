"""First message to the page: machine, signals, settings, faults."""

from collections.abc import Mapping
from typing import Any

from hil_emulator.config.load import Configuration
from hil_emulator.faults.declare import TEXT, FaultKind, FaultParam
from hil_emulator.faults.fault import kinds_of, measure, targets, twins
from hil_emulator.signals.inputs import SETTINGS
from hil_emulator.units import factor, read_as

_SHOWN = {
    "Pa": "bar", "m": "mm", "A": "mA", "m/s": "mm/s", "m^3/s": "l/min", "m^3": "ml",
    "Pa/s": "bar/s", "A/s": "mA/s",
}  # fmt: skip
"""The units in which engineers read signals."""
_USUAL_CURRENT = 10e-3  # A; of a valve without a largest current (assumed)


def machine(config: Configuration) -> dict[str, Any]:
    """Return the data for the picture of the actuator, SI."""
    plant = config.plant
    area, supply = plant["cylinder_piston_area"], plant["supply_pressure"]
    current = plant.get("current_saturation_limit", _USUAL_CURRENT)
    return {
        "stroke": plant["cylinder_stroke"],
        "piston_area": area,
        "area_ratio": plant["cylinder_area_ratio"],
        "mass": plant["load_mass"],
        "current": current if 0.0 < current < 10.0 else _USUAL_CURRENT,
        "supply_pressure": supply,
        "force": area * supply,
    }


def units(columns: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return name, shown unit and SI units per shown unit of every column."""
    rows = []
    for name, unit in columns.items():
        shown = "us" if name.startswith("loop.") else read_as(unit, _SHOWN.get(unit, unit))
        scale = factor(unit, shown) if shown != unit else 1.0
        written = {"us": "µs", "1": "", "degC": "°C"}.get(shown, shown)
        rows.append({"name": name, "unit": written, "scale": scale})
    return rows


def settings(machine: Mapping[str, float]) -> list[dict[str, Any]]:
    """Return every setting with its bounds, and the range of its slider for this machine."""
    reach = {
        "supply_pressure": (1e5, 1.5 * machine["supply_pressure"]),
        "external_force": (-machine["force"], machine["force"]),
        "wall_shift": (-machine["stroke"], machine["stroke"]),
        "valve_current": (-machine["current"], machine["current"]),
    }
    rows = []
    for param in SETTINGS.values():
        shown = read_as(param.unit, param.display_unit)
        scale = factor(param.unit, shown) if shown != param.unit else 1.0
        low, high = reach.get(param.name, (param.low, param.high))
        rows.append({
            "name": param.name, "meaning": param.meaning, "unit": "" if shown == "1" else shown,
            "scale": scale, "low": param.low, "high": param.high,
            "slider": [max(low, param.low), min(high, param.high)],
        })  # fmt: skip
    return rows


def faults() -> list[dict[str, Any]]:
    """Return every target with its kinds of fault, their fields and bounds."""
    return [
        {"target": target, "kinds": [_kind(target, kind) for kind in kinds_of(target).values()]}
        for target in targets()
    ]


def _kind(target: str, kind: FaultKind) -> dict[str, Any]:
    return {
        "name": kind.name,
        "layer": kind.layer.value,
        "meaning": kind.meaning,
        "probability": kind.probability,
        "params": [_param(target, kind, param) for param in kind.params],
    }


def _param(target: str, kind: FaultKind, param: FaultParam) -> dict[str, Any]:
    field: dict[str, Any] = {"name": param.name, "meaning": param.meaning}
    if param.unit == TEXT:
        return field | {"choices": twins(target)}
    scale, unit, shown = measure(target, kind, param)
    scale /= factor(unit, shown) if shown != unit else 1.0
    numbers = {"default": param.default, "low": param.low, "high": param.high}
    shown_numbers = {
        k: None if v is None else float(f"{v * scale:.6g}") for k, v in numbers.items()
    }
    return field | {"unit": "" if shown == "1" else shown} | shown_numbers
