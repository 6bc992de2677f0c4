"""Tables written by hand: loop, and the data sheet's values of valve and cylinder."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from hil_emulator.config import datasheet
from hil_emulator.config.table import DescribedTable, QuantityReader, StrictTable, TableOfWays
from hil_emulator.model.declare import Param
from hil_emulator.model.effects import element
from hil_emulator.units import show


def _time(name: str, meaning: str, typical: float, low: float, high: float, shown: str) -> Param:
    return Param(name, "s", meaning, typical, low, high, shown)


TICK = _time("tick", "period of the loop", 1e-3, 1e-4, 0.1, "ms")
STEP = _time("step", "integration step", 20e-6, 1e-6, 1e-3, "us")
SYNC_PERIOD = _time("sync_period", "time that one SYNC stands for", 1e-3, 1e-4, 10.0, "ms")
BORE = Param("bore", "m", "diameter of the piston", 0.016, 1e-3, 2.0, "mm")
ROD = Param("rod", "m", "diameter of the rod", 0.010, 1e-4, 2.0, "mm")
NOMINAL_FLOW = Param("nominal_flow", "m^3/s", "flow at rated current", 1.25e-4, 1e-7, 0.1, "l/min")
RATED_CURRENT = Param("rated_current", "A", "current of full opening", 0.01, 1e-4, 10.0, "mA")
SLOPE = Param(
    "slope", "rad", "angle of the rod over the horizontal, positive where extension lifts the load",
    math.pi / 6.0, -0.5 * math.pi, 0.5 * math.pi, "deg", source="F = m g sin(slope) of the mass",
)  # fmt: skip
DROP_PER_EDGE = Param(
    "pressure_drop_per_edge", "Pa", "dp_n1, over one metering edge", 70e5, 1e5, 500e5, "bar",
    difference=True,
)  # fmt: skip
DROP_TOTAL = Param(
    "pressure_drop_total", "Pa", "dp_n2 = 2 dp_n1, over the whole valve", 140e5, 1e5, 1000e5, "bar",
    difference=True,
)  # fmt: skip


class RigTable(DescribedTable):
    """The loop: tick, step, seed of the noise, reaction to late ticks and lost states."""

    tick: Annotated[float, QuantityReader(TICK)] = TICK.typical
    step: Annotated[float, QuantityReader(STEP)] = STEP.typical
    seed: int = Field(default=1, ge=0)
    """seed of the sensors' noise"""
    late: Literal["count", "stop"] = "count"
    """what happens at a late tick: count it, or stop the run"""
    not_finite: Literal["stop", "reset"] = "stop"
    """what happens if a state is not finite: stop the run, or reset the model"""
    sync_period: Annotated[float, QuantityReader(SYNC_PERIOD)] = SYNC_PERIOD.typical
    motion: Literal["linear", "rotary"] = "linear"
    """`rotary`: a shaft, whose quantities are angles (rad), torques (N*m) and inertias (kg*m^2)"""

    @model_validator(mode="after")
    def _whole_steps(self) -> "RigTable":
        for name in ("tick", "sync_period"):
            part, of = (self.step, "step") if name == "tick" else (self.tick, "tick")
            count = getattr(self, name) / part
            if abs(count - round(count)) > 1e-6 or count < 0.5:
                fit = [n * part for n in (math.floor(count), math.ceil(count)) if n > 0]
                nearest = " and ".join(show(time, "s", "us") for time in fit)
                raise ValueError(
                    f"{name} {show(getattr(self, name), 's', 'us')} is not a whole number of "
                    f"{show(part, 's', 'us')}, the {of}; the nearest that fit: {nearest}"
                )
        return self


class ModelTable(DescribedTable):
    """Files with effects of the user."""

    effects: tuple[str, ...] = ()
    """Python files that declare effects and list them in EFFECTS; paths relative to this file"""


class LoadTable(TableOfWays):
    """The slope on which the load is, which replaces its weight along the rod."""

    groups: ClassVar = datasheet.WEIGHT
    ways: ClassVar = frozenset({(0, 0), (1, 0), (0, 1)})
    wanted: ClassVar = "either gravity, the weight along the rod, or slope, the angle of the rod"

    slope: Annotated[float | None, QuantityReader(SLOPE)] = None

    def weight(self, mass: float) -> dict[str, float]:
        """Return the weight along the rod from the slope, if that is given."""
        return {} if self.slope is None else {"gravity_force": datasheet.weight(mass, self.slope)}


class LinesTable(TableOfWays):
    """What lies between valve and cylinder: lines of one model."""

    groups: ClassVar = datasheet.LINES
    ways: ClassVar = frozenset({(0, 0), (1, 0), (0, 1)})
    wanted: ClassVar = "either cylinder_lines or line_waves: both are the same lines"


class CylinderDatasheet(TableOfWays):
    """The cylinder's diameters, which replace its areas."""

    groups: ClassVar = datasheet.ALTERNATIVES["cylinder"][0]
    ways: ClassVar = frozenset({(2, 0), (0, 2)})
    wanted: ClassVar = "either bore and rod, or piston_area and area_ratio"
    data_sheet: ClassVar[tuple[str, ...]] = ("bore", "rod")

    bore: Annotated[float | None, QuantityReader(BORE)] = None
    rod: Annotated[float | None, QuantityReader(ROD)] = None

    @model_validator(mode="after")
    def _thin_rod(self) -> "CylinderDatasheet":
        if self.bore is not None and self.rod is not None and self.rod >= self.bore:
            raise ValueError("the rod must be thinner than the bore")
        return self

    def areas(self) -> dict[str, float]:
        """Return piston area and area ratio from the diameters, if these are given."""
        areas_found = {}
        if self.bore is not None:
            areas_found["cylinder_piston_area"] = datasheet.piston_area(self.bore)
        if self.bore is not None and self.rod is not None:
            areas_found["cylinder_area_ratio"] = datasheet.area_ratio(self.bore, self.rod)
        return areas_found

    def quantities(self) -> dict[str, datasheet.SheetQuantity]:
        """Return the bore, if it is given, by the parameter that follows from it."""
        factor = math.sqrt(4.0 / math.pi)
        bore = datasheet.SheetQuantity("bore", "m", "mm", factor, 0.5)
        return {} if self.bore is None else {"cylinder_piston_area": bore}


class OneSidedCylinder(CylinderDatasheet):
    """A piston or plunger without a chamber on the rod's side."""

    ways: ClassVar = frozenset({(2, 0), (0, 2), (1, 0), (0, 1)})
    wanted: ClassVar = "piston_area, or bore"
    data_sheet: ClassVar = ("bore",)


class CylinderAside(CylinderDatasheet):
    """A cylinder on a bench that does not require one."""

    ways: ClassVar = OneSidedCylinder.ways | {(0, 0)}


class ValveDatasheet(TableOfWays):
    """The valve's nominal flow at a pressure drop, which replaces its gain."""

    groups: ClassVar = datasheet.VALVE_GROUPS
    ways: ClassVar = frozenset({(1, 0, 0), (0, 2, 1)})
    wanted: ClassVar = (
        "either gain, or nominal_flow and rated_current and one of "
        "pressure_drop_per_edge (dp_n1, one metering edge) and pressure_drop_total "
        "(dp_n2 = 2 dp_n1, the whole valve)"
    )
    data_sheet: ClassVar = ("nominal_flow", "rated_current", "pressure_drop_total")

    nominal_flow: Annotated[float | None, QuantityReader(NOMINAL_FLOW)] = None
    rated_current: Annotated[float | None, QuantityReader(RATED_CURRENT)] = None
    pressure_drop_per_edge: Annotated[float | None, QuantityReader(DROP_PER_EDGE)] = None
    pressure_drop_total: Annotated[float | None, QuantityReader(DROP_TOTAL)] = None

    def gains(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the valve gain from the rating, if that is given.

        Args:
            values: parameters of the valve's effects by field name, SI.

        """
        if self.nominal_flow is None or self.rated_current is None:
            return {}
        drop = self.pressure_drop_per_edge or (self.pressure_drop_total or 0.0) / 2.0
        opening = datasheet.full_opening(self.rated_current, values)
        gain = datasheet.valve_gain(self.nominal_flow, opening, drop)
        return {"valve_gain": gain}

    def quantities(self, gain: float) -> dict[str, datasheet.SheetQuantity]:
        """Return the nominal flow, if it is given, by the parameter that follows from it.

        Args:
            gain: the valve gain [m³/(s A √Pa)] that follows.

        """
        if self.nominal_flow is None:
            return {}
        factor = self.nominal_flow / gain
        return {"valve_gain": datasheet.SheetQuantity("nominal_flow", "m^3/s", "l/min", factor)}


class ValveAside(ValveDatasheet):
    """A valve on a bench that does not require one."""

    ways: ClassVar = ValveDatasheet.ways | {(0, 0, 0)}


class ChannelTable(StrictTable):
    """A sensor channel."""

    @model_validator(mode="after")
    def _whose_filter(self) -> "ChannelTable":
        if getattr(self, "velocity_estimator", None) is None:
            return self
        for effect in element.EFFECTS:
            if getattr(self, effect.name, None) is not None:
                raise ValueError(
                    f"{effect.name} filters a quantity, and this velocity is formed from readings "
                    "of the position: set it at sensors.position"
                )
        return self
