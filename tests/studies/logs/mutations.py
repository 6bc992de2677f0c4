"""Logs as accidents make them: cut, spiked, in other units, started again, renamed."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from tests.identify.rig_data import INSTRUMENTS, recorded

Columns = dict[str, np.ndarray]
Mutation = Callable[[Columns, np.random.Generator], Columns]


DURATIONS = (2.5, 3.0, 3.3, 3.7, 4.0)
"""Of the sound logs [s]: of a record of less than two seconds nothing would be named anyway."""


@cache
def sound(kind: str, which: int) -> Columns:
    """Return a sound log by heading; `which` is an index of `DURATIONS`."""
    e = recorded({}, kind, which, DURATIONS[which])
    shown = {"position": ("mm", 1e3), "load_force": ("N", 1.0)}
    columns = {"time [s]": np.arange(e.samples) * e.period, "valve_current [mA]": 1e3 * e.current}
    for name in INSTRUMENTS:
        unit, factor = shown.get(name, ("bar", 1e-5))
        columns[f"{name} [{unit}]"] = factor * e.readings[name]
    return columns


def _channel(c: Columns, random: np.random.Generator) -> str:
    return str(random.choice([h for h in c if not h.startswith("time")]))


def cut(c: Columns, random: np.random.Generator) -> Columns:
    """Keep some rows in a row, or leave some out, or drop a channel."""
    rows = np.arange(len(next(iter(c.values()))))
    a, b = np.sort(random.integers(0, len(rows), 2))
    kept = rows[a:b] if random.random() < 0.5 else np.delete(rows, np.s_[a:b])
    dropped = _channel(c, random) if random.random() < 0.3 else ""
    return {h: v[kept] for h, v in c.items() if h != dropped}


def spiked(c: Columns, random: np.random.Generator) -> Columns:
    """Set half a percent of a channel to zero, to a rail, to anything, or to nothing."""
    name = _channel(c, random)
    values = c[name].copy()
    rows = random.choice(len(values), max(1, len(values) // 200), replace=False)
    level = random.choice([0.0, 1e4, -1e9, np.nan, np.inf, random.normal(0.0, 1e3)])
    values[rows] = level
    return c | {name: values}


def scaled(c: Columns, random: np.random.Generator) -> Columns:
    """Take a channel for another unit."""
    name = _channel(c, random)
    return c | {name: c[name] * random.choice([10.0, 100.0, 1e3, 9.81, 0.1, 1e-3, 1e-9, -1.0])}


def restarted(c: Columns, random: np.random.Generator) -> Columns:
    """Let the clock start again somewhere, once or many times."""
    time = c["time [s]"].copy()
    for at in random.integers(0, len(time), random.integers(1, 6)) if len(time) else ():
        time[at:] -= time[at]
    return c | {"time [s]": time}


def renamed(c: Columns, random: np.random.Generator) -> Columns:
    """Call a channel something else, or like another one, or exchange two."""
    one, other = _channel(c, random), _channel(c, random)
    new = str(random.choice(["CH3", "position", "Position (mm)", "pressure_a_bar", other]))
    return {{one: new, other: one}.get(h, h): v for h, v in c.items()}


MUTATIONS: tuple[Mutation, ...] = (cut, spiked, scaled, restarted, renamed)


def mutated(file: Path, seed: int) -> Path:
    """Write a log to which one to three accidents have happened."""
    random = np.random.default_rng(seed)
    columns = sound(str(random.choice(["multisine", "steps", "triangles"])), seed % len(DURATIONS))
    for _ in range(random.integers(1, 4)):
        columns = MUTATIONS[random.integers(len(MUTATIONS))](columns, random)
    separator = str(random.choice([",", ";", "\t"]))
    rows = np.column_stack(list(columns.values()))
    body = [separator.join(f"{v:.9g}" for v in row) for row in rows]
    file.write_text("\n".join([separator.join(columns), *body]))
    return file
