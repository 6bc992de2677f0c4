"""Physical constants and numbers that several parts of the model share."""

S1 = (
    "S1: T. Boaventura, Hydraulic Compliance Control of the Quadruped Robot HyQ, doctoral thesis, "
    "chapter 3"
)
"""Full reference of S1, for outputs."""

S2 = "S2: the paper Analysis of the Nonlinearities in the Hydraulic Actuators"
"""Full reference of S2."""

ATMOSPHERE = 101_325.0
"""Standard atmosphere [Pa] (ISO 2533)."""

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²] (ISO 80000-3)."""

REFERENCE_TEMPERATURE = 313.15
"""Oil temperature at which every parameter is stated [K]: 40 °C, where ISO 3448 defines a
viscosity grade and where HyQ's cooler switches on (S1 3.3.2)."""

DISCHARGE = 0.6
"""Discharge coefficient of a turbulent metering edge (S1 3.3.2)."""

LEAST_OPENING = 1e-10
"""Opening below which a metering edge is closed [A]: 1e-8 of a usual valve's range; its fourth
power is representable in single precision."""

GAS_REACH = 0.18
"""Largest relative change of pressure for which the expansion of gas is computed in one step."""

GAS_STRIDE = 1.4
"""Pressure ratio of additional steps; after them the remaining change is within `GAS_REACH`."""

LEAST_GAS_PRESSURE = 1e-9
"""Pressure that keeps logarithms finite [Pa] (assumed); p > 0 wherever there is air."""

LIGHTEST_ROD = 0.1
"""Smallest mass of the rod with an elastic load cell [kg] (assumed): without mass it has no
dynamics."""

FASTEST_SLIP = 5e4
"""Largest rate at which dry friction, bristles or magnetisation change their sign [1/s] (assumed).

A step of 20 us is exact to 1e-4 at this rate. If a light mass or a high speed would be faster, the
change is spread over a longer distance."""

SLIDING_BEND = 3.0
"""Bend of sliding seals over the presliding distance (assumed): they transmit tanh 3 = 99.5 % of
dry friction, and are elastic up to a bend of 2, tanh 2 = 96 %."""

PIECES = 8
"""Number of pieces into which the integrator divides a step with an impact (assumed)."""

VELOCITY_DOUBT = 1e-5
"""Largest change of a velocity by curvature of the acceleration in an undivided step [m/s]
(assumed)."""

ACTUATORS = 1
"""Number of actuators on one supply; the module that `kernel` generates has its own value."""
