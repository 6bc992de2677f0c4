"""Leakage, end stops and the rod's own mass."""

from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import cross_leakage, inertia, outward_leakage, stop


@effect(
    cross_leakage,
    knob=Param("conductance", "m^3/(s*Pa)", "laminar conductance past the piston",
               1.7e-13, 0.0, 1e-11, source="public HyQ bench scripts: 0.16 l/min at 160 bar"),
    source="laminar gap flow (Merritt 1967)",
    signature="pressures drift together with the valve closed under load",
    not_modelled="eccentric piston, turbulent leakage",
)  # fmt: skip
def internal_leakage(pressure_a: float, pressure_b: float, conductance: float) -> float:
    """q_ab = C_i (p_a - p_b)."""
    return conductance * (pressure_a - pressure_b)


@effect(
    outward_leakage,
    knob=Param("conductance", "m^3/(s*Pa)", "laminar conductance of each chamber to outside",
               2e-14, 0.0, 1e-11),
    source="laminar gap flow (Merritt 1967)",
    signature="both pressures decay with the valve closed",
    not_modelled="different leakage of the two chambers",
)  # fmt: skip
def external_leakage(pressure: float, conductance: float) -> float:
    """q_e = C_e (p - p_atm), for each chamber."""
    return conductance * (pressure - ATMOSPHERE)


@effect(
    stop,
    knob=Param("stiffness", "N/m", "stiffness of the cylinder's ends", 1e8, 0.0, 1e9),
    shape=(
        Param("damping", "s/m", "relative growth of the force with the closing speed",
              2.0, 0.0, 50.0, default=2.0),
    ),
    source="Hunt and Crossley 1975; stiffness assumed, between 1e7 and 1e9 N/m",
    signature="the two ends of the stroke",
    not_modelled="cushioning",
)  # fmt: skip
def end_stops(
    position: float, velocity: float, stiffness: float, damping: float, cylinder_stroke: float
) -> float:
    """F = k d (1 + c d'), d = depth in the stop, never pulling.

    Continuous at contact, so that an impact costs the integrator no accuracy.
    """
    if position < 0.0:
        return max(0.0, -stiffness * position * (1.0 - damping * velocity))
    if position > cylinder_stroke:
        depth = position - cylinder_stroke
        return -max(0.0, stiffness * depth * (1.0 + damping * velocity))
    return 0.0


@effect(
    inertia,
    knob=Param("mass", "kg", "mass of piston and rod", 0.286, 0.0, 20.0,
               source="formula in a public HyQ bench script"),
    source="S1 eq. 3.19 neglects it",
    signature="hydraulic force minus load cell at high acceleration",
)  # fmt: skip
def rod_mass(mass: float) -> float:
    """F = f_h - f_f - m_p a: the rod's inertia is not seen by the load cell."""
    return mass


EFFECTS = (internal_leakage, external_leakage, end_stops, rod_mass)
