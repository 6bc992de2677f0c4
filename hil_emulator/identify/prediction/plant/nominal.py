"""Size of a machine relative to the reference machine, for which effects declare typical sizes.

Currents of a valve scale with its rated current (`model.rating`). Other sizes scale with four
ratios: pressure, piston area, stroke and valve flow.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.measured.experiment import FLOWS, Experiment
from hil_emulator.model.declare import Param, Stage
from hil_emulator.model.quantities import PARAMS
from hil_emulator.model.rating import REFERENCE_CURRENT
from hil_emulator.model.stages import edge_at, edge_bt, edge_sa, edge_sb, metering

_REFERENCE = {f"{table}_{p.name}": p.typical for table in ("supply", "cylinder", "valve")
              for p in PARAMS[table]}  # fmt: skip


@dataclass(frozen=True)
class Nominal:
    """Sizes of a machine over those of the reference machine, with two digits.

    Attributes:
        pressure: supply pressure.
        force: supply pressure times piston area; for a force bench, the load force.
        stroke: of the cylinder.
        flow: of the valve at rated current and supply pressure.
        current: rated current.
        opening: of leaking edges, in addition to the ratio of the currents.

    """

    pressure: float = 1.0
    force: float = 1.0
    stroke: float = 1.0
    flow: float = 1.0
    current: float = 1.0
    opening: float = 1.0

    @property
    def area(self) -> float:
        """Area of the piston."""
        return self.force / self.pressure

    @property
    def speed(self) -> float:
        """Speed of the rod."""
        return self.flow / self.area

    def sized(self, param: Param, stage: Stage) -> Param:
        """Return a declaration with the typical value for this machine, within its bounds."""
        typical = param.typical
        if stage.table in TABLES and param.unit in _SIZES:
            typical *= _SIZES[param.unit](self)
        elif stage in EDGES and param.unit == "A" and math.isfinite(param.off):
            typical *= self.opening
        return replace(param, typical=min(max(typical, param.low), param.high))

    def span(self, channel: str) -> float:
        """Return the typical range of a channel over the reference machine's."""
        return self.flow if channel in FLOWS else _SPANS[channel](self)


EDGES = (metering, edge_sa, edge_at, edge_sb, edge_bt)

TABLES = ("cylinder", "friction", "load", "supply", "tank")
"""Tables whose effects scale with the machine."""

_SIZES: dict[str, Callable[[Nominal], float]] = {
    "N": lambda n: n.force,
    "N/m": lambda n: n.force / n.stroke,
    "m/N": lambda n: n.stroke / n.force,
    "N*s/m": lambda n: n.force / n.speed,
    "N*s^2/m^2": lambda n: n.force / n.speed**2,
    "m^2": lambda n: n.area,
    "kg": lambda n: n.area * n.stroke,
    "m^3/s": lambda n: n.flow,
    "m^3/(s*Pa)": lambda n: n.flow / n.pressure,
    "Pa*s^2/m^6": lambda n: n.pressure / n.flow**2,
}
"""Scale of an effect, by the unit of its knob. Lengths do not scale with the stroke."""

_SPANS: dict[str, Callable[[Nominal], float]] = {
    "pressure_a": lambda n: n.pressure,
    "pressure_b": lambda n: n.pressure,
    "supply_pressure": lambda n: n.pressure,
    "position": lambda n: n.stroke,
    "load_force": lambda n: n.force,
    "velocity": lambda n: n.speed,
    "spool_position": lambda n: n.current,
}

NULL_FLOWS = ("supply_flow", "return_flow")
"""Meters of the flow from port s to port t."""

REFERENCE_FORCE = _REFERENCE["supply_pressure"] * _REFERENCE["cylinder_piston_area"]
"""Force of the reference machine at its supply pressure [N]."""


def nominal(values: Mapping[str, float], rated: float) -> Nominal:
    """Return the sizes of a machine; unknown ones are those of the reference machine.

    Args:
        values: parameters by field, SI.
        rated: current [A].

    """
    over = {field: values.get(field, math.nan) / typical for field, typical in _REFERENCE.items()}
    pressure, current = _rounded(over["supply_pressure"]), _rounded(rated / REFERENCE_CURRENT)
    flow = over["valve_gain"] * math.sqrt(max(over["supply_pressure"], 0.0))
    return Nominal(
        pressure, _rounded(over["supply_pressure"] * over["cylinder_piston_area"]),
        _rounded(over["cylinder_stroke"]), _rounded(flow * rated / REFERENCE_CURRENT), current,
    )  # fmt: skip


def _rounded(ratio: float) -> float:
    """Return a ratio with two digits, 1 for one that is unknown."""
    return float(f"{ratio:.2g}") if math.isfinite(ratio) and ratio > 0.0 else 1.0


SPARE = 3.0
"""Nominal force of a bench over the largest recorded force (assumed, as load cells are chosen)."""


def of_forces(experiments: Sequence[Experiment]) -> Nominal:
    """Return the sizes of a force bench, from the largest recorded load force."""
    largest = max(float(np.nanmax(np.abs(e.readings["load_force"]))) for e in experiments)
    return Nominal(force=_rounded(SPARE * largest / REFERENCE_FORCE))


LEAKS = 0.3
"""Typical opening of worn edges, over the opening with the total metered flow (assumed)."""

REFERENCE_OPENING = 28e-6
"""Typical opening of the reference machine's edges at null [A] (S1 3.5.1)."""


def of_leakage(
    machine: Nominal, experiments: Sequence[Experiment], values: Mapping[str, float]
) -> Nominal:
    """Return the sizes of a valve with blocked ports, from the largest flow from s to t.

    On each side, two edges in series share the supply pressure.

    Args:
        machine: sizes from the configuration.
        experiments: of the bench.
        values: parameters by field, SI.

    """
    flows = [e.readings[name] for e in experiments for name in NULL_FLOWS if name in e.readings]
    largest = max((float(np.nanmax(np.abs(flow))) for flow in flows), default=0.0)
    through = values["valve_gain"] * math.sqrt(0.5 * values["supply_pressure"])
    opening = LEAKS * 0.5 * largest / through / (REFERENCE_OPENING * machine.current)
    return replace(machine, opening=max(_rounded(opening), 1.0))
