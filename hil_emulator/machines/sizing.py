"""Values that data sheets do not state, computed from the machine's size, each with its reason.

Most are rules of thumb for seals, pipes and sensors, scaled from the reference machine, whose
cylinder has been measured. The reason states this; a measurement of the machine is better.
"""

import math
from dataclasses import dataclass

from hil_emulator.machines.questions import Answers, number, piston_area, valve

REFERENCE_BORE = 0.016
"""Bore of HyQ's cylinder [m] (S1 3.4), the reference for scaling of seals."""

PIPE_SPEED = 5.0
"""Speed of the oil in a pressure line at the nominal flow [m/s] (usual: 4 to 6)."""

LEAST_VOLUME = 1e-8
"""Smallest dead volume of a chamber in a configuration [m³]."""

_RANGES = (1.0, 1.6, 2.5, 4.0, 6.0)
"""Usual steps of sensors' measuring ranges within a decade."""


@dataclass(frozen=True)
class Typical:
    """A usual value.

    Attributes:
        value: SI.
        reason: its origin.

    """

    value: float
    reason: str


def area_ratio(answers: Answers) -> float:
    """Return annulus area over piston area."""
    return 1.0 - (number(answers, "rod") / number(answers, "bore")) ** 2


def dead_volume(answers: Answers, ratio: float) -> Typical:
    """Return the volume of a chamber and its line with the piston at that end [m³].

    Args:
        answers: of the user.
        ratio: the chamber's area over the piston's.

    """
    swept = ratio * piston_area(answers) * number(answers, "stroke")
    flow = valve(answers).get("nominal_flow")
    line = flow / PIPE_SPEED * number(answers, "line_length")
    return Typical(
        max(LEAST_VOLUME, 0.03 * swept + line),
        f"assumed: 3 % of the swept volume, and a line for {PIPE_SPEED:g} m/s at nominal flow",
    )


def laminar_width(answers: Answers) -> Typical:
    """Return the pressure difference below which an edge is laminar [Pa]."""
    width = number(answers, "supply_pressure") / 160.0
    return Typical(width, "assumed: 1 bar of 160 bar; keeps the square root finite at zero")


def coulomb_friction(answers: Answers) -> Typical:
    """Return the dry friction of seals and guides [N]."""
    push = number(answers, "supply_pressure") * piston_area(answers)
    return Typical(0.02 * push, "assumed: 2 % of the largest push; servo cylinders 1, worn ones 5")


def viscous_friction(answers: Answers) -> Typical:
    """Return the viscous coefficient [N s/m] of a film with the length of the seal."""
    value = 1000.0 * number(answers, "bore") / REFERENCE_BORE
    return Typical(value, "assumed: 1000 N s/m at 16 mm bore (S1 3.4.2), with the seal's length")


def end_stop_stiffness(answers: Answers) -> Typical:
    """Return the stiffness of the cylinder's ends [N/m]."""
    push = number(answers, "supply_pressure") * piston_area(answers)
    return Typical(min(1e9, push / 50e-6), "assumed: the largest push bends them by 0.05 mm")


def leakage(answers: Answers) -> Typical:
    """Return the conductance past the piston [m³/(s Pa)]."""
    flow = 1e-3 * valve(answers).get("nominal_flow")
    reason = "assumed: 0.1 % of the nominal flow at supply pressure, as soft seals"
    return Typical(flow / number(answers, "supply_pressure"), reason)


def rod_mass(answers: Answers) -> Typical:
    """Return the mass of rod and piston [kg]: steel, the rod two bores longer than the stroke."""
    bore, rod = number(answers, "bore"), number(answers, "rod")
    volume = math.pi / 4.0 * (rod**2 * (number(answers, "stroke") + 2.0 * bore) + bore**3)
    return Typical(7850.0 * volume, "computed: steel, the piston one bore long")


def pressure_range(answers: Answers) -> Typical:
    """Return the upper end of the pressure sensors [Pa]; the annulus may exceed the supply."""
    return Typical(_range_above(1.3 * number(answers, "supply_pressure")), "next range of a maker")


def force_range(answers: Answers) -> Typical:
    """Return the upper end of the load cell [N]."""
    push = number(answers, "supply_pressure") * piston_area(answers)
    return Typical(_range_above(push), "next range above the largest push")


def _range_above(value: float) -> float:
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in (*_RANGES, 10.0) if step * decade >= value)


def no_load_speed(answers: Answers) -> float:
    """Return the extending speed at full current without load [m/s] (S1 eq. 3.9-3.12).

    With alpha the ratio of the areas, q = K_v u sqrt((p_s - alpha p_t)/(1 + alpha³)), and with a
    compensator the flow at the drop that it keeps, if that is less.
    """
    alpha = area_ratio(answers)
    drop = number(answers, "supply_pressure") - alpha * number(answers, "tank_pressure")
    kept = valve(answers).get("compensator", math.inf)
    return valve(answers).flow(min(drop / (1.0 + alpha**3), kept)) / piston_area(answers)


def pump_speed(answers: Answers) -> float:
    """Return the extending speed at the full flow of the pump [m/s]; infinite without a pump."""
    flow = number(answers, "pump_flow") if "pump_flow" in answers else math.inf
    return flow / piston_area(answers)


def natural_frequency(answers: Answers, bulk_modulus: float) -> float:
    """Return the frequency of mass on oil at mid-stroke [Hz]: K = E (A_a²/V_a + A_b²/V_b)."""
    half = 0.5 * number(answers, "stroke")
    stiffness = 0.0
    for ratio in (1.0, area_ratio(answers)):
        area = ratio * piston_area(answers)
        stiffness += bulk_modulus * area**2 / (dead_volume(answers, ratio).value + area * half)
    mass = number(answers, "mass") + rod_mass(answers).value
    return math.sqrt(stiffness / mass) / (2.0 * math.pi)
