"""Values of a configuration that differ from those of the machine, with no effect missing."""

from collections.abc import Mapping, Sequence

from hil_emulator.identify.conclusion.findings import Refitted
from hil_emulator.identify.experiment_design.contrast import variation
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import GREATER_PART
from hil_emulator.identify.selection.progress import Search

FarOff = Sequence[tuple[Coordinate, float]]
"""Ordinary parameters far from their configured values, with the estimates of their coordinates."""


def in_words(far: FarOff, parameters: Mapping[str, Refitted]) -> list[str]:
    """Return each value with its interval, and the configured or usual value."""
    return [_words(c, parameters[c.name]) for c, _ in far if c.name in parameters]


def _words(c: Coordinate, value: Refitted) -> str:
    numbers = (value.refitted, value.low, value.high, value.configured)
    now, low, high, before = (value.words(number) for number in numbers)
    origin = f"not {before}" if c.stated else f"which no file states; {before} is usual"
    product = f" (only its product with {' and '.join(c.also)} shows)" if c.also else ""
    return f"{value.called(c.name)} = {now} (95 %: {low} ... {high}){product}, {origin}"


def instead(search: Search, far: FarOff) -> list[Coordinate]:
    """Return the effects that bring a value much nearer to its configured one.

    Each effect was refitted together with all parameters.
    """
    rivals = []
    for trial in search.rounds[-1].trials:
        there = {c.name: float(at) for c, at in
                 zip(trial.fit.coordinates, trial.fit.at, strict=True)}  # fmt: skip
        if any(abs(there.get(c.name, at)) < GREATER_PART * abs(at) for c, at in far):
            rivals.append(trial.score.coordinate)
    return rivals


def competing(values: Sequence[str], names: str, rivals: Sequence[Coordinate]) -> str:
    """Return the two explanations: other values, or a missing effect."""
    return (
        f"two explanations fit: {' and '.join(values)}, with no effect missing; or "
        f"{' or '.join(c.name for c in rivals)} is missing, with {names} nearer to its "
        "configured value"
    )


def separating(names: str, rivals: Sequence[Coordinate]) -> str:
    """Return the measurement that decides between other values and a missing effect."""
    return (
        f"measure {names} directly, or record "
        f"{variation([c.effect for c in rivals if c.effect is not None])}"
    )


def names(far: FarOff, parameters: Mapping[str, Refitted]) -> str:
    """Return the names of the values, as the configuration states them."""
    return " and ".join(
        parameters[c.name].called(c.name) if c.name in parameters else c.name for c, _ in far
    )
