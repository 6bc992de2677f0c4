"""A servo valve by its orifice equations alone: what a test compares the workflow with."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GAIN = 7.5e-3 / 60.0 / (0.01 * np.sqrt(35e5))
"""7.5 l/min at 10 mA over 35 bar per edge [m^3/(s A Pa^0.5)]."""

SUPPLY, TANK = 160e5, 1e5
LITRES = 6e4
"""l/min per m^3/s."""


def triangle(duration: float, rate: float, top: float, cycles: int) -> tuple[Array, Array]:
    """Return time and a current that goes up and down evenly."""
    time = np.arange(0.0, duration, 1.0 / rate)
    return time, 2.0 * top / np.pi * np.arcsin(np.sin(2.0 * np.pi * cycles * time / duration))


SLOT, C_D, DENSITY, VISCOSITY = 0.025, 0.6, 850.0, 46e-6 * 850.0
"""Height of the slots [m/A], turbulent discharge coefficient, and the oil."""
CREEPING = np.pi / 32.0 * SLOT * GAIN * np.sqrt(0.5 * DENSITY) / (C_D * VISCOSITY)
"""Flow that creeps through a slit, pi x² w dp/(32 mu), over u² dp; w from C_d x w = K u."""


def metered(opening: Array, drop: Array) -> Array:
    """Return the flow through edges: turbulent K u sqrt(dp), or creeping where that is less."""
    turbulent, creeping = GAIN * opening * np.sqrt(drop), CREEPING * opening**2 * drop
    both = np.maximum(turbulent**4 + creeping**4, 1e-300)
    return turbulent * creeping / both**0.25


def open_port(spool: Array, pressure: Array, lap: float) -> Array:
    """Return the flow out of port a at a given pressure through edges that overlap by a lap."""
    opened = np.maximum(np.abs(spool) - lap, 0.0)
    drop = np.where(spool > 0.0, SUPPLY - pressure, pressure - TANK)
    return np.sign(spool) * metered(opened, drop)


def blocked_ports(spool: Array, underlap: float) -> tuple[Array, Array, Array]:
    """Return both pressures of blocked ports, and the flow from s to t.

    Of each port, what comes from s leaves to t: (u0 + u)^2 (p_s - p) = (u0 - u)^2 (p - p_t).
    """
    opens, closes = np.maximum(underlap + spool, 0.0), np.maximum(underlap - spool, 0.0)
    total = opens**2 + closes**2
    a = (SUPPLY * opens**2 + TANK * closes**2) / total
    b = (SUPPLY * closes**2 + TANK * opens**2) / total
    drops = np.maximum(SUPPLY - a, 0.0), np.maximum(SUPPLY - b, 0.0)
    return a, b, metered(opens, drops[0]) + metered(closes, drops[1])


def noisy(values: Array, spread: float, file: Path) -> Array:
    """Return values with noise that belongs to a file."""
    seed = np.frombuffer(file.name.encode() + values.tobytes()[:64], np.uint8)
    return values + np.random.default_rng(seed.tolist()).normal(0.0, spread, len(values))
