"""Leakage, ends of stroke and the rod's own mass."""

from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.model.declare import Param, effect, factor
from hil_emulator.model.stages import cross_leakage, inertia, outward_leakage, stop


@effect(
    cross_leakage,
    knob=Param("conductance", "m^3/(s*Pa)", "laminar conductance past the piston",
               1.7e-13, 0.0, 1e-9, shown="cm^3/(min*bar)",
               source="public HyQ bench scripts: 0.16 l/min at 160 bar"),
    source="laminar gap flow (Merritt 1967)",
    signature="pressures drift together with the valve closed under load",
    not_modelled="eccentric piston, turbulent leakage",
)  # fmt: skip
def internal_leakage(
    pressure_a: float, pressure_b: float, viscosity: float, conductance: float
) -> float:
    """q_ab = C_i (p_a - p_b) nu_40/nu.

    Oil leaks past the piston.
    """
    return conductance * (pressure_a - pressure_b) / viscosity


@effect(
    outward_leakage,
    knob=Param("conductance", "m^3/(s*Pa)", "laminar conductance of each chamber to outside",
               2e-14, 0.0, 1e-9, shown="cm^3/(min*bar)"),
    source="laminar gap flow (Merritt 1967)",
    signature="both pressures decay with the valve closed",
    not_modelled="different leakage of the two chambers",
)  # fmt: skip
def external_leakage(pressure: float, viscosity: float, conductance: float) -> float:
    """q_e = C_e max(0, p - p_atm) nu_40/nu, for each chamber: seals let no air in.

    Oil leaks out of the cylinder.
    """
    return conductance * max(0.0, pressure - ATMOSPHERE) / viscosity


@effect(
    stop,
    knob=Param("stiffness", "N/m", "stiffness of the cylinder's ends", 1e8, 0.0, 1e12),
    shape=(
        Param("damping", "s/m", "relative growth of the force with the closing speed",
              2.0, 0.0, 50.0, default=2.0, spread=factor(2.0)),
    ),
    source="Hunt and Crossley 1975; the default stiffness is that of the steel, k = E A/L, see "
           "config.derived",
    signature="the two ends of the stroke",
    not_modelled="plastic deformation",
)  # fmt: skip
def end_stops(
    position: float, velocity: float, stiffness: float, damping: float, cylinder_stroke: float
) -> float:
    """F = k d (1 + c d'), d = depth in the stop, never pulling.

    The piston meets its ends.

    Continuous at contact, so that an impact does not reduce the accuracy of the integrator.
    """
    if position < 0.0:
        return max(0.0, -stiffness * position * (1.0 - damping * velocity))
    if position > cylinder_stroke:
        depth = position - cylinder_stroke
        return -max(0.0, stiffness * depth * (1.0 + damping * velocity))
    return 0.0


@effect(
    stop,
    knob=Param("coefficient", "N*s^2/m^2", "braking force per speed squared at the end",
               5000.0, 0.0, 1e9),
    shape=(
        Param("length", "m", "length of the cushion", 5e-3, 1e-4, 1.0, shown="mm", default=5e-3,
              spread=factor(1.5)),
    ),
    source="orifice of a tapered cushion plunger: drop ~ flow squared; brakes the rod directly "
           "instead of raising a trapped volume's pressure; sizes assumed",
    signature="the rod slows before the ends, and leaves them freely",
    not_modelled="pressure in the trapped volume, see `cushion_plunger`",
)  # fmt: skip
def cushion(
    position: float, velocity: float, coefficient: float, length: float, cylinder_stroke: float
) -> float:
    """F = -c v |v| d/l on the way into an end, d = depth in the cushion.

    The piston is cushioned at its ends.
    """
    depth = position - (cylinder_stroke - length) if velocity > 0.0 else length - position
    inside = max(0.0, min(1.0, depth / length))
    return -coefficient * velocity * abs(velocity) * inside


@effect(
    inertia,
    knob=Param("mass", "kg", "mass of piston and rod", 0.286, 0.0, 1e5,
               source="formula in a public HyQ bench script; up to the ram of a forging press"),
    source="S1 eq. 3.19 neglects it",
    signature="hydraulic force minus load cell at high acceleration",
)  # fmt: skip
def rod_mass(mass: float) -> float:
    """F = f_h - f_f - m_p a: the rod's inertia is not seen by the load cell.

    The load cell does not see the mass of the rod.
    """
    return mass


EFFECTS = (internal_leakage, external_leakage, end_stops, cushion, rod_mass)
