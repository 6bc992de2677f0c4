"""Binding of objects to channels: samples become values of the dictionary.

Objects have four sources: a sensor channel of the same name or Signal, the device itself
(`INTERNAL`), a device profile, or, for a plain writable object, the writer.
"""

from collections.abc import Callable, Collection, Sequence

from hil_emulator.device.deadline import NEVER
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

MAX_CHANNELS = 0x10000 - ErrorCode.SENSOR_OVERRANGE
"""Each channel has an emergency code of its own."""


class SensorObjects:
    """Turns each tick's sample into object values and range errors.

    Args:
        dictionary: the node's dictionary.
        channels: names of the channels, in the order of `Measured`.
        emergency: reports channels that leave their range.
        claimed: (index, sub-index) of objects that a profile feeds from channels.

    Attributes:
        sources: source of every bound object, by (index, sub-index).
        shown: the last sample, None before the first.
        number: number of the last sample, from 0.
        overrange: argument of the last `check_ranges`.

    Raises:
        UserError: a channel's name is not unique in the dictionary, its object is not a
            number, or there are more channels than emergency codes.

    """

    quiet_until_ns = NEVER  # samples are counted and shown on the fast path as well

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
        self._integers: list[tuple[int, Entry, float, float, int, int]] = []
        self._reals: list[tuple[int, Entry, float, float, float, float]] = []
        for position, name in enumerate(channels):
            shown = dictionary.numbers(name)
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

    def reset(self) -> None:
        """Show the last sample again and report ranges again, because a reset clears both."""
        self.overrange = self._inside
        if self.shown is not None:
            self._show(self.shown)

    def sample(self, now_ns: int, measured: Measured) -> bool:
        """Update every bound object; return whether the sample is new.

        The same object published again keeps its number and its time.
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

        An integer object holds round((SI - offset) / factor), saturated to its reach or its type;
        NaN is shown as the lowest value.
        """
        values = measured.values
        for position, entry, factor, offset, low, high in self._integers:
            raw = (values[position] - offset) / factor
            entry.value = round(raw) if low <= raw <= high else high if raw > high else low
        for position, entry, factor, offset, least, most in self._reals:
            real = (values[position] - offset) / factor
            entry.value = real if least <= real <= most else most if real > most else least
        if self._counter is not None:
            self._counter[0].value = self.number & self._counter[1]
        if self._time is not None:
            self._time[0].value = self._time_us & self._time[1]

    def shown_by(self, count: int) -> dict[Entry, Shown]:
        """Return the content of bound integers by entry, if the last sample's number is `count`.

        Objects with an offset are left out: the machine code that packs samples has only factors.
        """
        shown = {
            e: Shown(at, factor, low, high)
            for at, e, factor, offset, low, high in self._integers
            if not offset
        }
        if self._counter is not None:
            shown[self._counter[0]] = Shown(COUNT, 1.0, self.number - count, self._counter[1])
        if self._time is not None:
            shown[self._time[0]] = Shown(TIME, 1.0, 0, self._time[1])
        return {entry: word for entry, word in shown.items() if entry.type.bits <= WORD_BITS}

    def lag(self, catch_up: Callable[[], None]) -> None:
        """Stop updating the objects' values; the first access to a value calls `catch_up`."""
        for entry in self._bound:
            entry.catch_up = catch_up
            entry.__class__ = Lagging

    def resume(self, passed: int, now_ns: int, measured: Measured | None) -> None:
        """Resume after samples that the fast path has published.

        Args:
            passed: number of these samples.
            now_ns: time of the last sample.
            measured: the last sample; None if the next sample follows at once.

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
        low, high = entry.reach or (kind.low, kind.high)
        if kind.kind == "real":
            self._reals.append((position, entry, entry.factor, entry.offset, low, high))
        else:
            ends = int(low), int(high)
            self._integers.append((position, entry, entry.factor, entry.offset, *ends))

    def _internal(self, dictionary: Dictionary, name: str) -> tuple[Entry, int] | None:
        """Return a device-internal object and the mask it wraps around with."""
        entries = dictionary.numbers(name)
        if not entries or entries[0].type.kind != "integer":
            return None
        entry = entries[0]
        self.sources[entry.index, entry.subindex] = "device"
        return entry, int(entry.type.high)
