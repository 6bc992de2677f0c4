"""Which set points are in force: what the bus asks for, or their safe values."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.errors import UserError

SAFE_SUFFIX = "_safe"
"""The object `<command>_safe`, where the EDS has one, holds the command's safe value."""


class SetPoints:
    """The commands in force: what the bus asks for, or the safe value.

    A set point object shows the safe value from when its command falls back to it until the bus
    writes the object again. Outside OPERATIONAL the safe values are in force in any case: what
    an SDO writes there waits for the start of the node.

    Args:
        dictionary: the node's dictionary.
        commands: safe value in SI by the name of each command.

    Attributes:
        sources: by (index, sub-index) of every set point, what it commands.
        commands: the value in SI of every command in force.
        stale: whether a value has changed since.

    Raises:
        UserError: a command has no object an RPDO may carry, or its safe value is beyond the
            object's limits.

    """

    quiet_until_ns = NEVER  # set points are taken on the fast path, too

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
        """Whether a set point has another origin than its safe value; true without set points."""
        return not self._objects or len(self._safe) < len(self._objects)

    def fall_back(self, only: Sequence[Entry] | None = None) -> None:
        """Put the safe value into the set points (those among `only`, where given)."""
        self.stale = True
        for _, entry, holder in self._objects:
            if only is None or entry in only:
                entry.value = entry.digits(holder.physical(holder.value))
                self._safe.add(entry)

    def written(self, entries: Sequence[Entry]) -> None:
        """Take note that an RPDO has put values into these objects."""
        self.stale = True
        if self._safe:
            self._safe.difference_update(entries)

    def update(self, *, operational: bool) -> None:
        """Bring the value of every command in SI up to date."""
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
        """Return what puts a value into a set point, as an RPDO does in OPERATIONAL."""
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
        """Let a set point written by SDO leave its safe value, and a new safe value act."""
        self.written([entry])
        self.fall_back([e for _, e, safe in self._objects if safe is entry and e in self._safe])


def _unlisted(entry: Entry) -> Entry:
    """Return a holder for the safe value of a set point whose EDS offers no object for it."""
    return Entry(
        entry.index, entry.subindex, entry.name, entry.type, unit=entry.unit,
        factor=entry.factor, offset=entry.offset,
    )  # fmt: skip


def _first(dictionary: Dictionary, name: str) -> Entry | None:
    return next(iter(dictionary.numbers(name)), None)
