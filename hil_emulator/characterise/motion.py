"""A position controller that moves the rod along a path through its own valve.

Proportional, with feed-forward of the current for the set speed and compensation of the valve's
dead band. It uses the position sensor, as a controller on a real bench does.
"""

import math
from collections.abc import Iterator

from hil_emulator.characterise.size import quickness
from hil_emulator.characterise.stand import Bench, BenchRecord, Stand

_BANDWIDTH = 20.0
"""Bandwidth of the position loop [rad/s], far below the reference machine's resonance (assumed)."""


_OF_SPOOL = 0.2
"""Largest bandwidth of the position loop relative to the spool's natural frequency (assumed)."""

_JUMP = 2e-3
"""Range of current in which the dead band is crossed, relative to the rated current (assumed)."""


class Mover:
    """Moves the rod of an actuator on its stand.

    Args:
        bench: the actuator; gives the gain from current to speed at half the supply pressure.
        stand: the stand it is mounted on.

    """

    def __init__(self, bench: Bench, stand: Stand) -> None:
        par = stand.plant.parameters
        drop = 0.5 * float(par.supply_pressure - par.tank_pressure)
        area = float(par.cylinder_piston_area)
        spool = _OF_SPOOL * 2.0 * math.pi * bench.value("valve_natural_frequency")
        self._bandwidth = min(_BANDWIDTH * min(1.0, quickness(bench)), spool)
        self._speed_gain = bench.value("valve_gain") * math.sqrt(drop) / area
        self._lap = bench.value("overlap_lap")
        self._width = _JUMP * bench.rated_current
        self._stand = stand
        self._position = stand.sensors.names.index("position")

    def _jumped(self, current: float) -> float:
        """Return the current with compensation of the dead band."""
        return current + self._lap * math.tanh(current / self._width) if self._lap else current

    def follow(self, path: Iterator[tuple[float, float]]) -> BenchRecord:
        """Follow (position [m], velocity [m/s]), one pair per tick, and record."""
        stand = self._stand
        reading, rows = stand.tick(0.0), []
        for position, velocity in path:
            error = position - reading[self._position]
            current = self._jumped((velocity + self._bandwidth * error) / self._speed_gain)
            rows.append(stand.row(current))
            reading = stand.sensors.reading
        return stand.recording(rows)


def sine(
    centre: float, amplitude: float, hertz: float, period: float, cycles: float
) -> Iterator[tuple[float, float]]:
    """Yield a sine motion about a position [m], starting at this position."""
    omega = 2.0 * math.pi * hertz
    for i in range(round(cycles / hertz / period)):
        phase = omega * i * period
        yield centre + amplitude * math.sin(phase), amplitude * omega * math.cos(phase)


def stroke(
    start: float, velocity: float, length: float, period: float
) -> Iterator[tuple[float, float]]:
    """Yield a motion at constant velocity from a position [m]."""
    for i in range(round(length / abs(velocity) / period)):
        yield start + velocity * i * period, velocity
