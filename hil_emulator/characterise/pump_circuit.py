"""A pump on the bench, loaded by the valve with joined ports."""

import math
from collections.abc import Sequence

import numpy as np

from hil_emulator.characterise.result import Series
from hil_emulator.characterise.stand import Bench, Stand

SET_HIGH = 280e5
"""Set pressure of a variable pump [Pa]; the pump stays at full stroke up to 270 bar."""

_HELD = 1.0  # each opening of the valve [s]
_POINTS = 21
_PIPE = 1e-3  # oil in each pipe behind a valve of the reference's size [m³]
_TIME_CONSTANTS = 10.0  # settling to 0.005 % of a step
_FROM, _TO = 20e5, 265e5  # pressures at which a pump is loaded [Pa]


def configured_or_typical(bench: Bench, effect: str) -> float:
    """Return the knob of an effect: the machine's, or the catalogue's if the effect is off."""
    declared = next(e for e in bench.kernel.effects if e.name == effect)
    configured = bench.value(declared.field_of(declared.knob))
    return configured if configured != declared.off else declared.knob.typical


def pump_flow(bench: Bench) -> float:
    """Return the flow of the machine's pump, of either kind, or of the catalogue's [m³/s]."""
    for effect in ("variable_pump", "fixed_pump"):
        flow = bench.value(f"{effect}_flow")
        if math.isfinite(flow):
            return flow
    return configured_or_typical(bench, "variable_pump")


def pump_circuit(bench: Bench, changes: dict[str, float]) -> Stand:
    """Return a pump whose flow goes through the valve and back, by pipes that settle quickly."""
    size = bench.valve_size
    pipes = {
        "cylinder_dead_volume_a": size * _PIPE,
        "cylinder_dead_volume_b": size * _PIPE,
        "internal_leakage_conductance": size * 1e-8,
    }
    alone = bench.off("supply", "tank", "valve", keep=("underlap", "land_leakage"))
    return bench.stand(alone | bench.joined() | pipes | changes)


def settling(bench: Bench, flow: float, pressure: float) -> int:
    """Return the number of held openings after which the pressure in the pipes has settled.

    This takes ten time constants of both pipes at the valve's edges, C R = (2 V/E) (2 dp/q).
    """
    volume = 2.0 * bench.valve_size * _PIPE
    seconds = _TIME_CONSTANTS * volume / bench.value("oil_bulk_modulus") * 2.0 * pressure / flow
    return max(3, math.ceil(seconds / _HELD))


def steady(stand: Stand, current: float, names: Sequence[str]) -> list[float]:
    """Hold an opening of the valve [A]; return the final values of signals."""
    signals = stand.drive(np.full(round(_HELD / stand.period), current)).signals
    late = slice(-round(0.1 * _HELD / stand.period), None)
    return [float(np.mean(signals[name][late])) for name in names]


def current_for(bench: Bench, flow: float, pressure: float) -> float:
    """Return the spool position that passes a flow through both edges at a pressure [A]."""
    drop = 0.5 * (pressure - bench.value("tank_pressure"))
    return flow / (bench.value("valve_gain") * math.sqrt(drop)) - bench.null_opening


def at_full_stroke(
    bench: Bench, changes: dict[str, float], names: Sequence[str]
) -> dict[str, Series]:
    """Load a variable pump of the machine's size from low to high pressure; return signals."""
    flow, leakage = pump_flow(bench), configured_or_typical(bench, "pump_leakage")
    pump = {"supply_pressure": SET_HIGH, "variable_pump_flow": flow, "pump_leakage_flow": leakage}
    stand = pump_circuit(bench, pump | changes)
    # approximate flow at each pressure; it only determines the position of the points
    loads = [(p, flow - leakage * p / 250e5) for p in np.linspace(_TO, _FROM, _POINTS)]
    rows = [steady(stand, current_for(bench, q, p), names) for p, q in loads]
    return dict(zip(names, np.array(rows[::-1]).T, strict=True))
