"""Values of a configuration that are other ones in the machine, with nothing else missing."""

from collections.abc import Mapping, Sequence

from hil_emulator.identify.conclusion.findings import Refitted
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import GREATER_PART
from hil_emulator.identify.selection.progress import Search

FarOff = Sequence[tuple[Coordinate, float]]
"""Ordinary parameters that hardly any machine has where they are, and their coordinates."""


def in_words(far: FarOff, parameters: Mapping[str, Refitted]) -> list[str]:
    """Return each value with its uncertainty, and what is configured or usual."""
    return [_words(c, parameters[c.name]) for c, _ in far if c.name in parameters]


def _words(c: Coordinate, value: Refitted) -> str:
    numbers = (value.refitted, value.low, value.high, value.configured)
    now, low, high, before = (value.words(number) for number in numbers)
    origin = f"not {before}" if c.stated else f"which no file states; {before} is usual"
    product = f" (only its product with {' and '.join(c.also)} shows)" if c.also else ""
    return f"{c.name} = {now} (95 %: {low} ... {high}){product}, {origin}"


def instead(search: Search, far: FarOff) -> list[str]:
    """Return the effects with which a value that is far off would be much nearer.

    Each of them was refitted with all parameters free.
    """
    rivals = []
    for trial in search.rounds[-1].trials:
        there = {c.name: float(at) for c, at in
                 zip(trial.fit.coordinates, trial.fit.at, strict=True)}  # fmt: skip
        if any(abs(there.get(c.name, at)) < GREATER_PART * abs(at) for c, at in far):
            rivals.append(trial.score.coordinate.name)
    return rivals


def advice(far: FarOff, rivals: Sequence[str]) -> str:
    """Say which explanations compete, and what would decide."""
    names = " and ".join(c.name for c, _ in far)
    return (
        f"or {' or '.join(rivals)} acts and {names} is nearer to what is configured; "
        f"measure {names} by itself, or record experiments that show one of them alone"
    )
