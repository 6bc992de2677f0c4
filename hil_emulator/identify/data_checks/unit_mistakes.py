"""Probable mistakes of units, by the factor by which a channel is off."""

from collections.abc import Mapping
from itertools import permutations

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.units import factor

UNITS_IN_USE = {
    "Pa": ("bar", "MPa", "kPa", "psi", "Pa"),
    "N": ("N", "kN", "kgf"),
    "m": ("mm", "m", "cm", "inch", "um"),
    "A": ("mA", "A"),
}
"""Units of each quantity that loggers write, the usual ones first."""

TOLERANCE = 1.3
"""Largest ratio between a channel's factor and that of a mistake (assumed)."""

CLOSED = 0.15
"""Ratio of remainders up to which two explanations are equally good (assumed)."""

CLOSED_BETTER = 3.0
"""Factor by which another unit must reduce the remainder (assumed)."""

FILLED = 0.3
"""Least part of the stroke that a position in the right unit covers (assumed)."""

AS_GOOD = 1.3
"""Ratio of remainders up to which two explanations are equally good (assumed)."""


def mistakes(quantity: str) -> dict[float, str]:
    """Return the mistake of units in words, by the factor that it causes.

    Args:
        quantity: its SI unit.

    """
    texts: dict[float, str] = {}
    for written, taken in permutations(UNITS_IN_USE.get(quantity, ()), 2):
        ratio = factor(quantity, taken) / factor(quantity, written)
        texts.setdefault(float(f"{ratio:.4g}"), f"as if {written} had been read as {taken}")
    return texts


def likely(quantity: str, ratio: float) -> str:
    """Return the mistake in words that makes readings `ratio` times too large, or ""."""
    texts = mistakes(quantity)
    if ratio <= 0.0 or not texts:
        return ""
    near = min(texts, key=lambda f: abs(np.log(ratio / f)))
    fits = abs(np.log(ratio / near)) < np.log(TOLERANCE)
    return f", {texts[near]}" if fits else ""


def of_position(values: Array, stroke: float) -> str:
    """Return the only mistake in words that keeps a position within the stroke, or ""."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    inside = [
        words for f, words in mistakes("m").items()
        if -0.05 * stroke < low / f and FILLED * stroke < high / f < 1.05 * stroke
    ]  # fmt: skip
    return f", {inside[0]}" if len(inside) == 1 else ""


def balance(e: Experiment, plant: Mapping[str, float]) -> str:
    """Return the wrong unit that explains why pressures and load force do not balance, or "".

    Each channel, and both pressures together, is tried in every unit. The result is "" if no unit
    closes the balance.
    """
    parts = _forces(e, plant)
    if len(parts) < 2:
        return ""
    tried = {("nothing", ""): _remainder(parts)}
    pressures = tuple(n for n in parts if n != "load_force")
    groups: set[tuple[str, ...]] = {(n,) for n in parts}
    if not len(e.current):  # behind a valve they share the supply pressure, see `magnitudes`
        groups.add(pressures)
    for names in sorted(groups):
        for ratio, words in mistakes("N" if names == ("load_force",) else "Pa").items():
            scaled = {n: v / ratio if n in names else v for n, v in parts.items()}
            tried[" and ".join(names), words] = _remainder(scaled)
    unchanged = tried.pop(("nothing", ""))
    best = min(tried.values())
    if best > CLOSED or unchanged < CLOSED_BETTER * best:
        return ""
    good = sorted(
        (v, f"{name} {'look' if ' ' in name else 'looks'} {words}")
        for (name, words), v in tried.items() if v < AS_GOOD * best
    )  # fmt: skip
    return "load_force and the pressures do not balance: " + ", or ".join(
        words for _, words in good[:3]
    )


def _forces(e: Experiment, plant: Mapping[str, float]) -> dict[str, Array]:
    """Return the forces by channel [N], which balance except for friction and inertia."""
    area = plant["cylinder_piston_area"]
    sizes = {"pressure_a": area, "pressure_b": -area * plant["cylinder_area_ratio"],
             "load_force": -1.0}  # fmt: skip
    if "load_force" not in e.readings or "pressure_a" not in e.readings:
        return {}
    forces = {n: s * e.readings[n] for n, s in sizes.items() if n in e.readings}
    good = np.all([np.isfinite(v) for v in forces.values()], axis=0)
    return {n: v[good] for n, v in forces.items()} if good.any() else {}


def _remainder(parts: Mapping[str, Array]) -> float:
    values = np.array(list(parts.values()))
    size = float(np.sqrt(np.mean(np.sum(values**2, axis=0))))
    return float(np.sqrt(np.mean(np.sum(values, axis=0) ** 2))) / max(size, 1e-30)
