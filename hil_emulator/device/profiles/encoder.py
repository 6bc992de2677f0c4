"""Linear encoders: position in steps, preset, speed, alarms (CiA 406).

position value = ± position / step + offset,   offset = preset - position value when preset
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from hil_emulator.device.datatype import DATA_TYPES
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.measured import Measured
from hil_emulator.device.profiles.cyclic_timer import CyclicTimer
from hil_emulator.device.trigger import Trigger

OPERATING_PARAMETERS = 0x6000
TOTAL_RANGE = 0x6002
PRESET = 0x6003
POSITION = 0x6004
STEP_SETTINGS = 0x6005
MULTI_POSITION = 0x6020
SPEED = 0x6030
OPERATING_STATUS = 0x6500
MEASURING_STEP = 0x6501
ALARMS, SUPPORTED_ALARMS = 0x6503, 0x6504
WARNINGS, SUPPORTED_WARNINGS = 0x6505, 0x6506
OFFSET = 0x6509

SCALING, REVERSED = 0x0004, 0x0008
"""Bits of 0x6000: steps of 0x6005 instead of 0x6501, and the measuring direction."""
POSITION_ERROR = 0x0001
"""Bit of 0x6503: the transducer exceeds its range, or the position exceeds 0x6002."""
FREQUENCY_EXCEEDED = 0x0001
"""Bit of 0x6505: speed exceeds the range of 0x6030."""

_UNSIGNED16 = DATA_TYPES[0x06]
_Limited = tuple[Entry, int, int]
"""An object and the limits of its type."""

STEPS_PER_METRE = 1e9
"""Of the unit of 0x6005:01 and 0x6501, 0.001 um."""
STEPS_PER_METRE_PER_SECOND = 1e5
"""Of the unit of 0x6005:02, 0.01 mm/s."""


class Encoder:
    """A position sensor; the channels are the Signals of 0x6004 or 0x6020:01, and of 0x6030:01.

    Args:
        dictionary: the node's dictionary.
        channels: names of the sensor channels, in the order of `Measured`.

    Attributes:
        sources: source of position, speed and their bits by (index, sub-index).
        triggers: empty; `Delta` in the EDS adds triggers.

    """

    def __init__(self, dictionary: Dictionary, channels: Sequence[str]) -> None:
        self.sources: dict[tuple[int, int], str] = {}
        self.triggers: Sequence[Trigger] = ()
        self._dictionary = dictionary
        self._position_values = [
            entry
            for entry in (dictionary.number(MULTI_POSITION, 1), dictionary.number(POSITION))
            if entry is not None
        ]
        self._position_limited = [_limited(entry) for entry in self._position_values]
        self._speed_value = dictionary.number(SPEED, 1)
        self._speed_limited = None if self._speed_value is None else _limited(self._speed_value)
        signals = [entry.signal for entry in self._position_values if entry.signal in channels]
        self._at = self._wire(channels, signals[0] if signals else "", *self._position_values)
        self._speed_at = None
        if self._speed_value is not None:
            self._speed_at = self._wire(channels, self._speed_value.signal, self._speed_value)
        self._alarms = self._bits(ALARMS)
        self._warnings = self._bits(WARNINGS)
        self._offset = dictionary.number(OFFSET)
        if self._offset is not None:
            self._offset.retained = True
        self._raw = 0
        self._timer = CyclicTimer(dictionary)
        for index in (OPERATING_PARAMETERS, TOTAL_RANGE, PRESET, STEP_SETTINGS):
            dictionary.watch(index, self)
        self.reset()

    def reset(self) -> None:
        """Take over the parameters, all at once."""
        parameters = self._value(OPERATING_PARAMETERS)
        step = self._value(MEASURING_STEP, missing=1) or 1
        if parameters & SCALING:
            step = self._value(STEP_SETTINGS, 1, missing=step) or 1
        self._step = step / STEPS_PER_METRE * (-1 if parameters & REVERSED else 1)
        self._range = self._value(TOTAL_RANGE)
        for entry in self._position_values:
            entry.factor = self._step
        if self._speed_value is not None:
            step = self._value(STEP_SETTINGS, 2, missing=1) or 1
            self._speed_value.factor = step / STEPS_PER_METRE_PER_SECOND
        status = self._dictionary.number(OPERATING_STATUS)
        if status is not None:
            status.value = parameters

    def written(self, entries: Sequence[Entry]) -> None:
        """Execute a preset received by RPDO."""
        for entry in entries:
            if entry.index == PRESET:
                self.changed(entry)

    def measure(self, now_ns: int, measured: Measured) -> None:
        """Convert position and velocity to steps, and update alarms and warnings."""
        alarm = warning = False
        if self._at is not None:
            position = measured.values[self._at]
            valid = math.isfinite(position)
            alarm = measured.overrange[self._at] != 0 or not valid
            if valid:
                self._raw = round(position / self._step)
            alarm = alarm or abs(self._raw) > self._range > 0
            value = self._raw + (0 if self._offset is None else self._offset.value)
            for target in self._position_limited:
                _saturate(target, value)
        if self._speed_at is not None and self._speed_limited is not None:
            speed = measured.values[self._speed_at] / self._speed_limited[0].factor
            if math.isfinite(speed):
                warning = _saturate(self._speed_limited, round(speed))
        self._alarms.value = POSITION_ERROR if alarm else 0
        self._warnings.value = FREQUENCY_EXCEEDED if warning else 0

    def command(
        self, now_ns: int, commands: Mapping[str, float], *, operational: bool
    ) -> Mapping[str, float]:
        """Return the commands unchanged; an encoder has no set point."""
        return commands

    def check(self, entry: Entry, value: Any) -> None:
        """Accept any value within the limits of the EDS."""

    def changed(self, entry: Entry) -> None:
        """Shift the zero so that the present position is the preset value, or apply a parameter."""
        if entry.index == PRESET and self._offset is not None:
            _saturate(_limited(self._offset), entry.value - self._raw)
        else:
            self.reset()

    def _wire(self, channels: Sequence[str], signal: str, *entries: Entry) -> int | None:
        if signal not in channels:
            return None
        for entry in entries:
            self.sources[entry.index, entry.subindex] = f"profile, from {signal}"
        return channels.index(signal)

    def _bits(self, index: int) -> Entry:
        """Return an object of bits; a placeholder if the EDS lacks it."""
        self.sources[index, 0] = "profile"
        return self._dictionary.number(index) or Entry(index, 0, "unlisted", _UNSIGNED16)

    def _value(self, index: int, subindex: int = 0, missing: int = 0) -> int:
        entry = self._dictionary.number(index, subindex)
        return missing if entry is None else int(entry.value)


def _limited(entry: Entry) -> _Limited:
    return entry, int(entry.type.low), int(entry.type.high)


def _saturate(target: _Limited, value: int) -> bool:
    """Write a value saturated to the entry's type; return whether it was saturated."""
    entry, low, high = target
    inside = low <= value <= high
    entry.value = value if inside else low if value < low else high
    return not inside
