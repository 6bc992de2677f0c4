"""The oil's stiffness."""

from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import oil

PRESSURE_FLOOR = 1.0
"""Absolute pressure below which the mixture's stiffness falls no further [Pa] (assumed).

Only a guard for the power: the bulk modulus there is 1.4 Pa."""


@effect(
    oil,
    knob=Param("fraction", "1", "air volume at 1 atm over oil volume", 0.005, 0.0, 0.2, shown="%"),
    shape=(
        Param("polytropic_exponent", "1", "1 isothermal, 1.4 adiabatic", 1.4, 1.0, 1.4, default=1.4,
              source="S2: kappa = 1.4"),
    ),
    source="S2 eq. 1, corrected: the printed one does not give E for vanishing air",
    signature="chambers get soft below some 50 bar; pressures end above vacuum",
    not_modelled="air going into and out of solution; see the cavitation floor for vapour",
)  # fmt: skip
def entrained_air(
    bulk_modulus: float, pressure: float, fraction: float, polytropic_exponent: float
) -> float:
    """E' = E (1 + w) / (1 + w E / (k p)), w = r (p_0/p)^(1/k).

    From V = V_L (1 - p/E) + V_G (p_0/p)^(1/k) and E' = -V dp/dV, p absolute. E' tends to E at
    high pressure and to k p towards vacuum, so that a pressure cannot become negative.
    """
    p = max(pressure, PRESSURE_FLOOR)
    gas: float = fraction * (ATMOSPHERE / p) ** (1.0 / polytropic_exponent)
    return bulk_modulus * (1.0 + gas) / (1.0 + gas * bulk_modulus / (polytropic_exponent * p))


EFFECTS = (entrained_air,)
