"""How sure a configuration is of its numbers: `mass = { value = "50 kg", tolerance = "10 %" }`.

A tolerance is a relative standard deviation. It may stand with a value, or once in a table for
all that the table states. The simulation takes the value; `identify` takes the tolerance as well.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError, brief
from hil_emulator.model.actuator import PARAMS
from hil_emulator.units import to_si

Where = tuple[str, ...]

KEY = "tolerance"

LARGEST = 10.0
"""Largest tolerance, relative: with it a value has no weight."""

DERIVED: dict[Where, tuple[str, float]] = {
    ("valve", "nominal_flow"): ("valve_gain", 1.0),
    ("valve", "rated_current"): ("valve_gain", 1.0),
    ("valve", "pressure_drop_per_edge"): ("valve_gain", 0.5),
    ("valve", "pressure_drop_total"): ("valve_gain", 0.5),
    ("cylinder", "bore"): ("cylinder_piston_area", 2.0),
    ("load", "slope"): ("gravity_force", 1.0),
}
"""Parameter that follows from a value of a data sheet, and with which power (S1 eq. 3.8)."""


@dataclass(frozen=True)
class FileTolerance:
    """A tolerance that a file states.

    Attributes:
        size: relative standard deviation.
        file: the file.

    """

    size: float
    file: Path


def taken_out(
    layer: Mapping[str, Any], file: Path
) -> tuple[dict[str, Any], dict[Where, FileTolerance]]:
    """Return a file's tables with plain values, and their tolerances.

    Raises:
        UserError: if a tolerance is not a number in range.

    """
    sizes: dict[Where, FileTolerance] = {}
    plain = {table: _plain(content, (table,), file, sizes) if table in PARAMS else content
             for table, content in layer.items()}  # fmt: skip
    return plain, sizes


def _plain(content: Any, where: Where, file: Path, sizes: dict[Where, FileTolerance]) -> Any:
    """Return a table or a value without its tolerance, which goes to `sizes`."""
    if not isinstance(content, dict):
        return content
    if content.keys() == {"value", KEY}:
        sizes[where] = FileTolerance(_size(content[KEY], where, file), file)
        return content["value"]
    inner = {key: _plain(value, (*where, key), file, sizes)
             for key, value in content.items() if key != KEY}  # fmt: skip
    if KEY in content:
        of_all = FileTolerance(_size(content[KEY], where, file), file)
        sizes |= {(*where, key): of_all for key in inner if (*where, key) not in sizes}
    return inner


def _size(text: Any, where: Where, file: Path) -> float:
    place = ".".join((*where, KEY))
    try:
        size = to_si(text, "1", "30 %")
        if not 0.0 <= size <= LARGEST:
            raise ValueError(f'"{brief(text)}" is outside 0 % ... {LARGEST:.0%}')
    except ValueError as error:
        raise UserError(
            f'{file}: {place}: {error}; write the relative standard deviation, such as "30 %"'
        ) from None
    return size


def by_field(
    tolerances: Mapping[Where, FileTolerance],
    origin: Mapping[Where, Path],
    knobs: Mapping[Where, str],
) -> dict[str, float]:
    """Return tolerances by the field of the parameter record.

    Args:
        tolerances: by the place where they stand.
        origin: the file that has the last word there: a value that another file states anew does
            not inherit a tolerance.
        knobs: name of the parameter that is an effect's strength, by table and effect.

    """
    sizes: dict[str, float] = {}
    for where, stated in tolerances.items():
        place = (*where, knobs[where]) if where in knobs else where
        if origin.get(place) != stated.file:
            continue
        name, power = DERIVED.get(place, ("_".join(place[-2:]), 1.0))
        sizes[name] = math.hypot(sizes.get(name, 0.0), power * stated.size)
    return sizes
