"""Conversion of the values on data sheets to those of the equations."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from hil_emulator.model.constants import GRAVITY

_GAIN = frozenset({"gain"})
_RATING = frozenset({"nominal_flow", "rated_current"})
_DROPS = frozenset({"pressure_drop_per_edge", "pressure_drop_total"})

LINES = (frozenset({"cylinder_lines"}), frozenset({"line_waves"}))
"""Two models of the same lines."""

WEIGHT = (frozenset({"gravity"}), frozenset({"slope"}))
"""The weight of the load along the rod, or the slope on which it is."""

VALVE_GROUPS = (_GAIN, _RATING, _DROPS)
"""Keys of the valve that belong together: its gain, its rating, the rating's drop."""

ALTERNATIVES: dict[str, tuple[tuple[frozenset[str], frozenset[str]], ...]] = {
    "valve": (
        (_GAIN, _RATING | _DROPS),
        (frozenset({"pressure_drop_per_edge"}), frozenset({"pressure_drop_total"})),
    ),
    "cylinder": ((frozenset({"piston_area", "area_ratio"}), frozenset({"bore", "rod"})),),
    "lines": (LINES,),
    "load": (WEIGHT,),
}
"""Keys of a table that exclude each other: two ways to state the same quantity."""


@dataclass(frozen=True)
class SheetQuantity:
    """The quantity of a data sheet in which a configuration states a parameter of the model.

    Attributes:
        name: its key, such as `nominal_flow` for the valve's gain.
        unit: its SI unit.
        shown: the unit in which reports show it.
        factor: its value is factor parameter^power, all in SI.
        power: see `factor`.

    """

    name: str
    unit: str
    shown: str
    factor: float
    power: float = 1.0

    def of(self, parameter: float) -> float:
        """Return its value [unit] for a value of the parameter."""
        return float(self.factor * parameter**self.power)


def full_opening(rated_current: float, values: Mapping[str, float]) -> float:
    """Return the opening of an edge at the rated current [A].

    A sheet's nominal flow is that of full command: what the overlap takes of the travel, and the
    resistance of the passages, are in it.

    Args:
        rated_current: rated current [A].
        values: parameters by field name, SI.

    """
    opening = rated_current - values.get("overlap_lap", 0.0)
    passage = values.get("flow_saturation_passage", math.inf)
    return opening / math.hypot(1.0, opening / passage)


def valve_gain(nominal_flow: float, opening: float, drop_per_edge: float) -> float:
    """Return K_v = q_n / (u_vn sqrt(dp_n1)) [m³/(s A √Pa)] (S1 eq. 3.8).

    Args:
        nominal_flow: flow at rated current [m³/s].
        opening: of the edges there [A]; in S1, without overlap, the rated current.
        drop_per_edge: pressure drop over one metering edge, dp_n1 [Pa]. A data sheet's drop over
            the whole valve is dp_n2 = 2 dp_n1 (S1 eq. 3.7). The wrong choice changes the flow by
            41 %.

    """
    return nominal_flow / (opening * math.sqrt(drop_per_edge))


def weight(mass: float, slope: float) -> float:
    """Return the weight of a mass [kg] along a rod that rises by an angle [rad] to its end [N]."""
    return mass * GRAVITY * math.sin(slope)


def piston_area(bore: float) -> float:
    """Return the cap-side area [m²] of a bore [m]."""
    return math.pi * bore**2 / 4.0


def area_ratio(bore: float, rod: float) -> float:
    """Return annulus area over piston area of bore and rod diameter [m]."""
    return 1.0 - (rod / bore) ** 2
