"""Hidden effects with their sizes, in a dirty world: what a blind test consists of."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.experiment import Experiment
from tests.identify.generator.plant import AT, FIELDS, advance

PERIOD = 1e-3

KNEE = {
    "supply": 160e5, "tank": 1e5, "kv": 6.681e-6, "wv": 2 * np.pi * 250.0, "zv": 0.7,
    "area": 2.0106e-4, "alpha": 0.61, "stroke": 0.08, "va": 3e-6, "vb": 3e-6, "beta": 1.3e9,
    "mass": 50.0, "viscous": 1000.0, "coulomb": 100.0, "load_viscous": 500.0, "underlap": 28e-6,
    "air": 0.001,
}  # fmt: skip
"""What the configuration states about the machine."""

SPREAD = {
    "kv": 0.1, "wv": 0.1, "zv": 0.15, "va": 0.1, "vb": 0.1, "beta": 0.15, "mass": 0.02,
    "viscous": 0.3, "coulomb": 0.3, "load_viscous": 0.3,
}  # fmt: skip
"""Relative deviation of the real machine, one standard deviation."""

MEDIUM = {
    "null_bias": 1e-4, "overlap": 1e-4, "gain_asymmetry": 0.05, "internal_leakage": 5e-14,
    "external_leakage": 2e-14, "more_air": 0.01, "back_pressure": 8e13, "stribeck": 35.0,
    "friction_asymmetry": 0.12, "pressure_friction": 3e-6, "position_friction": 0.4,
    "load_spring": 5e3, "gravity": 60.0, "hysteresis": 1.2e-4,
    "transport_delay": 1.5e-3, "pressure_a.offset": 1e5, "pressure_b.gain_error": 0.01,
    "load_force.offset": 30.0, "load_force.gain_error": 0.03, "position.delay": 1.5e-3,
}  # fmt: skip
"""Medium size of each effect, SI."""

SIZES = {"small": 0.35, "medium": 1.0, "large": 2.5, "tiny": 0.05}

CALLED = {"more_air": None, "stribeck": "stribeck_friction"}
"""Where the catalogue's name is another one; free air is configured already."""

OUTSIDE = {"place_leak": 1.5e-13, "jam": 60.0, "drag": 2e4, "burst": 60.0}
"""Effects that no catalogue has."""

BALANCES = {
    "place_leak": "leakage", "jam": "piston", "drag": "piston", "burst": "load",
}  # fmt: skip


@dataclass(frozen=True)
class Machine:
    """A machine with hidden effects: {effect: size}, and whether their laws are foreign."""

    effects: Mapping[str, float]
    foreign: bool
    seed: int
    coloured: bool = False


def truth(machine: Machine) -> np.ndarray:
    """Return the parameter vector of the real machine."""
    random = np.random.default_rng(machine.seed)
    p = np.zeros(len(FIELDS))
    for name, value in KNEE.items():
        factor = 1.0 + SPREAD.get(name, 0.0) * random.uniform(-1.05, 1.05)
        p[AT[name]] = value * factor
    p[AT["ripple"]] = 0.03
    p[AT["foreign"]] = float(machine.foreign)
    for name, size in machine.effects.items():
        if name in AT:
            p[AT[name]] = size
    return p


def wanted(kind: str, time: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a position over time [m]."""
    if kind == "steps":
        return 0.04 + random.uniform(-0.01, 0.01, 30)[(time / 0.3).astype(int) % 30]
    if kind == "triangles":
        return 0.04 + 0.012 * (2.0 * np.abs(2.0 * (time / 2.0 % 1.0) - 1.0) - 1.0)
    if kind == "chirp":
        return 0.04 + 1.5e-3 * np.sin(2 * np.pi * (2.0 * time + 9.0 * time**2)) / (1 + time)
    fast = 1.6 if kind == "fast" else 1.0
    frequencies = fast * np.array([0.6, 1.1, 2.3, 4.1, 7.9, 13.0, 23.0, 37.0])
    sizes = np.array([6.0, 5.0, 3.0, 2.0, 1.0, 0.5, 0.25, 0.1]) * 1e-3 * np.sqrt(fast)
    phases = random.uniform(0.0, 2.0 * np.pi, len(sizes))
    waves = np.sin(2 * np.pi * np.outer(time, frequencies) + phases) - np.sin(phases)
    return 0.04 + waves @ sizes * np.minimum(1.0, time / 0.4)


def record(machine: Machine, kind: str, seed: int, duration: float = 2.0) -> Experiment:
    """Run one experiment in closed loop: drift, ripple, noise as on a bench."""
    random = np.random.default_rng((machine.seed, seed))
    p, e = truth(machine), machine.effects
    n = round(duration / PERIOD)
    time = np.arange(n) * PERIOD
    s = np.array([0.0, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0])
    s[2], s[3] = 0.61 / 1.61 * 160e5, 160e5 / 1.61
    s[2] += e.get("gravity", 0.0) / p[AT["area"]]
    play, delayed = np.zeros(4), np.zeros(8)
    target = wanted(kind, time, random)
    feed = np.gradient(target, PERIOD) * 8e-3 if kind not in ("steps",) else np.zeros(n)
    noise = random.standard_normal((n, 5)) * np.array([3e4, 3e4, 3e4, 1e-5, 15.0])
    if machine.coloured:
        for k in range(1, n):
            noise[k] = 0.7 * noise[k] + 0.9 * (noise[k - 1] - 0.0) * 0.75
    drift, keep = 0.0, np.exp(-PERIOD / 4.0)
    table, current = np.zeros((n, 5)), np.zeros(n)
    force = e.get("gravity", 0.0)
    for k in range(n):
        supply = p[AT["supply"]] + 0.5e5 * np.sin(2 * np.pi * 11.0 * time[k])
        table[k] = (s[2], s[3], supply, s[4], force)
        table[k] += noise[k]
        drift = drift * keep + 6e-6 * np.sqrt(1 - keep**2) * random.standard_normal()
        current[k] = np.clip(0.35 * (target[k] - table[k, 3]) + feed[k], -6e-3, 6e-3)
        acting = delay(current, k, e.get("transport_delay", 0.0), delayed, machine.foreign)
        force = advance(p, s, play, acting + drift, supply, time[k], 100)
    readings = transduced(table, e, machine.foreign, time)
    names = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")
    channels = {name: readings[:, i].copy() for i, name in enumerate(names)}
    return Experiment(f"{kind}-{seed}", PERIOD, current, channels)


def delay(u: np.ndarray, k: int, time: float, memory: np.ndarray, foreign: bool) -> float:
    """Return the set point that acts: a dead time, or as a foreign law two equal lags."""
    if time == 0.0:
        return float(u[k])
    if foreign:
        share = 1.0 - np.exp(-PERIOD / (0.5 * time))
        memory[0] += share * (u[k] - memory[0])
        memory[1] += share * (memory[0] - memory[1])
        return float(memory[1])
    return float(
        np.interp(k - time / PERIOD, np.arange(max(0, k - 6), k + 1), u[max(0, k - 6) : k + 1])
    )


def transduced(
    table: np.ndarray, effects: Mapping[str, float], foreign: bool, time: np.ndarray
) -> np.ndarray:
    """Return readings with errors of sensors, in both laws."""
    out = table.copy()
    wander = 1.0 + (0.5 * np.sin(1.3 * time) if foreign else 0.0)
    out[:, 0] += effects.get("pressure_a.offset", 0.0) * wander
    b = table[:, 1] * (np.abs(table[:, 1]) / 100e5 if foreign else 1.0)
    out[:, 1] += effects.get("pressure_b.gain_error", 0.0) * b
    f = table[:, 4] * (np.abs(table[:, 4]) / 400.0 if foreign else 1.0)
    out[:, 4] += effects.get("load_force.gain_error", 0.0) * f
    out[:, 4] += effects.get("load_force.offset", 0.0) * wander
    late = effects.get("position.delay", 0.0)
    if late and foreign:
        share = 1.0 - np.exp(-PERIOD / late)
        for k in range(1, len(out)):
            out[k, 3] = out[k - 1, 3] + share * (table[k, 3] - out[k - 1, 3])
    elif late:
        steps = np.arange(len(out))
        out[:, 3] = np.interp(steps - late / PERIOD, steps, table[:, 3])
    return out


def campaign(machine: Machine) -> tuple[list[Experiment], list[Experiment]]:
    """Return four experiments for training and two of other kinds for validation."""
    kinds = ("multisine", "steps", "triangles", "chirp")
    train = [record(machine, kind, i) for i, kind in enumerate(kinds)]
    return train, [record(machine, kind, 50 + i) for i, kind in enumerate(("fast", "steps"))]
