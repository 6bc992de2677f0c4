"""What a configuration's `map` makes of a dictionary: the EDS's own names no longer count."""

from collections.abc import Sequence

from hil_emulator.config.object_map import ObjectSettings
from hil_emulator.device.course import Course
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.errors import UserError


def wire(dictionary: Dictionary, objects: Sequence[ObjectSettings]) -> list[tuple[Entry, Course]]:
    """Let objects show channels and constants and give commands; return those with a course.

    Raises:
        UserError: there is no such object, or its type or limits exclude the value.

    """
    dictionary.forget_signals()
    courses = []
    for said in objects:
        entry = dictionary.get(said.index, said.subindex)
        if entry is None:
            raise UserError(f"{dictionary.source} has no object {said.where}, which map names")
        if said.constant is not None:
            set_constant(dictionary, entry, said.constant, nearest=bool(said.unit))
        elif not entry.type.numeric:
            raise UserError(f"{dictionary.source} {said.where}: a {entry.type.name} is no number")
        elif said.points:
            courses.append((entry, Course(said.points, repeat=said.repeat)))
        else:
            scale = None if said.factor is None else (said.unit, said.factor)
            dictionary.assign(entry, said.signal, scale)
    return courses


def set_constant(
    dictionary: Dictionary, entry: Entry, value: float | str, *, nearest: bool = False
) -> None:
    """Give an object another default: a number for a number, text for a string.

    A fraction is refused where the object is an integer, unless its `nearest` one is meant.
    """
    if entry.type.numeric:
        if isinstance(value, float) and entry.type.kind == "integer":
            value = round(value) if nearest or value.is_integer() else value
        dictionary.set_default(entry, value)
    else:
        dictionary.set_default(entry, str(value).encode())
    entry.relative = False
