"""The seam between physics and dictionary: which object shows what.

Four sources feed objects: a sensor channel of the same name or Signal, the device itself
(`INTERNAL`), a device profile, or, for a plain writable object, whoever writes it. Set points go
the other way.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.entry import Entry, Lagging
from hil_emulator.device.measured import Measured
from hil_emulator.device.packed_tpdos import COUNT, TIME, WORD_BITS, Shown
from hil_emulator.errors import UserError

SAMPLE_COUNTER = "sample_counter"
SAMPLE_TIME = "sample_time"
INTERNAL = (SAMPLE_COUNTER, SAMPLE_TIME)
"""Objects the device itself feeds, by ParameterName."""

NS_PER_US = 1_000

SAFE_SUFFIX = "_safe"
"""The object `<command>_safe`, where the EDS has one, holds the command's safe value."""

MAX_CHANNELS = 0x10000 - ErrorCode.SENSOR_OVERRANGE
"""Each channel has an emergency code of its own."""


class SensorObjects:
    """Turns each tick's sample into object values and range errors.

    Args:
        dictionary: the node's dictionary.
        channels: names of the channels, in the order of `Measured`.
        emergency: told of channels that leave their range.
        claimed: (index, sub-index) of objects that a profile turns channels into by itself.

    Attributes:
        sources: by (index, sub-index) of every bound object, what feeds it.
        shown: the last sample, None before the first.
        number: that of the last sample, from 0.
        overrange: the ranges that `check_ranges` was told last.

    Raises:
        UserError: a channel's name is not unique in the dictionary, its object is not a
            number, or there are more channels than emergency codes.

    """

    def __init__(
        self,
        dictionary: Dictionary,
        channels: Sequence[str],
        emergency: Emergency,
        claimed: Collection[tuple[int, int]] = (),
    ) -> None:
        if len(channels) > MAX_CHANNELS:
            raise UserError(f"{len(channels)} channels, but at most {MAX_CHANNELS} are possible")
        self.sources: dict[tuple[int, int], str] = {}
        self._emergency = emergency
        self._inside = [0] * len(channels)
        self.overrange = self._inside
        self.shown: Measured | None = None
        self.number = -1
        self._time_us = 0
        self._positions: list[int] = []
        self._integers: list[tuple[int, Entry, float, int, int]] = []
        self._reals: list[tuple[int, Entry, float, float, float]] = []
        for position, name in enumerate(channels):
            shown = [_checked(dictionary, entry) for entry in dictionary.showing(name)]
            if shown:
                self._positions.append(position)
            for entry in shown:
                if (entry.index, entry.subindex) not in claimed:
                    self._bind(position, entry)
        self._counter = self._internal(dictionary, SAMPLE_COUNTER)
        self._time = self._internal(dictionary, SAMPLE_TIME)
        bound = [entry for _, entry, *_ in (*self._integers, *self._reals)]
        bound += [internal[0] for internal in (self._counter, self._time) if internal is not None]
        self._bound = tuple(bound)

    @property
    def inside(self) -> bool:
        """Whether every channel was inside its range when `check_ranges` was told."""
        return not any(self.overrange)

    def reset(self) -> None:
        """Show the last sample again, and report ranges anew: a reset has cleared both."""
        self.overrange = self._inside
        if self.shown is not None:
            self._show(self.shown)

    def sample(self, now_ns: int, measured: Measured) -> bool:
        """Bring every bound object up to date; return whether the sample is a new one.

        A sample that is published again, the same object, keeps its number and its time.
        """
        if measured is self.shown:
            return False
        self.shown = measured
        self.number += 1
        self._time_us = now_ns // NS_PER_US
        self._show(measured)
        return True

    def _show(self, measured: Measured) -> None:
        """Write a sample into the objects.

        An integer object holds round(SI / factor), saturated to its type; a value that is no
        number shows as the type's lowest.
        """
        values = measured.values
        for position, entry, factor, low, high in self._integers:
            raw = values[position] / factor
            entry.value = round(raw) if low <= raw <= high else high if raw > high else low
        for position, entry, factor, least, most in self._reals:
            real = values[position] / factor
            entry.value = real if least <= real <= most else most if real > most else least
        if self._counter is not None:
            self._counter[0].value = self.number & self._counter[1]
        if self._time is not None:
            self._time[0].value = self._time_us & self._time[1]

    def shown_by(self, count: int) -> dict[Entry, Shown]:
        """Return what bound integers show, by entry, where the last sample's number is `count`."""
        found = {e: Shown(at, factor, low, high) for at, e, factor, low, high in self._integers}
        if self._counter is not None:
            found[self._counter[0]] = Shown(COUNT, 1.0, self.number - count, self._counter[1])
        if self._time is not None:
            found[self._time[0]] = Shown(TIME, 1.0, 0, self._time[1])
        return {entry: shown for entry, shown in found.items() if entry.type.bits <= WORD_BITS}

    def lag(self, catch_up: Callable[[], None]) -> None:
        """Let the objects' values wait until somebody asks for one; that calls `catch_up`."""
        for entry in self._bound:
            entry.catch_up = catch_up
            entry.__class__ = Lagging

    def resume(self, passed: int, now_ns: int, measured: Measured | None) -> None:
        """Go on after samples that others have shown.

        Args:
            passed: how many.
            now_ns: time of the last.
            measured: the last; None where the next one follows at once.

        """
        for entry in self._bound:
            entry.__class__ = Entry
        if passed:
            self.number += passed
            self._time_us = now_ns // NS_PER_US
            self.shown = measured
            if measured is not None:
                self._show(measured)

    def check_ranges(self, overrange: list[int]) -> None:
        """Raise and clear the range error of each shown channel that crossed a limit."""
        for position in self._positions:
            direction = overrange[position]
            if direction:
                self._emergency.raise_error(
                    ("overrange", position),
                    ErrorCode.SENSOR_OVERRANGE + position,
                    ErrorBit.MANUFACTURER,
                    bytes([position, direction & 0xFF]),
                )
            else:
                self._emergency.clear(("overrange", position))
        self.overrange = list(overrange)

    def _bind(self, position: int, entry: Entry) -> None:
        kind = entry.type
        self.sources[entry.index, entry.subindex] = f"channel {entry.signal}"
        if kind.kind == "real":
            self._reals.append((position, entry, entry.factor, kind.low, kind.high))
        else:
            low, high = int(kind.low), int(kind.high)
            self._integers.append((position, entry, entry.factor, low, high))

    def _internal(self, dictionary: Dictionary, name: str) -> tuple[Entry, int] | None:
        """Return a device-internal object and the mask it wraps around with."""
        entry = _numeric(dictionary, name)
        if entry is None or entry.type.kind != "integer":
            return None
        self.sources[entry.index, entry.subindex] = "device"
        return entry, int(entry.type.high)


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

    def __init__(self, dictionary: Dictionary, commands: Mapping[str, float]) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self.stale = True
        self._objects: list[tuple[str, Entry, Entry]] = []
        self._safe: set[Entry] = set()
        for name, safe in commands.items():
            entry = _numeric(dictionary, name)
            if entry is None or not entry.receivable:
                raise UserError(
                    f"{dictionary.source} has no RPDO-mappable object {name!r} for the command "
                    "of this name; add one with PDOMapping=1 and AccessType=rww"
                )
            holder = _numeric(dictionary, name + SAFE_SUFFIX) or _unlisted(entry)
            for target in (entry, holder):
                dictionary.set_default(target, raw_value(target, safe))
            self.sources[holder.index, holder.subindex] = f"safe value of {name}"
            self.sources[entry.index, entry.subindex] = f"command {name}"
            self._objects.append((name, entry, holder))
            for target in (entry, holder):
                dictionary.watch(target.index, self)
        self._names = {entry: name for name, entry, _ in self._objects}
        self.fall_back()
        self.update(operational=False)

    def fall_back(self, only: Sequence[Entry] | None = None) -> None:
        """Put the safe value into the set points (those among `only`, where given)."""
        self.stale = True
        for _, entry, holder in self._objects:
            if only is None or entry in only:
                entry.value = raw_value(entry, holder.value * holder.factor)
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
            commands[name] = obeyed.value * obeyed.factor
        self.commands = commands

    def obeying(self, entry: Entry) -> Callable[[float], None]:
        """Return what puts a value into an object, as an RPDO does in OPERATIONAL."""
        name = self._names.get(entry)

        def obey(value: float) -> None:
            entry.value = value
            if name is None or self._safe or self.stale:
                self.written((entry,))
            else:
                self.commands[name] = value * entry.factor

        return obey

    def check(self, entry: Entry, value: Any) -> None:
        """Accept any value within the object's limits."""

    def changed(self, entry: Entry) -> None:
        """Let a set point written by SDO leave its safe value, and a new safe value act."""
        self.written([entry])
        self.fall_back([e for _, e, safe in self._objects if safe is entry and e in self._safe])


def raw_value(entry: Entry, physical: float) -> float:
    """Return a value in SI as the object's digits."""
    raw = physical / entry.factor
    return round(raw) if entry.type.kind == "integer" else raw


def _unlisted(entry: Entry) -> Entry:
    """Return a holder for the safe value of a set point whose EDS offers no object for it."""
    return Entry(
        entry.index, entry.subindex, entry.name, entry.type, unit=entry.unit, factor=entry.factor
    )


def _numeric(dictionary: Dictionary, name: str) -> Entry | None:
    entry = dictionary.named(name)
    return None if entry is None else _checked(dictionary, entry)


def _checked(dictionary: Dictionary, entry: Entry) -> Entry:
    if not entry.type.numeric:
        raise UserError(
            f"{dictionary.source} {entry.where} {entry.signal}: a {entry.type.name} cannot hold "
            "a number"
        )
    return entry
