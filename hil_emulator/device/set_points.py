"""Set points in force: values from the bus, or safe values."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.errors import UserError

SAFE_SUFFIX = "_safe"
"""The object `<command>_safe`, where the EDS has one, holds the command's safe value."""


class SetPoints:
    """The commands in force: values from the bus, or safe values.

    After a fall-back a set point object shows the safe value until the bus writes the object
    again. Outside OPERATIONAL the safe values are always in force; a value written by SDO takes
    effect at the start of the node.

    Args:
        dictionary: the node's dictionary.
        commands: safe value in SI by the name of each command.

    Attributes:
        sources: command of every set point, by (index, sub-index).
        commands: the value in SI of every command in force.
        stale: whether a value has changed since the last update.

    Raises:
        UserError: a command has no RPDO-mappable object, or its safe value exceeds the object's
            limits.

    """

    quiet_until_ns = NEVER  # set points are handled on the fast path as well

    def __init__(self, dictionary: Dictionary, commands: Mapping[str, float]) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self.stale = True
        self._objects: list[tuple[str, Entry, Entry]] = []
        self._safe: set[Entry] = set()
        for name, safe in commands.items():
            entry = _first(dictionary, name)
            if entry is None or not entry.receivable:
                raise UserError(
                    f"{dictionary.source} has no RPDO-mappable object {name!r} for the command "
                    "of this name; add one with PDOMapping=1 and AccessType=rww"
                )
            holder = _first(dictionary, name + SAFE_SUFFIX) or _unlisted(entry)
            for target in (entry, holder):
                dictionary.set_default(target, target.digits(safe))
            self.sources[holder.index, holder.subindex] = f"safe value of {name}"
            self.sources[entry.index, entry.subindex] = f"command {name}"
            self._objects.append((name, entry, holder))
            for target in (entry, holder):
                dictionary.watch(target.index, self)
        self.fall_back()
        self.update(operational=False)

    @property
    def commanded(self) -> bool:
        """Whether the bus has written a set point; true without set points."""
        return not self._objects or len(self._safe) < len(self._objects)

    def fall_back(self, only: Sequence[Entry] | None = None) -> None:
        """Set the set points (those in `only`, if given) to their safe values."""
        self.stale = True
        for _, entry, holder in self._objects:
            if only is None or entry in only:
                entry.value = entry.digits(holder.physical(holder.value))
                self._safe.add(entry)

    def written(self, entries: Sequence[Entry]) -> None:
        """Register that an RPDO has written these objects."""
        self.stale = True
        if self._safe:
            self._safe.difference_update(entries)

    def update(self, *, operational: bool) -> None:
        """Update the value of every command in SI."""
        self.stale = False
        commands: dict[str, float] = {}
        for name, entry, safe in self._objects:
            obeyed = entry if operational else safe
            commands[name] = obeyed.physical(obeyed.value)
        self.commands = commands

    def includes(self, entries: Sequence[Entry]) -> bool:
        """Return whether all of these objects are set points."""
        return set(entries) <= {entry for _, entry, _ in self._objects}

    def obeying(self, entry: Entry) -> Callable[[float], None]:
        """Return a function that writes a set point, as an RPDO does in OPERATIONAL."""
        (name,) = [name for name, target, _ in self._objects if target is entry]

        def obey(value: float) -> None:
            entry.value = value
            if self._safe or self.stale:
                self.written((entry,))
            else:
                self.commands[name] = entry.physical(value)

        return obey

    def check(self, entry: Entry, value: Any) -> None:
        """Accept any value within the object's limits."""

    def changed(self, entry: Entry) -> None:
        """Apply a set point or a safe value that was written by SDO."""
        self.written([entry])
        self.fall_back([e for _, e, safe in self._objects if safe is entry and e in self._safe])


def _unlisted(entry: Entry) -> Entry:
    """Return an entry for the safe value of a set point if the EDS has no object for it."""
    return Entry(
        entry.index, entry.subindex, entry.name, entry.type, unit=entry.unit,
        factor=entry.factor, offset=entry.offset,
    )  # fmt: skip


def _first(dictionary: Dictionary, name: str) -> Entry | None:
    return next(iter(dictionary.numbers(name)), None)
