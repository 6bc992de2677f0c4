"""A pump on the bench: the valve, its ports joined, is its load."""

import math
from collections.abc import Sequence

import numpy as np

from hil_emulator.characterise.result import Series
from hil_emulator.characterise.stand import Bench, Stand

SET_HIGH = 280e5
"""Set pressure of a variable pump, which so stays at full stroke up to 270 bar [Pa]."""

_HELD = 1.0  # each opening of the valve [s]
_POINTS = 21
_PIPE = 1e-3  # oil in each pipe behind a valve of the reference's size [m³]
_TIME_CONSTANTS = 10.0  # after which 0.005 % of a step are left
_FROM, _TO = 20e5, 265e5  # pressures at which a pump is loaded [Pa]


def own_or_typical(bench: Bench, effect: str) -> float:
    """Return the knob of an effect: the machine's, or the catalogue's where it is off."""
    known = next(e for e in bench.kernel.effects if e.name == effect)
    own = bench.value(known.field_of(known.knob))
    return own if own != known.off else known.knob.typical


def pump_flow(bench: Bench) -> float:
    """Return the flow of the machine's pump, of either kind, or of the catalogue's [m³/s]."""
    for effect in ("variable_pump", "fixed_pump"):
        own = bench.value(f"{effect}_flow")
        if math.isfinite(own):
            return own
    return own_or_typical(bench, "variable_pump")


def pump_circuit(bench: Bench, changes: dict[str, float]) -> Stand:
    """Return a pump whose flow goes through the valve and back, by pipes that are soon steady."""
    size = bench.valve_size
    pipes = {
        "cylinder_dead_volume_a": size * _PIPE,
        "cylinder_dead_volume_b": size * _PIPE,
        "internal_leakage_conductance": size * 1e-8,
    }
    alone = bench.off("supply", "tank", "valve", keep=("underlap", "land_leakage"))
    return bench.stand(alone | bench.joined() | pipes | changes)


def settling(bench: Bench, flow: float, pressure: float) -> int:
    """Return after how many openings held the pipes' oil takes no heat for its compression.

    Ten time constants of both pipes behind the valve's edges, C R = (2 V/E) (2 dp/q).
    """
    volume = 2.0 * bench.valve_size * _PIPE
    seconds = _TIME_CONSTANTS * volume / bench.value("oil_bulk_modulus") * 2.0 * pressure / flow
    return max(3, math.ceil(seconds / _HELD))


def steady(stand: Stand, current: float, names: Sequence[str]) -> list[float]:
    """Hold an opening of the valve [A]; return what signals are in the end."""
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
    flow, leakage = pump_flow(bench), own_or_typical(bench, "pump_leakage")
    pump = {"supply_pressure": SET_HIGH, "variable_pump_flow": flow, "pump_leakage_flow": leakage}
    stand = pump_circuit(bench, pump | changes)
    # about what is left of the flow there: it only places the points
    loads = [(p, flow - leakage * p / 250e5) for p in np.linspace(_TO, _FROM, _POINTS)]
    rows = [steady(stand, current_for(bench, q, p), names) for p, q in loads]
    return dict(zip(names, np.array(rows[::-1]).T, strict=True))
