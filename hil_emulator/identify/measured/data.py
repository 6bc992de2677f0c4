"""From recordings to experiments on a uniform time grid, with notes on faults of the data."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hil_emulator.identify.measured import grid
from hil_emulator.identify.measured.bad_samples import without_bad_samples
from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import SPANS, Array, Experiment
from hil_emulator.identify.measured.pieces import pieces
from hil_emulator.identify.measured.reading import MeasuredFile, read
from hil_emulator.identify.measured.stated import Stated

DEAD = 1e-9
"""Range of a dead channel's readings relative to its span."""

AS_LARGE_AS_THE_MACHINE = ("position", "load_force")
"""Channels whose range depends on the machine."""

SATURATED = 0.05
"""Share of samples at an extreme value that indicates saturation."""

AT_SPEED = 3.0
"""Ratio of the step to an extreme and the smallest step of a saturated channel (assumed)."""

PRESSURES = ("pressure_a", "pressure_b", "supply_pressure")
"""Channels that are absolute pressures."""

BAR = 1e5

FEWEST_ABSOLUTE = 0.5 * BAR
"""Lowest pressure below which a channel probably holds gauge pressure [Pa] (assumed)."""

LOWEST = 0.02
"""Quantile of the readings for the lowest usual pressure (assumed)."""

UNCOVERED = 0.1
"""Share of an experiment without values of a channel that gets a note (assumed)."""

IMPLAUSIBLE_SPANS = 3.0
"""Multiple of the span beyond which a unit is probably wrong (assumed)."""


def load_experiments(
    files: Sequence[Path], names: Mapping[str, str] | None = None, headings: Sequence[str] = ()
) -> list[Experiment]:
    """Read experiments.

    Args:
        files: tables in a format of `formats`.
        names: channel by the name of its column, where they differ.
        headings: names and units of the columns of files without a header.

    Raises:
        UserError: if a file cannot be used.

    """
    stated = Stated(names or {})
    return [e for file in files for e in experiments(read(file, stated, headings))]


def experiments(recording: MeasuredFile) -> list[Experiment]:
    """Bring each experiment of a recording to a uniform grid and note its faults.

    Raises:
        UserError: if there are too few samples, or two clocks.

    """
    return [_experiment(piece) for piece in pieces(recording)]


def _experiment(recording: MeasuredFile) -> Experiment:
    notes: list[str] = list(recording.notes)
    if recording.ignored:
        notes.append(f"ignored columns: {_some(recording.ignored)}")
    series = without_bad_samples(grid.ordered(recording.series, notes), notes)
    period, columns = grid.uniform(f"{recording.file}{recording.part}", series, notes)
    current = columns.pop(SET_POINT, np.zeros(0))
    if len(current) and recording.set_point_first:
        current = np.append(current[1:], current[-1])
    current, columns = _held(current, columns, notes)
    _inspect(columns, notes)
    readings = {n: v for n, v in columns.items() if np.isfinite(v).any()}
    notes += [note for n, v in readings.items() if (note := _covered(n, v, period))]
    return Experiment(
        recording.name, period, current, readings, tuple(notes), recording.digest,
        bool(recording.set_point_first), recording.set_point_first is None,
    )  # fmt: skip


def _covered(name: str, values: Array, period: float) -> str:
    """Return the time in which a channel has values, in words; "" if it has no long gap."""
    rows = np.flatnonzero(np.isfinite(values))
    first, last, end = rows[0] * period, rows[-1] * period, (len(values) - 1) * period
    gaps = []
    if first > UNCOVERED * end:
        gaps.append(f"begins {first:.4g} s after the others")
    if last < (1.0 - UNCOVERED) * end:
        gaps.append(f"has values until {last:.4g} s of {end:.4g} s only")
    steps = np.diff(rows)
    if len(steps) and steps.max() * period > UNCOVERED * end:
        at = int(np.argmax(steps))
        gaps.append(f"has no value from {rows[at] * period:.4g} to {rows[at + 1] * period:.4g} s")
    return f"{name}: {', '.join(gaps)}; there the other channels decide" if gaps else ""


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return ", ".join(names[:8]) + more


def _held(
    current: Array, columns: dict[str, Array], notes: list[str]
) -> tuple[Array, dict[str, Array]]:
    """Return a set point without gaps, from its first value on: each value holds until the next."""
    good = np.isfinite(current)
    if good.all() or not good.any():
        return (current if good.any() else np.zeros(0)), columns
    first = int(np.argmax(good))
    if first:
        notes.append(f"the first {first} samples came before any {SET_POINT}; left out")
        current, good = current[first:], good[first:]
        columns = {n: v[first:] for n, v in columns.items()}
    if not good.all():
        notes.append(f"{SET_POINT}: {int(np.sum(~good))} missing values; the one before was held")
    last = np.maximum.accumulate(np.where(good, np.arange(len(current)), 0))
    return np.asarray(current[last]), columns


def _inspect(columns: dict[str, Array], notes: list[str]) -> None:
    """Note dead, saturated and implausible channels; remove the dead ones."""
    for name in list(columns):
        values = columns[name][np.isfinite(columns[name])]
        if not len(values):
            continue
        spread = float(np.ptp(values))
        if spread < DEAD * SPANS[name]:
            notes.append(f"{name}: constant at {values[0]:.6g}; the channel is dead, not used")
            del columns[name]
            continue
        far = np.median(np.abs(values)) > IMPLAUSIBLE_SPANS * SPANS[name]
        if far and name not in AS_LARGE_AS_THE_MACHINE:
            notes.append(f"{name}: far beyond a usual range; is its unit right?")
        if name in PRESSURES and np.quantile(values, LOWEST) < FEWEST_ABSOLUTE:
            notes.append(
                f"{name}: falls to {values.min() / BAR:.2g} bar; pressures are absolute here: if "
                'it is a gauge pressure, state its unit as "bar(g)"'
            )
        share = max(_cut_off(values, values.max()), _cut_off(values, values.min()))
        if share > SATURATED and len(np.unique(values)) > 20:
            notes.append(f"{name}: {100 * share:.0f} % at one extreme; saturated?")


def _cut_off(values: Array, extreme: float) -> float:
    """Return the share of readings at an extreme that was reached in a large step; else 0.

    A rod that comes to rest approaches its extreme position in the smallest steps of the sensor.
    """
    steps = np.abs(np.diff(values))
    onto = steps[values[1:] == extreme].max(initial=0.0)
    least = steps[steps > 0.0].min(initial=np.inf)
    return float(np.mean(values == extreme)) if onto > AT_SPEED * least else 0.0
