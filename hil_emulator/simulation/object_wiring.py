"""Application of a configuration's `map` to a dictionary; names in the EDS then bind no object."""

from collections.abc import Sequence

from hil_emulator.config.object_map import COMMANDS, ObjectSettings
from hil_emulator.device.course import Course
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.scale import Scale
from hil_emulator.errors import UserError


def wire(dictionary: Dictionary, objects: Sequence[ObjectSettings]) -> list[tuple[Entry, Course]]:
    """Bind objects to channels, constants and commands; return those with a course over time.

    Raises:
        UserError: there is no such object, or its type or limits exclude the value.

    """
    dictionary.forget_signals()
    courses = []
    for binding in objects:
        entry = dictionary.get(binding.index, binding.subindex)
        if entry is None:
            raise UserError(f"{dictionary.source} has no object {binding.where}, which map names")
        if binding.constant is not None:
            set_constant(dictionary, entry, binding.constant, nearest=bool(binding.unit))
        elif not entry.type.numeric:
            raise UserError(
                f"{dictionary.source} {binding.where}: a {entry.type.name} is not a number"
            )
        elif binding.points:
            courses.append((entry, Course(binding.points, repeat=binding.repeat)))
        else:
            _bind(dictionary, entry, binding)
    return courses


def _bind(dictionary: Dictionary, entry: Entry, binding: ObjectSettings) -> None:
    """Bind an object to a channel or command, with scale and limits."""
    scale = None
    if binding.factor is not None:
        scale = Scale(binding.unit, binding.factor, binding.offset)
    dictionary.assign(entry, binding.signal, scale)
    if binding.bit is not None:
        if entry.type.kind != "integer" or binding.bit >= entry.type.bits:
            raise UserError(
                f"{dictionary.source} {binding.where}: a {entry.type.name} has no bit {binding.bit}"
            )
        entry.mask = 1 << binding.bit
    if binding.ends is None:
        return
    low, high = binding.ends
    if entry.type.kind == "integer":
        low, high = round(low), round(high)
    if not entry.type.low <= low < high <= entry.type.high:
        raise UserError(
            f"{dictionary.source} {binding.where}: a {entry.type.name} does not hold {low:g} to "
            f"{high:g} digits; choose other digits, or another range"
        )
    if binding.signal in COMMANDS:
        entry.low, entry.high = low, high
    else:
        entry.reach = low, high


def set_constant(
    dictionary: Dictionary, entry: Entry, value: float | str, *, nearest: bool = False
) -> None:
    """Set another default of an object: a number for a number, text for a string.

    A fraction for an integer is refused, unless `nearest` permits rounding.
    """
    if entry.type.numeric:
        if isinstance(value, float) and entry.type.kind == "integer":
            value = round(value) if nearest or value.is_integer() else value
        dictionary.set_default(entry, value)
    else:
        dictionary.set_default(entry, str(value).encode())
    entry.relative = False
