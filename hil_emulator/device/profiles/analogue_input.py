"""One analogue input of a measuring device: from field value to process value (CiA 404).

    field value -> line through two points -> factor, offset -> filter -> process value -> net value

The field value is the output of the sensing element in its unit; `Unit` and `Factor` of 0x6100 in
the EDS convert it to SI. All other values are in the physical unit 0x6131 and are converted when it
is changed. Objects that the EDS lacks have the default at their declaration.
"""

from typing import Any

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DATA_TYPES, REAL32_MAX, DataType
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.profiles.averaging import Averaging, FilterType
from hil_emulator.device.profiles.physical_unit import si_unit
from hil_emulator.device.trigger import Trigger

FIELD_VALUE = 0x6100
OPERATING_MODE = 0x6112
FIELD_1, PROCESS_1, FIELD_2, PROCESS_2 = 0x6120, 0x6121, 0x6122, 0x6123
OFFSET, AUTOZERO = 0x6124, 0x6125
SCALING_FACTOR, SCALING_OFFSET = 0x6126, 0x6127
PHYSICAL_UNIT, DECIMAL_DIGITS = 0x6131, 0x6132
INTERRUPT_DELTA, INTERRUPT_LOWER, INTERRUPT_UPPER = 0x6133, 0x6134, 0x6135
TARE, AUTOTARE = 0x6138, 0x6139
SPAN_START, SPAN_END = 0x6148, 0x6149
STATUS = 0x6150
FILTER_TYPE, FILTER_CONSTANT = 0x61A0, 0x61A1

PROCESS_VALUES = (0x6130, 0x7130, 0x9130)
"""The process value as REAL32, INTEGER16 and INTEGER32."""
NET_VALUES = (0x6140, 0x7140, 0x9140)
"""The process value less the tare, in the same types."""

SIGNATURES = {
    AUTOZERO: int.from_bytes(b"zero", "little"),
    AUTOTARE: int.from_bytes(b"tara", "little"),
}

NORMAL_OPERATION = 1
"""Operating mode in which the input measures; 0 switches it off."""

NOT_VALID, POSITIVE_OVERLOAD, NEGATIVE_OVERLOAD = 0x01, 0x02, 0x04
"""Bits of 0x6150."""

_Digits = tuple[Entry, float, float, float, bool]
"""An object, its digits per physical unit, limits of its type, whether its type is real."""

_REAL32 = DATA_TYPES[0x08]
_UNSIGNED8 = DATA_TYPES[0x05]
_IN_PHYSICAL_UNIT = (
    PROCESS_1, PROCESS_2, OFFSET, SCALING_OFFSET, INTERRUPT_DELTA, INTERRUPT_LOWER,
    INTERRUPT_UPPER, TARE, SPAN_START, SPAN_END,
)  # fmt: skip


class AnalogueInput:
    """One input, its parameters and its values.

    Args:
        dictionary: the node's dictionary.
        number: sub-index of the input in every object.

    Attributes:
        field: the field value, which the sensor channel of its Signal feeds.
        shown: every object the input feeds.
        trigger: fires on interrupt delta and limits.

    """

    def __init__(self, dictionary: Dictionary, number: int) -> None:
        self._dictionary = dictionary
        self._number = number
        self.field = dictionary.entry(FIELD_VALUE, number)
        self._parameters = {index: self._parameter(index, 0.0) for index in _IN_PHYSICAL_UNIT}
        self._mode = self._parameter(OPERATING_MODE, NORMAL_OPERATION, _UNSIGNED8)
        self._field_1 = self._parameter(FIELD_1, 0.0)
        self._field_2 = self._parameter(FIELD_2, 0.0)
        self._factor = self._parameter(SCALING_FACTOR, 1.0)
        self._unit = dictionary.entry(PHYSICAL_UNIT, number)
        self._digits = self._parameter(DECIMAL_DIGITS, 0, _UNSIGNED8)
        self._filter_type = self._parameter(FILTER_TYPE, FilterType.NONE, _UNSIGNED8)
        self._filter_constant = self._parameter(FILTER_CONSTANT, 1, _UNSIGNED8)
        self._status = self._parameter(STATUS, 0, _UNSIGNED8)
        self._gross = self._existing(PROCESS_VALUES)
        self._net = self._existing(NET_VALUES)
        self._value = 0.0
        self.shown = [*self._gross, *self._net, self._status]
        self.trigger = Trigger(self._gross[0], self._gross[1:])
        self.reload()

    def reload(self) -> None:
        """Take over the parameters, all at once."""
        values = {index: entry.value for index, entry in self._parameters.items()}
        span = self._field_2.value - self._field_1.value
        slope = (values[PROCESS_2] - values[PROCESS_1]) / span if span else 1.0
        self._slope = slope * self._factor.value
        start = values[PROCESS_1] - slope * self._field_1.value
        self._base = start * self._factor.value + values[SCALING_OFFSET] + values[OFFSET]
        self._filter = Averaging(self._filter_type.value, self._filter_constant.value)
        self._tare = values[TARE]
        first, last = values[SPAN_START], values[SPAN_END]
        spanned = first < last
        self._low = first if spanned else -REAL32_MAX
        self._high = last if spanned else REAL32_MAX
        self._scale_objects()
        digit = self._gross[0].factor
        si = self._si
        lower, upper = values[INTERRUPT_LOWER], values[INTERRUPT_UPPER]
        limited = lower < upper
        self.trigger.watch(
            values[INTERRUPT_DELTA] * si / digit,
            lower * si / digit if limited else None,
            upper * si / digit if limited else None,
        )

    def measure(self, direction: int, *, valid: bool) -> None:
        """Turn the field value into process value, net value and status.

        Args:
            direction: -1 below the transducer's range, 0 inside, +1 above.
            valid: whether the transducer reports a number; if not, the values are kept.

        """
        if not valid or self._mode.value != NORMAL_OPERATION:
            self._status.value = NOT_VALID
            return
        value = self._filter(self._slope * self.field.value + self._base)
        self._value = value
        _show(self._gross_digits, value)
        if self._net_digits:
            _show(self._net_digits, value - self._tare)
        status = 0
        if direction > 0 or value > self._high:
            status |= POSITIVE_OVERLOAD
        elif direction < 0 or value < self._low:
            status |= NEGATIVE_OVERLOAD
        self._status.value = status

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse a wrong signature (0800 0020), another unit or equal points (0609 0030)."""
        if entry.index in SIGNATURES:
            if value != SIGNATURES[entry.index]:
                raise SdoAbort(AbortCode.CANNOT_BE_STORED)
        elif entry.index == PHYSICAL_UNIT:
            unit = si_unit(int(value))
            unlike = unit is None or unit[0] != self.field.unit
            if unlike and value != entry.default:
                raise SdoAbort(AbortCode.INVALID_VALUE)
        elif entry.index in (FIELD_1, FIELD_2):
            other = self._field_2 if entry is self._field_1 else self._field_1
            if value == other.value:
                raise SdoAbort(AbortCode.INVALID_VALUE)

    def changed(self, entry: Entry) -> None:
        """Execute a signature, and apply a new parameter."""
        if entry.index == AUTOZERO:
            self._parameters[OFFSET].value -= self._value
        elif entry.index == AUTOTARE:
            self._parameters[TARE].value = self._value
        elif entry.index == PHYSICAL_UNIT:
            self._convert()
        if entry.index in SIGNATURES:
            entry.value = 0  # the signature is a command, not a value
        self.reload()

    def _convert(self) -> None:
        """Express every parameter that is in the physical unit in the new one."""
        unit = si_unit(int(self._unit.value))
        assert unit is not None  # `check` refuses unknown units
        ratio = self._si / unit[1]
        for parameter in self._parameters.values():
            parameter.value *= ratio

    def _scale_objects(self) -> None:
        """Set unit and factor of each value."""
        unit = si_unit(int(self._unit.value)) or (self.field.unit, 1.0)
        self._si = unit[1]
        for entry in (*self._gross, *self._net):
            real = entry.type.kind == "real"
            entry.unit = unit[0]
            entry.factor = unit[1] if real else unit[1] * 10.0 ** -int(self._digits.value)
        self._gross_digits = [_digits(entry, self._si / entry.factor) for entry in self._gross]
        self._net_digits = [_digits(entry, self._si / entry.factor) for entry in self._net]

    def _parameter(self, index: int, missing: float, kind: DataType = _REAL32) -> Entry:
        entry = self._dictionary.number(index, self._number)
        return entry or Entry(index, self._number, "unlisted", kind, default=missing)

    def _existing(self, indices: tuple[int, ...]) -> list[Entry]:
        entries = [self._dictionary.number(index, self._number) for index in indices]
        return [entry for entry in entries if entry is not None]


def _digits(entry: Entry, per_unit: float) -> _Digits:
    kind = entry.type
    return entry, per_unit, kind.low, kind.high, kind.kind == "real"


def _show(objects: list[_Digits], value: float) -> None:
    """Write a value into objects, each in its own digits, saturated."""
    for entry, per_unit, low, high, real in objects:
        raw = value * per_unit
        if not low <= raw <= high:
            raw = high if raw > high else low
        entry.value = raw if real else round(raw)
