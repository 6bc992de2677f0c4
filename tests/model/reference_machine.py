"""The HyQ knee actuator that the tests of the model share."""

from hil_emulator.model import actuator

STEP = 20e-6
"""Default step width [s]."""
P_S, P_T = 160e5, 1e5
"""Pressures of supply and tank of the knee [Pa] (S1)."""
K_V = 6.68e-6
"""Gain of its valve [m³/(s A √Pa)] (S1)."""


def machine(**changes: float) -> dict[str, float]:
    """Return the HyQ knee actuator's parameters by field name, SI."""
    base = {f"{t}_{p.name}": p.typical for t, ps in actuator.PARAMS.items() for p in ps}
    effects = {
        "viscous_friction_coefficient": 1000.0,
        "coulomb_friction_force": 100.0,
        "load_viscous_friction_coefficient": 500.0,
        "entrained_air_fraction": 0.001,
        "end_stops_stiffness": 1e8,
        "spool_rate_limit_rate": 3.6,
        "current_saturation_limit": 0.01,
    }
    return base | effects | changes


def bare(**changes: float) -> dict[str, float]:
    """Return the same actuator with every effect off."""
    return {f"{t}_{p.name}": p.typical for t, ps in actuator.PARAMS.items() for p in ps} | changes


def ballistic(**changes: float) -> dict[str, float]:
    """Return a load that the oil does not reach: a vanishing piston."""
    return bare(**({"cylinder_piston_area": 1e-9} | changes))


def pond(**changes: float) -> dict[str, float]:
    """Return a valve between chambers so large that their pressures stay where they are."""
    return bare(cylinder_dead_volume_a=1.0, cylinder_dead_volume_b=1.0, load_mass=1e5, **changes)
