"""The oil's stiffness, vapour and viscosity."""

import math

from numba.extending import register_jitable

from hil_emulator.model.constants import ATMOSPHERE, LEAST_GAS_PRESSURE, REFERENCE_TEMPERATURE
from hil_emulator.model.declare import SETTING, Param, effect, factor
from hil_emulator.model.stages import (
    gas_expansion,
    gas_pressure,
    oil,
    vapour,
    viscosity,
)

LARGEST_GAS_PRESSURE = 1e5
"""Upper bound of the gas pressure [Pa] (assumed). Mixtures that are soft above it need no smaller
step, and a small bound keeps the chamber's state close to its pressure."""


@effect(
    viscosity,
    knob=Param("slope", "1", "slope m of log10 log10(nu + 0.7) against log10 T", 3.68, 0.0, 6.0,
               source="46 mm²/s at 40 °C (ISO 3448) and 6.8 mm²/s at 100 °C, viscosity index 100"),
    source="Walther's equation (ASTM D341) through the viscosity at 40 °C",
    signature="damping, leakage and laminar flow move together with temperature",
    not_modelled="viscosity under pressure",
)  # fmt: skip
def viscosity_temperature(
    viscosity: float, temperature: float, slope: float, oil_kinematic_viscosity: float
) -> float:
    """log10 log10(nu + 0.7) = Z_40 - m log10(T / 313.15 K), nu in mm²/s.

    The oil is thinner when it is warm.
    """
    at_reference = 1e6 * oil_kinematic_viscosity
    level = math.log10(math.log10(at_reference + 0.7))
    level -= slope * math.log10(temperature / REFERENCE_TEMPERATURE)
    # the equation holds above 0.21 mm²/s; no hydraulic oil is thinner
    nu: float = max(0.21, 10.0 ** (10.0**level) - 0.7)
    return viscosity * nu / at_reference


@effect(
    oil,
    knob=Param("rise", "1", "rise of the modulus with pressure", 6.0, 0.0, 100.0),
    source="linear secant modulus as in Simscape (gain 6); with hoses up to 60 (Hoffmann 1981, in "
    "Gholizadeh et al. 2011)",
    signature="pressure rates grow with pressure",
)
def modulus_pressure(bulk_modulus: float, pressure: float, rise: float) -> float:
    """E = E + m p.

    The oil is stiffer at higher pressure.
    """
    return bulk_modulus + rise * pressure


@effect(
    oil,
    knob=Param("fall", "1/K", "relative fall of the modulus with temperature", 0.004, 0.0, 0.01,
               shown="%/K"),
    source="mineral oil: 0.3 to 0.6 % per kelvin; assumed",
    signature="pressure rates fall as the oil warms",
)  # fmt: skip
def modulus_temperature(bulk_modulus: float, temperature: float, fall: float) -> float:
    """E = E (1 - n (T - 40 °C)).

    The oil is softer when it is warm.
    """
    return bulk_modulus * (1.0 - fall * (temperature - REFERENCE_TEMPERATURE))


def _gas_pressure(fraction: float, polytropic_exponent: float, oil_bulk_modulus: float) -> float:
    """Pressure where w E/(k p) = 1, w = r (p_0/p)^(1/k): gas is as soft as oil."""
    k = polytropic_exponent
    softness = fraction * oil_bulk_modulus / (k * ATMOSPHERE)
    return min(LARGEST_GAS_PRESSURE, ATMOSPHERE * math.pow(softness, k / (k + 1.0)))


def _gas_expansion(pressure: float, polytropic_exponent: float) -> float:
    """(p_0/p)^(1/k)."""
    return math.pow(ATMOSPHERE / max(pressure, LEAST_GAS_PRESSURE), 1.0 / polytropic_exponent)


@register_jitable
def _pade(u: float, a: float) -> float:
    """Return 2F1(-4, -4 - a; -8; -u): over that of -a it is (1 + u)^a, a Padé approximant."""
    first = 4.0 + a
    second = first * (3.0 + a)
    third = second * (2.0 + a)
    fourth = third * (1.0 + a) * (1.0 / 1680.0)
    square = u * u
    low = 1.0 + (0.5 * first) * u
    high = second * (3.0 / 28.0) + (third * (1.0 / 84.0)) * u
    return low + square * (high + square * fourth)


@register_jitable
def _thinning(strain: float) -> float:
    """Return exp(p/E): ten terms, exact to 1e-11 up to p = E/3."""
    square = strain * strain
    fourth = square * square
    low = 1.0 + strain + square * (0.5 + strain * (1.0 / 6.0))
    high = 1.0 / 24.0 + strain * (1.0 / 120.0) + square * (1.0 / 720.0 + strain * (1.0 / 5040.0))
    high += fourth * (1.0 / 40320.0 + strain * (1.0 / 362880.0))
    return low + fourth * high


@effect(
    oil,
    knob=Param("fraction", "1", "air volume at 1 atm over oil volume", 0.005, 0.0, 0.2, shown="%"),
    shape=(
        Param(
            "polytropic_exponent",
            "1",
            "1 isothermal, 1.4 adiabatic",
            1.4,
            1.0,
            1.4,
            default=1.4,
            source="S2: kappa = 1.4",
            spread=factor(1.1),
        ),
    ),
    source="S2 eq. 1, corrected: the printed one does not give E for vanishing air",
    signature="chambers get soft below some 50 bar; pressures end above vacuum",
    not_modelled="air going into and out of solution; see the cavitation floor for vapour",
    also=(
        (gas_pressure, _gas_pressure),
        (gas_expansion, _gas_expansion),
    ),
)
def entrained_air(
    bulk_modulus: float, pressure: float, change: float, expansion: float,
    fraction: float, polytropic_exponent: float,
) -> float:  # fmt: skip
    """E' = E (1 + w) / (1 + w E / (k p)), w = r (p_0/p)^(1/k) exp(p/E).

    There is air in the oil.

    From V = V_L exp(-p/E) + V_G (p_0/p)^(1/k) and E' = -V dp/dV, p absolute: oil of constant
    tangent modulus E, as in the balances, and a polytropic gas; w is the volume of the gas over
    that of the oil. The other usual form, V_L (1 - p/E), has a modulus E - p without air. E' tends
    to E at high pressure and to k p towards vacuum, so a pressure cannot become negative. The power
    is computed from its value at a nearby pressure.
    """
    p = max(pressure, LEAST_GAS_PRESSURE)
    power = 1.0 / polytropic_exponent
    upper, lower = _pade(change, -power), _pade(change, power)
    # w as a quotient, so that one division is sufficient
    upper *= fraction * expansion * _thinning(p * (1.0 / bulk_modulus))
    softest = polytropic_exponent * p
    modulus: float = bulk_modulus * softest * (lower + upper)
    return modulus / (softest * lower + bulk_modulus * upper)


@effect(
    oil,
    knob=Param("compliance", "m^3/Pa", "volume per pressure of the hoses and walls of each "
               "chamber", 1e-15, 0.0, 1e-13, shown="mm^3/bar"),
    source="1/beta_e = 1/beta + C/V, series of springs (Merritt 1967)",
    signature="a capacity that does not change along the stroke; like dead volume",
    not_modelled="creep of rubber hoses",
)  # fmt: skip
def line_compliance(bulk_modulus: float, volume: float, compliance: float) -> float:
    """1/E' = 1/E + C/V.

    The lines to the chambers give way.
    """
    return bulk_modulus / (1.0 + compliance * bulk_modulus / volume)


@effect(
    vapour,
    knob=Param("pressure_floor", "Pa", "pressure below which the oil releases air",
               0.6e5, 0.0, 1e5, shown="bar", source="S2: 0.6 bar"),
    shape=(
        Param("vapour_pressure", "Pa", "pressure at which the oil boils; without it both happen at "
              "pressure_floor", 1e5, 0.0, 1e5, shown="bar", default=1e5,
              source="S2 has one pressure for both; mineral oil at 40 °C: below 1 mbar",
              spread=SETTING),
        Param("dissolved_air", "1", "volume of the air that the oil holds at pressure_floor, over "
              "the oil's", 0.09, 1e-4, 1.0, shown="%", default=0.09,
              source="Bunsen coefficient of mineral oil: 8 to 9 %", spread=SETTING),
    ),
    source="S2; Henry's law for the released air, isothermal and in equilibrium; the volume of "
           "vapour and air is filled again before the pressure rises",
    signature="flat bottom of a chamber's pressure while the rod runs ahead of the flow",
    not_modelled="time for growth and collapse of bubbles, and for air to dissolve; with "
                 "entrained_air the missing volume is only about (p_g - p_c)/E",
)  # fmt: skip
def cavitation_floor(
    pressure: float, continued: float, pressure_floor: float, vapour_pressure: float,
    dissolved_air: float, oil_bulk_modulus: float,
) -> float:  # fmt: skip
    """p = max(p, p_v, p_g/(1 + (p_g - p_c)/(b E))),  p_v = min(p_v, p_g).

    The oil cavitates.

    The pressure of the balances is continued below p_g as p_c. The missing volume, (p_g - p_c)/E of
    the chamber's, is that of released air, b (p_g/p - 1), until the oil boils.
    """
    missing = max(0.0, pressure_floor - continued) / (dissolved_air * oil_bulk_modulus)
    least = min(vapour_pressure, pressure_floor)
    return max(max(pressure, least), pressure_floor / (1.0 + missing))


EFFECTS = (
    viscosity_temperature, modulus_pressure, modulus_temperature, entrained_air, line_compliance,
    cavitation_floor,
)  # fmt: skip
