"""The oil's heat balance: losses, walls and cooler."""

import math
from typing import NamedTuple

from hil_emulator.model.declare import Param, Quantity, effect, factor, within
from hil_emulator.model.stages import heat, temperature


class Cooling(NamedTuple):
    """Parameters of the heat flow out of the oil."""

    wall: float
    surroundings: float
    cooler: float
    cooler_on: float


def _warming(
    loss: float, rise: float, volume: float, specific_heat: float, cooling: Cooling,
    oil_temperature: float, oil_density: float,
) -> float:  # fmt: skip
    """Rate of the temperature: losses of valve, gaps and pump heat the oil."""
    now = oil_temperature + rise
    taken = cooling.wall * (now - cooling.surroundings)
    taken += cooling.cooler * max(0.0, now - cooling.cooler_on)
    return (loss - taken) / (oil_density * specific_heat * volume)


@effect(
    temperature,
    knob=Param("volume", "m^3", "oil that is warmed as one", 5e-3, 1e-5, math.inf, shown="l",
               off=math.inf),
    shape=(
        Param("specific_heat", "J/(kg*K)", "specific heat of the oil", 1900.0, 1000.0, 5000.0,
              default=1900.0, source="mineral oil, assumed", spread=factor(1.1)),
        Param("wall", "W/K", "heat through tank and pipes per kelvin", 10.0, 0.0, 1e4,
              default=10.0, spread=factor(2.0)),
        Param("surroundings", "K", "temperature of the surroundings", 293.15, 223.15, 353.15,
              shown="degC", default=293.15, spread=within(10.0)),
        Param("cooler", "W/K", "heat that the cooler takes per kelvin above its set point", 100.0,
              0.0, 1e5, default=100.0, spread=factor(2.0)),
        Param("cooler_on", "K", "temperature from which the cooler works", 313.15, 273.15, 373.15,
              shown="degC", default=313.15, source="S1 3.3.2: some 40 °C", spread=within(10.0)),
    ),
    states=(Quantity("rise", "K", "temperature over the configured one"),),
    source="energy balance of a perfectly mixed, incompressible oil with the losses of valve, "
           "gaps, pump and relief valve (S1 3.2); sizes assumed",
    signature="damping, leakage and laminar flow drift over minutes with the work that is done",
    not_modelled="different temperatures along the circuit; heat of the metal; friction of the "
                 "seals; a cooler that switches; a shared tank. Each actuator warms its own oil, "
                 "with all losses of a shared pump",
    also=((heat, _warming),),
)  # fmt: skip
def oil_heating(temperature: float, rise: float) -> float:
    """dT/dt = (P - G_w (T - T_0) - G_c max(0, T - T_c)) / (rho c V).

    The oil warms with the work that is done, and cools down.
    """
    return temperature + rise


EFFECTS = (oil_heating,)
