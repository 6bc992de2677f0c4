"""The bench on which the blind plant is recorded: closed loop, drift, ripple, noise."""

from typing import Any

import numpy as np
from scipy.signal import cont2discrete, tf2ss

from hil_emulator.identify.measured.experiment import Experiment
from tests.studies.generator.benches import FIRST, Bench
from tests.studies.generator.plant import STEP, Machine, advance, at_rest, pressure
from tests.studies.generator.sensors import CHANNELS, converted, noise, three_lags, transduced

TRAINING = ("multisine", "steps", "triangles", "chirp")
VALIDATION = ("fast", "slow", "stairs")

NULL_DRIFT = 1e-5
"""Standard deviation of the drifting null, a thousandth of the rated current [A]."""

SUPPLY_RIPPLE = 0.5e5
"""Amplitude of the pump's ripple at 11 Hz [Pa]."""


def wanted(kind: str, time: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a wanted way from the middle on the first bench, over time [m]."""
    if kind == "steps":
        return random.uniform(-0.012, 0.012, 40)[(time / 0.3).astype(int) % 40]
    if kind == "triangles":
        return 0.024 * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * time / 2.0))
    if kind == "chirp":
        phase = 2.0 * np.pi * (2.0 * time + 18.0 * time**2 / max(time[-1], 1e-3))
        return 1e-3 * np.sin(phase) / (1.0 + time)
    if kind == "slow":
        return 0.02 * np.sin(2.0 * np.pi * time / 1.7) * np.minimum(1.0, time / 0.3)
    if kind == "stairs":
        goals = np.cumsum(random.choice([-7e-3, 7e-3, 11e-3, -11e-3], 20))
        goals = 0.02 * np.sin(goals / 0.02)
        return np.interp(time, np.arange(20) * 0.25 + np.tile([0.0, 0.1], 10), goals)
    fast = 1.5 if kind == "fast" else 1.0
    frequencies = fast * np.array([0.6, 1.1, 2.3, 4.1, 7.9, 13.0, 23.0, 37.0])
    sizes = np.array([6.0, 5.0, 3.0, 2.0, 1.0, 0.5, 0.25, 0.1]) * 1e-3
    phases = random.uniform(0.0, 2.0 * np.pi, len(sizes))
    waves = np.sin(2.0 * np.pi * np.outer(time, frequencies) + phases) - np.sin(phases)
    return waves @ sizes * np.minimum(1.0, time / 0.4)


LAGGED = 10
"""Steps for which a set point that comes through lags is held, a tenth of a millisecond."""


class SetPoint:
    """What acts at the valve: set points that arrive after a dead time, or three equal lags.

    Args:
        time: dead time, or the sum of the lags [s].
        foreign: whether it is the lags.
        period: between two set points [s].

    """

    def __init__(self, time: float, foreign: bool, period: float) -> None:
        whole, part = divmod(time, period)
        self._period, self._whole, self._part = period, int(whole), part
        self._past, self._inner = [0.0] * 16, np.zeros(3)
        self._lags = _between_halves(time) if foreign and time > 0.0 else None

    def __call__(self, u: float) -> list[tuple[float, int]]:
        """Return what acts after the newest set point, one after the other, and how many steps."""
        if self._lags is not None:
            return [(self._lagged(u, *self._lags), LAGGED)
                    for _ in range(round(self._period / STEP / LAGGED))]  # fmt: skip
        self._past = [u, *self._past[:-1]]
        before = round(self._part / STEP)
        after = round(self._period / STEP) - before
        both = (self._past[self._whole + 1], before), (self._past[self._whole], after)
        return [(acting, steps) for acting, steps in both if steps]

    def _lagged(self, u: float, keep: np.ndarray, feed: np.ndarray, show: np.ndarray) -> float:
        """Return what comes out of the lags in the middle of a part, and go on to its end."""
        middle = keep @ self._inner + feed * u
        self._inner = keep @ middle + feed * u
        return float(show @ middle)


def _between_halves(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what three lags keep of their state in half a part, take in, and show of it."""
    system = cont2discrete(tf2ss(*three_lags(time)), 0.5 * LAGGED * STEP, "zoh")
    return system[0], system[1][:, 0], system[2][0]


def record(
    machine: Machine, effects: dict[str, float], kind: str, seed: Any, duration: float,
    dirty: bool, played: np.ndarray | None = None, bench: Bench = FIRST,
) -> Experiment:  # fmt: skip
    """Run one experiment.

    Args:
        machine: the real machine.
        effects: hidden effects of set point and sensors are taken from here.
        kind: of the wanted motion.
        seed: of motion, drift and noise.
        duration: of the recording [s].
        dirty: threefold drift and ripple, coloured noise, a converter.
        played: wanted position [m] in place of that of the kind.
        bench: its instruments and its controller.

    """
    random, period = np.random.default_rng(seed), bench.period
    time = np.arange(round(duration / period)) * period
    target = played
    if target is None:
        target = bench.middle + bench.way * wanted(kind, time / bench.slowness, random)
    feed = np.zeros(len(time)) if kind == "steps" else bench.lead * np.gradient(target, period)
    scatter = noise(len(time), dirty, random) * np.array(bench.noise)
    drift, keep, plant = 0.0, np.exp(-period / 4.0), 3.0 if dirty else 1.0
    pushes = NULL_DRIFT * plant * np.sqrt(1.0 - keep**2) * random.standard_normal(len(time))
    ripple = SUPPLY_RIPPLE * plant * np.sin(2.0 * np.pi * 11.0 * time)
    acts = SetPoint(effects.get("transport_delay", 0.0), machine.foreign, period)
    table, current = np.zeros((len(time), len(CHANNELS))), np.zeros(len(time))
    s, memory = at_rest(machine)
    force = machine.gravity
    for k in range(len(time)):
        supply = machine.supply + ripple[k]
        table[k] = pressure(s[2]), pressure(s[3]), supply + s[7], s[4], force
        drift = drift * keep + pushes[k]
        measured = s[4] + scatter[k, 3]
        current[k] = np.clip(bench.gain * (target[k] - measured) + feed[k], -6e-3, 6e-3)
        now = time[k]
        for set_point, steps in acts(current[k]):
            force = advance(machine, s, memory, set_point + drift, supply, now, steps)
            now += steps * STEP
    readings = scatter + transduced(
        table, effects, machine.foreign, period, bench.bends, machine.since
    )
    if dirty:
        readings = converted(readings, np.array(bench.steps))
    channels = {name: readings[:, i].copy() for i, name in enumerate(CHANNELS)}
    return Experiment(kind, period, current, channels)
