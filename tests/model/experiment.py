"""Small experiments on an emulated actuator that several tests make."""

from collections.abc import Callable

import numpy as np

from hil_emulator.model.plant import Plant


def record(plant: Plant, steps: int, *names: str) -> np.ndarray:
    """Step one by one and return the named signals, shape (names, steps)."""
    rows = np.empty((steps, len(names)))
    for row in rows:
        plant.step(1)
        row[:] = [plant.signals[name] for name in names]
    return rows.T


def lock(plant: Plant, seconds: float, tick: float = 1e-3) -> None:
    """Let time pass with the rod held: a force that cancels what drives it."""
    for _ in range(round(seconds / tick)):
        plant.inputs.external_force = plant.signals.hydraulic_force
        plant.step(round(tick / plant.step_width))


def settle(plant: Plant, seconds: float) -> None:
    """Let time pass."""
    plant.step(round(seconds / plant.step_width))


def gain(
    plant: Plant, drive: Callable[[float], None], response: str, frequency: float, amplitude: float
) -> float:
    """Return the ratio of a signal's fundamental to a sine that drives the plant."""
    per_period = round(1.0 / (frequency * plant.step_width))
    angle = 2 * np.pi * np.arange(per_period) / per_period
    sums = 0j
    for period in range(8):
        for phi in angle:
            drive(amplitude * np.sin(phi))
            plant.step(1)
            if period >= 4:
                sums += plant.signals[response] * np.exp(-1j * phi)
    return float(abs(sums) * 2 / (4 * per_period) / amplitude)


def crossing_frequency(signal: np.ndarray, step: float) -> float:
    """Return the frequency [Hz] of an oscillation around its mean, from its rising crossings."""
    s = signal - signal.mean()
    rising = np.flatnonzero((s[:-1] < 0) & (s[1:] >= 0))
    share = s[rising] / (s[rising] - s[rising + 1])
    return float(1.0 / (np.diff(rising + share).mean() * step))
